#include "rpo_kit/guidance/observability.hpp"

#include <algorithm>
#include <cmath>

#include "support/orbit/constants.hpp"

namespace rpo_kit {

using namespace flight_support;

namespace {

double spiral_m(const RelativeElements& a_roe) {
  return std::max(std::hypot(a_roe[kDex], a_roe[kDey]), std::hypot(a_roe[kDix], a_roe[kDiy]));
}

// Changes of a*da that are tried, as parts of the spiral's radius.
constexpr double kSteps[] = {0.1, 0.2, 0.3, 0.4};

}  // namespace

double range_fraction(const RelativeOrbit& now, const Matrix6& covariance) {
  const double along_m = std::fabs(now.a_roe[kDl]);
  if (along_m < 5.0 * spiral_m(now.a_roe)) return 0.0;
  return std::sqrt(covariance(kDl, kDl)) / along_m;
}

double predicted_range_fraction(const RelativeOrbit& now, const Transfer& burns, double burn_error,
                                const ObservabilityOptions& options) {
  const double rate = secular_rates(now.chief).u_radps;
  const double noise_m = options.direction_rad * std::fabs(now.a_roe[kDl]);
  double information = 0.0;
  const std::int64_t period_ns = nanoseconds(options.period_s);
  for (std::int64_t t_ns = now.t_ns; t_ns <= burns.end_ns; t_ns += period_ns) {
    const double dt_s = seconds(t_ns - now.t_ns);
    const OrbitElements chief = propagate_mean(now.chief, dt_s);
    RelativeElements change;
    for (int k = 0; k < burns.count && burns.burns[k].t_ns <= t_ns; ++k) {
      const double then_s = seconds(burns.burns[k].t_ns - now.t_ns);
      OrbitElements chaser = propagate_mean(now.chief, then_s);
      chaser.u_rad = wrap_two_pi(chaser.u_rad + now.a_roe[kDl] / chaser.a_m);
      change = change + state_transition(now.chief, dt_s - then_s) *
                            (control_input(chaser) * burns.burns[k].dv_RTN);
    }
    OrbitElements chaser = chief;
    chaser.u_rad = wrap_two_pi(chief.u_rad + now.a_roe[kDl] / chief.a_m);
    const Vector<6> moved = rtn_from_relative_elements(chaser.u_rad, rate) * change;
    information += (moved[0] * moved[0] + moved[2] * moved[2]) / (noise_m * noise_m);
  }
  return information > 0.0 ? std::hypot(1.0 / std::sqrt(information), burn_error) : INFINITY;
}

bool plan_observation(const RelativeOrbit& now, double keep_out_m, double burn_error,
                      const ObservabilityOptions& options, Transfer* burns) {
  const RelativeElements& a_roe = now.a_roe;
  const SecularRates rates = secular_rates(now.chief);
  const double n = mean_motion_radps(now.chief.a_m);
  const double radius_m = std::hypot(a_roe[kDex], a_roe[kDey]);
  // Behind the target a lower orbit leads towards it.
  const double side = a_roe[kDl] < 0.0 ? -1.0 : 1.0;
  const bool drifts = side * a_roe[kDa] > 0.5 * kSteps[0] * radius_m;
  const double sign = drifts ? -side : side;
  // The eccentricity vector changes by 2/n of the burn in the direction of u.
  const double phase = std::atan2(a_roe[kDey], a_roe[kDex]) + (sign < 0.0 ? kPi : 0.0);
  const double u0 = now.chief.u_rad + a_roe[kDl] / now.chief.a_m + rates.u_radps * options.lead_s;
  const std::int64_t t_ns =
      now.t_ns + nanoseconds(options.lead_s + wrap_two_pi(phase - u0) / rates.u_radps);
  bool found = false;
  for (const double step : kSteps) {
    const double da_m = drifts ? std::max(std::fabs(a_roe[kDa]), step * radius_m) : step * radius_m;
    Transfer plan;
    plan.burns[0] = {t_ns, vec3(0.0, sign * 0.5 * n * da_m, 0.0)};
    plan.count = 1;
    plan.end_ns = t_ns + nanoseconds(options.watch_rev * kTwoPi / rates.u_radps);
    plan.delta_v_mps = norm(plan.burns[0].dv_RTN);
    plan.safe_m = plan_safe_distance_m(now, plan.burns, plan.count);
    if (plan.safe_m < keep_out_m) continue;
    *burns = plan;
    found = true;
    if (predicted_range_fraction(now, plan, burn_error, options) <
        options.aim * options.range_known) {
      break;
    }
  }
  return found;
}

}  // namespace rpo_kit
