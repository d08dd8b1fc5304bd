#include "reconfiguration_planner.hpp"

#include <cmath>
#include <cstdlib>

#include "support/orbit/closed_form_impulses.hpp"
#include "support/orbit/constants.hpp"
#include "support/orbit/passive_safety.hpp"

namespace formation_keeping {

using namespace flight_support;

namespace {

using flight_support::Vec3;
using flight_support::vec3;

static_assert(Plan::kMaxBurns >= 2 * kMaxOpportunities, "every normal part may stand alone");

// Triples are chosen among the first opportunities, six revolutions; what is left to do after them
// is planned again.
constexpr int kTripleOpportunities = 12;
// Changes below this have no phase worth flying to [m].
constexpr double kNoChange_m = 0.02;
// What "as cheap as the cheapest" allows.
constexpr double kCostRatio = 1.02, kCostExcess_mps = 5e-4;
// Small changes have phases that move with the estimate, and half a revolution is a long wait: of
// changes below this, an opportunity missed by less than the grace is flown at the start of the
// window. Off its phase by 9 deg at most, it leaves 16 % of the change undone.
constexpr double kSmallChange_m = 6.0;
constexpr double kGrace_s = 150.0;

struct Opportunities {
  Opportunity list[kMaxOpportunities];
  int count = 0;
};

// One way to lay out burns.
struct Layout {
  Opportunities in_plane, normal;
  bool joint;  // normal parts are at the in-plane opportunities
  double in_plane_phase_rad, normal_phase_rad;
};

double phase_of(const RelativeElements& miss, int x, int y) {
  return std::atan2(miss[y], miss[x]);
}

bool has_change(const RelativeElements& miss, int x, int y) {
  return std::hypot(miss[x], miss[y]) > kNoChange_m;
}

// The mean argument of latitude at which the true one is `theta_rad`.
double mean_argument_rad(const OrbitElements& orbit, double theta_rad) {
  OrbitElements at = orbit;
  at.u_rad = theta_rad;
  for (int k = 0; k < 4; ++k) {
    at.u_rad += wrap_pi(theta_rad - true_argument_of_latitude_rad(at));
  }
  return at.u_rad;
}

// From now to the passage of true argument of latitude phase + k pi near `ahead_rad` of mean
// argument.
double seconds_to_passage(const OrbitElements& chief, double phase_rad, double ahead_rad) {
  const double rate_radps = secular_rates(chief).u_radps;
  const OrbitElements near = propagate_mean(chief, ahead_rad / rate_radps);
  // Both halves of a turn differ by the equation of the centre; modulo pi.
  const double off_rad = wrap_pi(2.0 * (phase_rad - true_argument_of_latitude_rad(near))) / 2.0;
  return (ahead_rad + off_rad) / rate_radps;
}

// All passages of the phase in the window, and one that was missed by less than the grace.
Opportunities opportunities_at(const FormationState& now, const Goal& goal,
                               const BurnWindow& window, double phase_rad, double grace_s) {
  Opportunities found;
  const double first_s = seconds(window.first_ns - now.t_ns);
  const double to_phase_rad =
      wrap_two_pi(mean_argument_rad(now.chief, phase_rad) - now.chief.u_rad);
  for (double ahead_rad = std::fmod(to_phase_rad, kPi) - kPi; found.count < kMaxOpportunities;
       ahead_rad += kPi) {
    double after_s = seconds_to_passage(now.chief, phase_rad, ahead_rad);
    if (after_s < first_s && after_s > first_s - grace_s) after_s = first_s;
    const std::int64_t t_ns = now.t_ns + nanoseconds(after_s);
    if (t_ns > window.last_ns) break;
    if (t_ns < window.first_ns) continue;
    const OrbitElements at = propagate_mean(now.chief, after_s);
    found.list[found.count++] = {
        t_ns, state_transition(at, seconds(goal.end_ns - t_ns)) * control_input(at)};
  }
  return found;
}

// Where a normal burn must be so that what it has become at the goal's end is a change of a*di
// along `phase_rad`: J2 lets a*diy drift with a*dix, by D of it. Exact for burns half a revolution
// into the window.
double normal_burn_phase(const FormationState& now, const Goal& goal, const BurnWindow& window,
                         double phase_rad) {
  const double half_turn_s = kPi / mean_motion_radps(now.chief.a_m);
  const double left_s = std::fmax(seconds(goal.end_ns - window.first_ns) - half_turn_s, 0.0);
  const double D = state_transition(now.chief, left_s)(kDiy, kDix);
  return std::atan2(std::sin(phase_rad) - D * std::cos(phase_rad), std::cos(phase_rad));
}

// Joint burns at the phase of a*di, or of a*de where there is no other; and, where both change,
// burns apart. Without either, a*da and a*dl may be changed anywhere: at the phase of the goal's
// a*de, which does not move with the estimate. @return how many layouts have an opportunity.
int layouts_for(const FormationState& now, const Goal& goal, const RelativeElements& miss,
                const BurnWindow& window, Layout (&layouts)[2]) {
  const bool de = has_change(miss, kDex, kDey), di = has_change(miss, kDix, kDiy);
  const double de_phase = phase_of(de ? miss : goal.a_roe, kDex, kDey);
  const double di_phase = di ? phase_of(miss, kDix, kDiy) : de_phase;
  const double size_m =
      std::fmax(std::hypot(miss[kDex], miss[kDey]), std::hypot(miss[kDix], miss[kDiy]));
  const double grace_s = size_m < kSmallChange_m ? kGrace_s : 0.0;
  int count = 0;
  Layout& joint = layouts[0];
  const double normal_phase = di ? normal_burn_phase(now, goal, window, di_phase) : di_phase;
  joint.in_plane = opportunities_at(now, goal, window, normal_phase, grace_s);
  joint.joint = true;
  joint.in_plane_phase_rad = joint.normal_phase_rad = di_phase;
  if (joint.in_plane.count > 0) ++count;
  if (!de || !di) return count;
  Layout& apart = layouts[count];
  apart.in_plane = opportunities_at(now, goal, window, de_phase, grace_s);
  apart.normal = opportunities_at(now, goal, window, normal_phase, grace_s);
  apart.joint = false;
  apart.in_plane_phase_rad = de_phase;
  apart.normal_phase_rad = di_phase;
  return apart.in_plane.count > 0 && apart.normal.count > 0 ? count + 1 : count;
}

const Opportunity* nearest(const Opportunities& all, std::int64_t t_ns) {
  const Opportunity* best = &all.list[0];
  for (int k = 1; k < all.count; ++k) {
    if (std::llabs(all.list[k].t_ns - t_ns) < std::llabs(best->t_ns - t_ns)) best = &all.list[k];
  }
  return best;
}

void add_opportunity(const Layout& layout, int index, BurnChoice* choice) {
  const Opportunity* at = &layout.in_plane.list[index];
  choice->in_plane[choice->count] = at;
  choice->normal[choice->count] = layout.joint ? at : nearest(layout.normal, at->t_ns);
  ++choice->count;
}

BurnChoice no_burns(const Layout& layout) {
  BurnChoice choice{};
  choice.in_plane_phase_rad = layout.in_plane_phase_rad;
  choice.normal_phase_rad = layout.normal_phase_rad;
  return choice;
}

// Visits the burns at `first` to `first + count - 1`.
template <class Visit>
void visit_run(const Layout& layout, int count, const Visit& visit) {
  BurnChoice choice = no_burns(layout);
  for (int k = 0; k < count; ++k) add_opportunity(layout, k, &choice);
  visit(choice);
}

// Visits every triple, the earliest end first; with fewer than three opportunities, all there are.
template <class Visit>
void visit_triples(const Layout& layout, const Visit& visit) {
  const int available = layout.in_plane.count;
  if (available < 3) visit_run(layout, available, visit);
  for (int last = 2; last < available && last < kTripleOpportunities; ++last) {
    for (int middle = 1; middle < last; ++middle) {
      for (int first = 0; first < middle; ++first) {
        BurnChoice choice = no_burns(layout);
        add_opportunity(layout, first, &choice);
        add_opportunity(layout, middle, &choice);
        add_opportunity(layout, last, &choice);
        visit(choice);
      }
    }
  }
}

double least_delta_v_mps(const Layout& layout, const RelativeElements& miss) {
  double least = INFINITY;
  visit_triples(layout, [&](const BurnChoice& choice) {
    Impulses impulses;
    if (!solve_impulses(choice, miss, &impulses)) return;
    least = std::fmin(least, delta_v_mps(choice, impulses));
  });
  return least;
}

void insert(Plan* plan, std::int64_t t_ns, const Vec3& dv_RTN) {
  int at = plan->count;
  while (at > 0 && plan->burns[at - 1].t_ns > t_ns) --at;
  if (at > 0 && plan->burns[at - 1].t_ns == t_ns) {
    plan->burns[at - 1].dv_RTN = plan->burns[at - 1].dv_RTN + dv_RTN;
    return;
  }
  for (int k = plan->count; k > at; --k) plan->burns[k] = plan->burns[k - 1];
  plan->burns[at] = {t_ns, dv_RTN};
  ++plan->count;
}

void drop_small_burns(Plan* plan, double min_impulse_mps) {
  int kept = 0;
  for (int k = 0; k < plan->count; ++k) {
    if (norm(plan->burns[k].dv_RTN) >= min_impulse_mps) plan->burns[kept++] = plan->burns[k];
  }
  plan->count = kept;
}

Plan plan_of(const BurnChoice& choice, const Impulses& impulses, double min_impulse_mps) {
  Plan plan;
  for (int k = 0; k < choice.count; ++k) {
    insert(&plan, choice.in_plane[k]->t_ns, vec3(impulses.radial[k], impulses.tangential[k], 0.0));
    insert(&plan, choice.normal[k]->t_ns, vec3(0.0, 0.0, impulses.normal[k]));
  }
  drop_small_burns(&plan, min_impulse_mps);
  for (int k = 0; k < plan.count; ++k) plan.delta_v_mps += norm(plan.burns[k].dv_RTN);
  return plan;
}

double largest_burn_mps(const Plan& plan) {
  double largest = 0.0;
  for (int k = 0; k < plan.count; ++k) largest = std::fmax(largest, norm(plan.burns[k].dv_RTN));
  return largest;
}

bool ends_before(const Plan& a, const Plan& b) {
  if (b.count == 0) return false;
  return a.count == 0 || a.burns[a.count - 1].t_ns < b.burns[b.count - 1].t_ns;
}

// The acceptable plan that ends first, among those offered to it.
class Selection {
 public:
  Selection(const PlannerOptions& options, const FormationState& now, const RelativeElements& miss,
            double affordable_mps)
      : options_(options),
        now_(now),
        miss_(miss),
        affordable_mps_(affordable_mps),
        // A formation that is closer already cannot be asked for more than it has.
        safe_m_(std::fmin(options.min_radial_normal_m,
                          0.98 * minimum_radial_normal_m(now.relative.mean))) {}

