#include "formation_gnc/control/reconfiguration_planner.hpp"

#include <cmath>
#include <initializer_list>

#include "formation_gnc/control/impulse_split.hpp"
#include "support/orbit/constants.hpp"

namespace formation_gnc {

using namespace flight_support;

namespace {

bool is_sound(const TransferStart& start, const TransferGoal& goal,
              const TransferOptions& options) {
  const OrbitElements& c = start.orbit.chief;
  const double e2 = c.ex * c.ex + c.ey * c.ey;
  // Written so that a NaN is refused.
  const bool orbit = c.a_m > 6.4e6 && c.a_m < 5e7 && e2 < 0.25 && std::sin(c.i_rad) > 1e-3 &&
                     std::isfinite(c.u_rad) && std::isfinite(c.raan_rad);
  const ImpulseLimits& limits = options.limits;
  const bool settings =
      limits.max_mps > 0.0 && limits.min_mps >= 0.0 && limits.min_mps < limits.max_mps &&
      limits.spacing_s >= 1.0 && options.waypoints >= 0 && options.waypoints <= 8 &&
      options.max_candidates >= 8 && options.max_candidates <= 2000 && options.budget_mps > 0.0;
  const Window window = burn_window(start, goal, options);
  return orbit && settings && is_finite(start.orbit.a_roe) && is_finite(goal.a_roe) &&
         std::isfinite(start.a_da_rate_mps) && window.first_ns >= start.orbit.t_ns &&
         window.last_ns > window.first_ns && window.last_ns <= goal.end_ns;
}

void fill(const ImpulseSplit& split, const std::vector<Candidate>& candidates, TransferPlan* plan) {
  plan->burns.clear();
  plan->delta_v_mps = 0.0;
  for (std::size_t k = 0; k < candidates.size(); ++k) {
    const double size_mps = norm(split.dv_RTN[k]);
    if (!(size_mps > 0.0)) continue;
    plan->burns.push_back({candidates[k].t_ns, split.dv_RTN[k]});
    plan->delta_v_mps += size_mps;
  }
}

double required_distance_m(const TransferStart& start, const TransferGoal& goal,
                           const TransferOptions& options) {
  const double ends_m =
      std::fmin(minimum_radial_normal_m(start.orbit.a_roe), minimum_radial_normal_m(goal.a_roe));
  return std::fmin(options.min_radial_normal_m, 0.95 * ends_m);
}

// Fills in what is left to know of a plan, and judges it.
PlanStatus judge(const TransferStart& start, const TransferGoal& goal,
                 const TransferOptions& options, const std::vector<Candidate>& candidates,
                 const ImpulseSplit& split, PlanStatus if_good, TransferPlan* plan) {
  fill(split, candidates, plan);
  plan->miss = transfer_miss(start, goal) - total_effect(candidates, split.dv_RTN);
  if (goal.along_track_free) plan->miss[kDl] = 0.0;
  plan->safe_distance_m =
      plan_safe_distance_m(start.orbit, plan->burns.data(), static_cast<int>(plan->burns.size()));
  if (!(plan->safe_distance_m >= required_distance_m(start, goal, options))) {
    return PlanStatus::kUnsafe;
  }
  if (!(plan->delta_v_mps <= options.budget_mps)) return PlanStatus::kOverBudget;
  return if_good;
}

}  // namespace

const char* to_string(PlanStatus status) {
  switch (status) {
    case PlanStatus::kPlanned:
      return "planned";
    case PlanStatus::kFallback:
      return "fallback";
    case PlanStatus::kInfeasible:
      return "infeasible";
    case PlanStatus::kUnsafe:
      return "unsafe";
    case PlanStatus::kOverBudget:
      return "over budget";
    case PlanStatus::kBadInput:
      return "bad input";
  }
  return "";
}

// With waypoints, then without, then in closed form: the first that is safe and affordable.
TransferPlan ReconfigurationPlanner::plan(const TransferStart& start,
                                          const TransferGoal& goal) const {
  TransferPlan plan;
  if (!is_sound(start, goal, options_)) return plan;
  const std::vector<Candidate> candidates = transfer_candidates(start, goal, options_);
  plan.candidates = static_cast<int>(candidates.size());
  plan.status = PlanStatus::kInfeasible;
  const auto offer = [&](const ImpulseSplit& split, PlanStatus if_good) {
    plan.solver_iterations += split.iterations;
    if (!split.found) return false;
    plan.status = judge(start, goal, options_, candidates, split, if_good, &plan);
    return plan.usable();
  };
  if (options_.use_cone_program) {
    for (const int waypoints : {options_.waypoints, 0}) {
      const ImpulseSplit split =
          split_by_cone_program(start, goal, options_, waypoints, candidates);
      if (offer(split, PlanStatus::kPlanned)) return plan;
      if (waypoints == 0) break;
    }
  }
  offer(split_closed_form(start, goal, options_, candidates), PlanStatus::kFallback);
  return plan;
}

DeltaVBounds delta_v_bounds(const TransferStart& start, const TransferGoal& goal,
                            const TransferOptions& options) {
  DeltaVBounds bounds;
  if (!is_sound(start, goal, options)) return bounds;
  const RelativeElements miss = transfer_miss(start, goal);
  const Window window = burn_window(start, goal, options);
  const double n = mean_motion_radps(start.orbit.chief.a_m);
  const double rest_s = seconds(goal.end_ns - window.first_ns);
  const double in_plane_m =
      std::fmax(std::fmax(std::fabs(miss[kDa]), std::hypot(miss[kDex], miss[kDey])) / 2.0,
                std::fabs(miss[kDl]) / (3.0 * n * rest_s));
  bounds.separate_mps = n * (in_plane_m + std::hypot(miss[kDix], miss[kDiy]));
  bounds.joint_mps = joint_bound_mps(goal, miss, transfer_candidates(start, goal, options));
  return bounds;
}

}  // namespace formation_gnc
