#include "reconfiguration_planner.hpp"

#include <cmath>
#include <cstdlib>

#include "constants.hpp"

namespace formation_keeping {
namespace {

using flight_support::Matrix;
using flight_support::Vec3;
using flight_support::Vector;

// Six revolutions ahead; what is left to do after them is planned again.
constexpr int kMaxOpportunities = 12;
constexpr int kMaxSteps = 8;
// Changes below this have no phase worth flying to [m].
constexpr double kNoChange_m = 0.02;
// What "as cheap as the cheapest" allows.
constexpr double kCostRatio = 1.02, kCostExcess_mps = 5e-4;
constexpr double kSafetyHorizon_rev = 2.0;
// An opportunity missed by less than this is flown at the start of the window: small changes have
// phases that move with the estimate, and half a revolution is a long wait.
constexpr double kGrace_s = 150.0;

// An instant at which a burn could be, and what one there does to a_roe at the goal's end [m per
// m/s].
struct Opportunity {
  std::int64_t t_ns;
  Matrix<6, 3> effect;
};

struct Opportunities {
  Opportunity list[kMaxOpportunities];
  int count = 0;
};

double phase_of(double x, double y) {
  return std::atan2(y, x);
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

// All passages of true argument of latitude phase + k pi in the window.
Opportunities opportunities_at(const FormationState& now, const Goal& goal,
                               const BurnWindow& window, double phase_rad) {
  Opportunities found;
  const double rate_radps = secular_rates(now.chief).u_radps;
  double ahead_rad =
      std::fmod(wrap_two_pi(mean_argument_rad(now.chief, phase_rad) - now.chief.u_rad), kPi) - kPi;
  while (found.count < kMaxOpportunities) {
    // Both halves of the turn differ by the equation of the centre; phase it at the burn itself.
    const OrbitElements rough = propagate_mean(now.chief, ahead_rad / rate_radps);
    const double miss_rad = wrap_pi(2.0 * (phase_rad - true_argument_of_latitude_rad(rough))) / 2.0;
    double after_s = (ahead_rad + miss_rad) / rate_radps;
    const double first_s = seconds(window.first_ns - now.t_ns);
    if (after_s < first_s && after_s > first_s - kGrace_s) after_s = first_s;
    const std::int64_t t_ns = now.t_ns + nanoseconds(after_s);
    if (t_ns > window.last_ns) break;
    if (t_ns >= window.first_ns) {
      const OrbitElements at = propagate_mean(now.chief, after_s);
      found.list[found.count++] = {
          t_ns, state_transition(at, seconds(goal.end_ns - t_ns)) * control_input(at)};
    }
    ahead_rad += kPi;
  }
  return found;
}

int nearest(const Opportunities& list, std::int64_t t_ns) {
  int best = 0;
  for (int k = 1; k < list.count; ++k) {
    if (std::llabs(list.list[k].t_ns - t_ns) < std::llabs(list.list[best].t_ns - t_ns)) best = k;
  }
  return best;
}

// Which opportunities a plan uses: up to three in-plane burns, each with its normal burn, which is
// at the same opportunity when `joint`.
struct Selection {
  const Opportunity* tangential[3];
  const Opportunity* normal[3];
  int count;
  bool joint;
  double phase_rad;  // of the in-plane burns
};

// Delta-v of a selection: in-plane parts (R, T) and normal parts.
struct Impulses {
  double radial[3] = {}, tangential[3] = {}, normal[3] = {};
};

double cost(const Selection& s, const Impulses& i) {
  double sum = 0.0;
  for (int k = 0; k < s.count; ++k) {
    const double in_plane2 = i.radial[k] * i.radial[k] + i.tangential[k] * i.tangential[k];
    sum += s.joint ? std::sqrt(in_plane2 + i.normal[k] * i.normal[k])
                   : std::sqrt(in_plane2) + std::fabs(i.normal[k]);
  }
  return sum;
}

RelativeElements effect_of(const Selection& s, const Impulses& i) {
  RelativeElements sum;
  for (int k = 0; k < s.count; ++k) {
    const flight_support::Vec3 in_plane = flight_support::vec3(i.radial[k], i.tangential[k], 0.0);
    sum = sum + s.tangential[k]->effect * in_plane +
          s.normal[k]->effect * flight_support::vec3(0.0, 0.0, i.normal[k]);
  }
  return sum;
}

// The tangential burns for a*da, a*de along the phase, a*dl, in this order of precedence as the
// number of burns allows.
template <int N>
bool add_tangential(const Selection& s, const RelativeElements& miss, Impulses* impulses) {
  const double c = std::cos(s.phase_rad), sn = std::sin(s.phase_rad);
  Matrix<N, N> A;
  Vector<N> b;
  for (int k = 0; k < N; ++k) {
    const Matrix<6, 3>& G = s.tangential[k]->effect;
    const double rows[3] = {G(kDa, 1), c * G(kDex, 1) + sn * G(kDey, 1), G(kDl, 1)};
    for (int r = 0; r < N; ++r) A(r, k) = rows[r];
  }
  const double right[3] = {miss[kDa], c * miss[kDex] + sn * miss[kDey], miss[kDl]};
  for (int r = 0; r < N; ++r) b[r] = right[r];
  Vector<N> p;
  if (!flight_support::solve(A, b, &p)) return false;
  for (int k = 0; k < N; ++k) impulses->tangential[k] += p[k];
  return true;
}

bool add_tangential(const Selection& s, const RelativeElements& miss, Impulses* impulses) {
  if (s.count == 3) return add_tangential<3>(s, miss, impulses);
  if (s.count == 2) return add_tangential<2>(s, miss, impulses);
  return add_tangential<1>(s, miss, impulses);
}

// One of the parts that burns share: a*de across the phase by radial impulses, a*di by normal ones.
// Each burn takes a share in proportion to its tangential part; the sign alternates as its effect
// does.
void add_shared(const Selection& s, const double (&share)[3], const double (&effect)[3],
                double miss, double* parts) {
  double total = 0.0;
  for (int k = 0; k < s.count; ++k) total += share[k] * std::fabs(effect[k]);
  if (!(total > 0.0)) return;
  for (int k = 0; k < s.count; ++k) {
    parts[k] += std::copysign(share[k], effect[k]) * miss / total;
  }
}

bool solve_impulses(const Selection& s, const RelativeElements& miss, Impulses* impulses) {
  const double di_phase = s.joint ? s.phase_rad : phase_of(miss[kDix], miss[kDiy]);
  const double c = std::cos(s.phase_rad), sn = std::sin(s.phase_rad);
  const double ci = std::cos(di_phase), si = std::sin(di_phase);
  // The parts disturb each other by J2 and eccentricity only (and a*dl by the radial ones): what is
  // left shrinks a hundredfold per round.
  for (int round = 0; round < 3; ++round) {
    const RelativeElements left = miss - effect_of(s, *impulses);
    if (!add_tangential(s, left, impulses)) return false;
    double share[3] = {}, across[3] = {}, normal[3] = {};
    for (int k = 0; k < s.count; ++k) {
      share[k] = std::fabs(impulses->tangential[k]) + 1e-9;
      const Matrix<6, 3>& G = s.tangential[k]->effect;
      across[k] = -sn * G(kDex, 0) + c * G(kDey, 0);
      const Matrix<6, 3>& H = s.normal[k]->effect;
      normal[k] = ci * H(kDix, 2) + si * H(kDiy, 2);
    }
    add_shared(s, share, across, -sn * left[kDex] + c * left[kDey], impulses->radial);
    add_shared(s, share, normal, ci * left[kDix] + si * left[kDiy], impulses->normal);
  }
  return true;
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

void add_to(Plan* plan, const Selection& s, const Impulses& i) {
  for (int k = 0; k < s.count; ++k) {
    insert(plan, s.tangential[k]->t_ns, flight_support::vec3(i.radial[k], i.tangential[k], 0.0));
    insert(plan, s.normal[k]->t_ns, flight_support::vec3(0.0, 0.0, i.normal[k]));
  }
}

// Leaves out burns too small to fly and sums up the rest.
// @return false if a burn is above the limit.
bool finish(Plan* plan, const PlannerOptions& options) {
  int kept = 0;
  bool within_limit = true;
  plan->delta_v_mps = 0.0;
  for (int k = 0; k < plan->count; ++k) {
    const double size = norm(plan->burns[k].dv_RTN);
    if (size < options.min_impulse_mps) continue;
    if (options.max_impulse_mps > 0.0 && size > options.max_impulse_mps) within_limit = false;
    plan->delta_v_mps += size;
    plan->burns[kept++] = plan->burns[k];
  }
  plan->count = kept;
  return within_limit;
}

// One way to lay out burns: where in-plane and normal opportunities are.
struct Layout {
  Opportunities in_plane, normal;
  bool joint;
  double phase_rad;
};

Selection select(const Layout& layout, const int (&index)[3], int count) {
  Selection s{};
  s.count = count;
  s.joint = layout.joint;
  s.phase_rad = layout.phase_rad;
  for (int k = 0; k < count; ++k) {
    s.tangential[k] = &layout.in_plane.list[index[k]];
    s.normal[k] = layout.joint ? s.tangential[k]
                               : &layout.normal.list[nearest(layout.normal, s.tangential[k]->t_ns)];
  }
  return s;
}

// Calls `visit(index, count)` for every choice of burns, earliest end first.
template <class Visit>
void for_each_choice(const Opportunities& in_plane, const Visit& visit) {
  if (in_plane.count == 1) visit({0, 0, 0}, 1);
  if (in_plane.count == 2) visit({0, 1, 0}, 2);
  for (int last = 2; last < in_plane.count; ++last) {
    for (int first = 0; first + 1 < last; ++first) {
      for (int middle = first + 1; middle < last; ++middle) visit({first, middle, last}, 3);
    }
  }
}

// `steps` times the same choice, each shifted behind the one before, each for its part of the miss.
// @return false if it does not fit the opportunities, or has no solution.
bool lay_out(const Layout& layout, const int (&index)[3], int count, int steps,
             const RelativeElements& miss, Plan* plan) {
  *plan = Plan();
  const int shift = index[count - 1] - index[0];
  for (int step = 0; step < steps; ++step) {
    int shifted[3] = {};
    for (int k = 0; k < count; ++k) shifted[k] = index[k] + step * shift;
    if (shifted[count - 1] >= layout.in_plane.count) return false;
    const Selection s = select(layout, shifted, count);
    Impulses impulses;
    if (!solve_impulses(s, (1.0 / steps) * miss, &impulses)) return false;
    add_to(plan, s, impulses);
  }
  return true;
}

bool has_change(const RelativeElements& miss, int x, int y) {
  return std::hypot(miss[x], miss[y]) > kNoChange_m;
}

// Joint burns at the phase of a*di, or of a*de where there is no other; and, where both change,
// burns apart. @return how many layouts have an opportunity.
int layouts_for(const FormationState& now, const Goal& goal, const RelativeElements& miss,
                const BurnWindow& window, Layout (&layouts)[2]) {
  const bool de = has_change(miss, kDex, kDey), di = has_change(miss, kDix, kDiy);
  const double de_phase =
      de ? phase_of(miss[kDex], miss[kDey]) : true_argument_of_latitude_rad(now.chief);
  const double di_phase = di ? phase_of(miss[kDix], miss[kDiy]) : de_phase;
  int count = 0;
  Layout& joint = layouts[count];
  joint.in_plane = opportunities_at(now, goal, window, di_phase);
  joint.joint = true;
  joint.phase_rad = di_phase;
  if (joint.in_plane.count > 0) ++count;
  if (!de || !di) return count;
  Layout& apart = layouts[count];
  apart.in_plane = opportunities_at(now, goal, window, de_phase);
  apart.normal = opportunities_at(now, goal, window, di_phase);
  apart.joint = false;
  apart.phase_rad = de_phase;
  return apart.in_plane.count > 0 && apart.normal.count > 0 ? count + 1 : count;
}

double least_cost_mps(const Layout& layout, const RelativeElements& miss) {
  double least = INFINITY;
  for_each_choice(layout.in_plane, [&](const int(&index)[3], int count) {
    const Selection s = select(layout, index, count);
    Impulses impulses;
    if (solve_impulses(s, miss, &impulses)) least = std::fmin(least, cost(s, impulses));
  });
  return least;
}

double distance_while_coasting_m(const OrbitElements& chief, const RelativeElements& a_roe,
                                 double dt_s) {
  // e/i vectors turn by 0.25 deg a revolution: the ends of a coast bound it.
  return std::fmin(minimum_radial_normal_m(a_roe),
                   minimum_radial_normal_m(state_transition(chief, dt_s) * a_roe));
}

// Flies the burns of `plan` from `first` on, beginning with `a_roe` just before that one, for at
// most `horizon_s`; then coasts.
double distance_from_m(const FormationState& now, const Plan& plan, int first,
                       RelativeElements a_roe, std::int64_t t_ns, double horizon_s) {
  const std::int64_t end_ns = t_ns + nanoseconds(horizon_s);
  double smallest = minimum_radial_normal_m(a_roe);
  for (int k = first; k < plan.count && plan.burns[k].t_ns <= end_ns; ++k) {
    const std::int64_t burn_ns = plan.burns[k].t_ns;
    const OrbitElements before = propagate_mean(now.chief, seconds(t_ns - now.t_ns));
    const OrbitElements at = propagate_mean(now.chief, seconds(burn_ns - now.t_ns));
    a_roe = state_transition(before, seconds(burn_ns - t_ns)) * a_roe +
            control_input(at) * plan.burns[k].dv_RTN;
    t_ns = burn_ns;
    smallest = std::fmin(smallest, minimum_radial_normal_m(a_roe));
  }
  const OrbitElements chief = propagate_mean(now.chief, seconds(t_ns - now.t_ns));
  const double rest_s = std::fmax(seconds(end_ns - t_ns), 0.0);
  return std::fmin(smallest, distance_while_coasting_m(chief, a_roe, rest_s));
}

}  // namespace

RelativeElements predicted_miss(const FormationState& now, const Goal& goal) {
  return goal.a_roe -
         state_transition(now.chief, seconds(goal.end_ns - now.t_ns)) * now.relative.mean;
}

double plan_safe_distance_m(const FormationState& now, const Plan& plan) {
  const double horizon_s = kSafetyHorizon_rev * kTwoPi / mean_motion_radps(now.chief.a_m);
  const double all_s =
      plan.count > 0 ? seconds(plan.burns[plan.count - 1].t_ns - now.t_ns) + horizon_s : horizon_s;
  RelativeElements a_roe = now.relative.mean;
  double smallest = distance_from_m(now, plan, 0, a_roe, now.t_ns, all_s);
  std::int64_t t_ns = now.t_ns;
  for (int k = 0; k < plan.count; ++k) {
    const OrbitElements before = propagate_mean(now.chief, seconds(t_ns - now.t_ns));
    a_roe = state_transition(before, seconds(plan.burns[k].t_ns - t_ns)) * a_roe;
    t_ns = plan.burns[k].t_ns;
    // Burn k is lost: nothing more happens, or the later ones go on.
    smallest = std::fmin(smallest, distance_from_m(now, plan, plan.count, a_roe, t_ns, horizon_s));
    smallest = std::fmin(smallest, distance_from_m(now, plan, k + 1, a_roe, t_ns, horizon_s));
    const OrbitElements at = propagate_mean(now.chief, seconds(t_ns - now.t_ns));
    a_roe = a_roe + control_input(at) * plan.burns[k].dv_RTN;
  }
  return smallest;
}

bool ReconfigurationPlanner::plan(const FormationState& now, const Goal& goal,
                                  const RelativeElements& miss, const BurnWindow& window,
                                  Plan* plan) const {
  Layout layouts[2];
  const int layout_count = layouts_for(now, goal, miss, window, layouts);
  double least = INFINITY;
  for (int k = 0; k < layout_count; ++k) {
    least = std::fmin(least, least_cost_mps(layouts[k], miss));
  }
  const double affordable = kCostRatio * least + kCostExcess_mps;
  // A formation that is closer already may not be asked for more than it has.
  const double safe_m =
      std::fmin(options_.min_radial_normal_m, 0.98 * minimum_radial_normal_m(now.relative.mean));
  for (int steps = 1; steps <= kMaxSteps; ++steps) {
    bool found = false;
    for (int k = 0; k < layout_count; ++k) {
      for_each_choice(layouts[k].in_plane, [&](const int(&index)[3], int count) {
        Plan candidate;
        if (!lay_out(layouts[k], index, count, steps, miss, &candidate)) return;
        if (!finish(&candidate, options_) || candidate.delta_v_mps > affordable) return;
        const bool later =
            found && candidate.count > 0 && plan->count > 0 &&
            candidate.burns[candidate.count - 1].t_ns >= plan->burns[plan->count - 1].t_ns;
        if (later) return;
        candidate.safe_distance_m = plan_safe_distance_m(now, candidate);
        if (candidate.safe_distance_m < safe_m) return;
        *plan = candidate;
        found = true;
      });
    }
    if (found) return true;
    if (options_.max_impulse_mps <= 0.0) return false;
  }
  return false;
}

}  // namespace formation_keeping