  void offer(const BurnChoice& choice) {
    Impulses impulses;
    if (!solve_impulses(choice, miss_, &impulses)) return;
    Plan plan = plan_of(choice, impulses, options_.min_impulse_mps);
    if (plan.delta_v_mps > affordable_mps_ || (found_ && !ends_before(plan, best_))) return;
    if (options_.max_impulse_mps > 0.0 && largest_burn_mps(plan) > options_.max_impulse_mps) return;
    plan.safe_distance_m = plan_safe_distance_m(now_, plan);
    if (plan.safe_distance_m < safe_m_) return;
    best_ = plan;
    found_ = true;
  }

  bool found() const { return found_; }
  const Plan& best() const { return best_; }

 private:
  const PlannerOptions& options_;
  const FormationState& now_;
  const RelativeElements& miss_;
  double affordable_mps_, safe_m_;
  bool found_ = false;
  Plan best_;
};

}  // namespace

double plan_safe_distance_m(const FormationState& now, const Plan& plan) {
  return flight_support::plan_safe_distance_m({now.t_ns, now.chief, now.relative.mean}, plan.burns,
                                              plan.count);
}

RelativeElements predicted_miss(const FormationState& now, const Goal& goal) {
  return goal.a_roe -
         state_transition(now.chief, seconds(goal.end_ns - now.t_ns)) * now.relative.mean;
}

bool ReconfigurationPlanner::plan(const FormationState& now, const Goal& goal,
                                  const RelativeElements& miss, const BurnWindow& window,
                                  Plan* plan) const {
  Layout layouts[2];
  const int layout_count = layouts_for(now, goal, miss, window, layouts);
  double least = INFINITY;
  for (int k = 0; k < layout_count; ++k) {
    least = std::fmin(least, least_delta_v_mps(layouts[k], miss));
  }
  Selection selection(options_, now, miss, kCostRatio * least + kCostExcess_mps);
  const auto offer = [&](const BurnChoice& choice) { selection.offer(choice); };
  for (int k = 0; k < layout_count; ++k) visit_triples(layouts[k], offer);
  // More burns than three only where the impulse limit asks for them.
  for (int burns = 4; !selection.found() && burns <= kMaxOpportunities; ++burns) {
    for (int k = 0; k < layout_count; ++k) {
      if (burns <= layouts[k].in_plane.count) visit_run(layouts[k], burns, offer);
    }
  }
  if (selection.found()) *plan = selection.best();
  return selection.found();
}

}  // namespace formation_keeping
