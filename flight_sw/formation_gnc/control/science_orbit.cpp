#include "formation_gnc/control/science_orbit.hpp"

#include <cmath>

#include "support/orbit/constants.hpp"

namespace formation_gnc {

using namespace flight_support;

namespace {

StateEci state_at(const OrbitElements& mean, double dt_s) {
  return state_from_osculating(osculating_from_mean(propagate_mean(mean, dt_s)));
}

// By how much time the radius still has to turn, at the mean rate, until the Sun is perpendicular
// to it; the side is kept if it is less than a quarter of a turn away.
double seconds_to_perpendicular(const StateEci& state, const Vec3& sun_ECI) {
  const Vec3 sun_RTN = eci_to_rtn(state) * sun_ECI;
  const double rate = norm(cross(state.r_ECI, state.v_ECI)) / dot(state.r_ECI, state.r_ECI);
  const double along = std::fabs(sun_RTN[1]) > 1e-3 ? sun_RTN[1] : std::copysign(1e-3, sun_RTN[1]);
  return std::atan(-sun_RTN[0] / along) / rate;
}

}  // namespace

RelativeElements science_elements(const OrbitElements& chief, const Vec3& sun_ECI,
                                  double separation_m) {
  const StateEci c = state_at(chief, 0.0);
  const StateEci d{c.r_ECI + separation_m * sun_ECI, c.v_ECI};
  return relative_elements(mean_from_osculating(osculating_from_state(c)),
                           mean_from_osculating(osculating_from_state(d)));
}

// d(R . s)/dt = rate (T . s), so the angle to turn is atan(-R.s / T.s), which Newton's method
// sharpens: the orbit is nearly circular, and three rounds leave nothing.
std::int64_t observation_epoch_ns(const OrbitElements& chief, std::int64_t chief_ns,
                                  const Vec3& sun_ECI, std::int64_t after_ns) {
  const double half_turn_s = kPi / mean_motion_radps(chief.a_m);
  for (int half = 0; half < 4; ++half) {
    double t_s = seconds(after_ns - chief_ns) + half * half_turn_s;
    for (int round = 0; round < 5; ++round) {
      t_s += seconds_to_perpendicular(state_at(chief, t_s), sun_ECI);
    }
    const StateEci there = state_at(chief, t_s);
    const std::int64_t t_ns = chief_ns + nanoseconds(t_s);
    const bool found = std::fabs(dot(there.r_ECI, sun_ECI)) < 1e-6 * norm(there.r_ECI);
    if (found && there.v_ECI[2] > 0.0 && t_ns > after_ns) return t_ns;
  }
  return after_ns;
}

}  // namespace formation_gnc
