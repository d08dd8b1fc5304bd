#include "passive_safety.hpp"

#include <cmath>

#include "constants.hpp"

namespace flight_support {
namespace {

constexpr double kHorizon_rev = 2.0;

struct BurnList {
  const Burn* burns;
  int count;
};

double distance_while_coasting_m(const OrbitElements& chief, const RelativeElements& a_roe,
                                 double dt_s) {
  // e/i vectors turn by 0.25 deg a revolution: the ends of a coast bound it.
  return std::fmin(minimum_radial_normal_m(a_roe),
                   minimum_radial_normal_m(state_transition(chief, dt_s) * a_roe));
}

// Flies the burns of `plan` from `first` on, beginning with `a_roe` just before that one, for at
// most `horizon_s`; then coasts.
double distance_from_m(const RelativeOrbit& now, const BurnList& plan, int first,
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

double plan_safe_distance_m(const RelativeOrbit& now, const Burn* burns, int count) {
  const BurnList plan{burns, count};
  const double horizon_s = kHorizon_rev * kTwoPi / mean_motion_radps(now.chief.a_m);
  const double all_s =
      plan.count > 0 ? seconds(plan.burns[plan.count - 1].t_ns - now.t_ns) + horizon_s : horizon_s;
  RelativeElements a_roe = now.a_roe;
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

}  // namespace flight_support
