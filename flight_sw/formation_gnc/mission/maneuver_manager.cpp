#include "formation_gnc/mission/maneuver_manager.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "formation_gnc/control/science_orbit.hpp"
#include "formation_gnc/control/sun_direction.hpp"

namespace formation_gnc {

using namespace flight_support;

namespace {

std::int64_t after(std::int64_t t_ns, double seconds) {
  return t_ns + static_cast<std::int64_t>(std::floor(seconds * 1e9));
}

double seconds_between(std::int64_t from_ns, std::int64_t to_ns) {
  return 1e-9 * static_cast<double>(to_ns - from_ns);
}

// An escape is planned anew when a*da is known so much better.
constexpr double kSettled = 0.2;

// At most: a*da is 2 / n of an error of velocity along track.
double sigma_a_da_m(const Situation& now) {
  const Matrix6& P = now.relative_covariance_RTN;
  const double n_radps = mean_motion_radps(osculating_from_state(now.chief).a_m);
  return 2.0 / n_radps * std::sqrt(std::max(0.0, P(3, 3) + P(4, 4) + P(5, 5)));
}

}  // namespace

RelativeOrbit relative_orbit(const Situation& now) {
  RelativeOrbit orbit;
  orbit.t_ns = now.t_ns;
  orbit.chief = mean_from_osculating(osculating_from_state(now.chief));
  orbit.a_roe =
      relative_elements(orbit.chief, mean_from_osculating(osculating_from_state(now.deputy)));
  return orbit;
}

ManeuverManager::ManeuverManager(const GravityModel& gravity, const ManeuverOptions& options)
    : gravity_(gravity), options_(options) {}

void ManeuverManager::enter(const Event& event) {
  event_ = event;
  plan_ = TransferPlan();
  next_burn_ = 0;
  planned_ = false;
  replan_ns_ = realign_ns_ = 0;
}

const char* ManeuverManager::trouble() {
  const char* was = trouble_;
  trouble_ = nullptr;
  return was;
}

std::int64_t ManeuverManager::earliest_ns(const Situation& now) const {
  return std::max(after(now.t_ns, options_.burn_lead_s + 15.0),
                  after(last_burn_ns_, options_.limits.spacing_s));
}

// With the least lead the thruster takes.
std::int64_t ManeuverManager::soonest_ns(const Situation& now) const {
  return std::max(after(now.t_ns, options_.least_lead_s + 5.0),
                  after(last_burn_ns_, options_.limits.spacing_s));
}

std::int64_t ManeuverManager::next_observation_ns(const Situation& now,
                                                  std::int64_t after_ns) const {
  const OrbitElements chief = mean_from_osculating(osculating_from_state(now.chief));
  return observation_epoch_ns(chief, now.t_ns, sun_direction_EME2000(after_ns), after_ns);
}

RelativeElements ManeuverManager::science_goal(const Situation& now,
                                               std::int64_t observation_ns) const {
  const OrbitElements chief = mean_from_osculating(osculating_from_state(now.chief));
  const OrbitElements then = propagate_mean(chief, seconds_between(now.t_ns, observation_ns));
  return science_elements(then, sun_direction_EME2000(observation_ns), options_.separation_m);
}

bool ManeuverManager::next(const Situation& now, Impulse* wanted) {
  if (now.t_ns < after(last_burn_ns_, options_.settle_s)) return false;
  switch (event_.mode) {
    case Mode::kTransfer:
      if (now.t_ns >= replan_ns_) plan_transfer(now);
      break;
    case Mode::kScience:
      if (observation_ns_ != 0 && now.t_ns >= after(observation_ns_, -options_.alignment_s)) {
        return align(now, wanted);
      }
      if (now.t_ns >= replan_ns_) plan_science(now);
      break;
    case Mode::kEscape:
      if (must_plan_escape(now)) plan_escape(now);
      break;
    default:
      return false;
  }
  return next_of_plan(now, wanted);
}

void ManeuverManager::plan_to(const Situation& now, const TransferGoal& goal,
                              std::int64_t last_ns) {
  TransferOptions options;
  options.limits = options_.limits;
  options.first_ns = earliest_ns(now);
  options.last_ns = last_ns;
  options.waypoints = options_.waypoints;
  // Nothing left is a budget that no plan keeps to.
  options.budget_mps = std::max(std::min(options.budget_mps, now.budget_mps), 1e-9);
  TransferStart start;
  start.orbit = relative_orbit(now);
  start.a_da_rate_mps = now.a_da_rate_mps;
  take(ReconfigurationPlanner(options).plan(start, goal));
}

void ManeuverManager::take(TransferPlan&& plan) {
  ++plans_;
  if (!plan.usable()) {
    trouble_ = to_string(plan.status);
    return;
  }
  plan_ = std::move(plan);
  next_burn_ = 0;
}

bool ManeuverManager::must_plan_escape(const Situation& now) const {
  if (!planned_) return true;
  const double sigma_da_m = sigma_a_da_m(now);
  if (escape_sigma_da_m_ > options_.escape_da_m && sigma_da_m < kSettled * escape_sigma_da_m_) {
    return true;
  }
  const bool over = !plan_.usable() || next_burn_ == plan_.burns.size();
  if (!over || now.t_ns < replan_ns_ || sigma_da_m > options_.escape_da_m) return false;
  const RelativeElements a_roe = relative_orbit(now).a_roe;
  return std::fabs(a_roe[kDa]) > options_.escape_da_m ||
         std::hypot(a_roe[kDex], a_roe[kDey]) < options_.escape_m ||
         std::hypot(a_roe[kDix], a_roe[kDiy]) < options_.escape_m;
}

// Nearly all of its burns are as large as the thruster allows.
void ManeuverManager::plan_escape(const Situation& now) {
  SeparationOptions options;
  options.limits = options_.limits;
  take(SeparationMonitor(options).escape(
      {now.t_ns, now.chief, now.deputy, now.relative_covariance_RTN}, soonest_ns(now)));
  planned_ = true;
  escape_sigma_da_m_ = sigma_a_da_m(now);
  replan_ns_ = after(now.t_ns, options_.escape_replan_s);
}

// The goal holds at the first observation after the arrival: what the orbit does until then is the
// planner's to foresee.
void ManeuverManager::plan_transfer(const Situation& now) {
  if (now.sigma_r_m > options_.planning_sigma_r_m) return;
  if (earliest_ns(now) >= event_.end_ns) return;
  TransferGoal goal;
  goal.end_ns = event_.end_ns;
  if (event_.a_m > 0.0 || event_.b_m > 0.0) {
    goal.a_roe[kDey] = event_.a_m;
    goal.a_roe[kDiy] = event_.b_m;
  } else {
    goal.end_ns = next_observation_ns(now, event_.end_ns);
    goal.a_roe = science_goal(now, goal.end_ns);
  }
  plan_to(now, goal, event_.end_ns);
  // Once more shortly before the end, but not while too little time is left to act.
  replan_ns_ = after(now.t_ns, options_.transfer_replan_s);
}

void ManeuverManager::plan_science(const Situation& now) {
  if (now.sigma_r_m > options_.planning_sigma_r_m) return;
  TransferGoal goal;
  goal.end_ns = observation_ns_ != 0
                    ? observation_ns_
                    : next_observation_ns(now, after(now.t_ns, 2.0 * options_.alignment_s));
  const std::int64_t last_ns = after(goal.end_ns, -options_.alignment_s);
  replan_ns_ = after(now.t_ns, options_.science_replan_s);
  if (seconds_between(earliest_ns(now), last_ns) < 4.0 * options_.limits.spacing_s) return;
  goal.a_roe = science_goal(now, goal.end_ns);
  plan_to(now, goal, last_ns);
}

bool ManeuverManager::next_of_plan(const Situation& now, Impulse* wanted) {
  if (!plan_.usable()) return false;
  while (next_burn_ < plan_.burns.size() &&
         plan_.burns[next_burn_].t_ns < after(now.t_ns, options_.least_lead_s)) {
    ++next_burn_;  // too late for it
  }
  if (next_burn_ == plan_.burns.size()) return false;
  const Burn& burn = plan_.burns[next_burn_];
  if (burn.t_ns > after(now.t_ns, options_.burn_lead_s)) return false;
  const StateEci then = propagate(gravity_, now.deputy, now.t_ns, burn.t_ns);
  wanted->t_ns = burn.t_ns;
  wanted->dv_ECI = dv_eci_from_rtn(then, burn.dv_RTN);
  from_plan_ = true;
  return true;
}

bool ManeuverManager::align(const Situation& now, Impulse* wanted) {
  if (now.sigma_r_m > options_.alignment_sigma_r_m || now.t_ns < realign_ns_) return false;
  const std::int64_t earliest = soonest_ns(now);
  if (earliest > after(observation_ns_, -options_.last_trim_s)) return false;
  AlignmentOptions options;
  options.separation_m = options_.separation_m;
  options.limits = options_.limits;
  options.errors = options_.errors;
  options.last_trim_before_s = options_.last_trim_s;
  const Vec3 sun = sun_direction_EME2000(observation_ns_);
  const TrimPlan trims =
      FineAlignment(gravity_, options)
          .plan({now.t_ns, now.chief, now.deputy}, earliest, observation_ns_, sun, true);
  ++plans_;
  realign_ns_ = after(now.t_ns, 30.0);
  if (trims.count == 0) return false;
  if (trims.impulse[0].t_ns > after(now.t_ns, options_.burn_lead_s)) {
    realign_ns_ = std::max(realign_ns_, after(trims.impulse[0].t_ns, -options_.burn_lead_s));
    return false;
  }
  *wanted = trims.impulse[0];
  from_plan_ = false;
  return true;
}

void ManeuverManager::commanded(const Impulse& wanted, bool accepted) {
  if (from_plan_) ++next_burn_;
  if (accepted) last_burn_ns_ = wanted.t_ns;
  if (!accepted && event_.mode == Mode::kEscape) planned_ = false;
}

}  // namespace formation_gnc
