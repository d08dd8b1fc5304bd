#include "formation_gnc/control/science_orbit.hpp"

#include <cmath>

#include "support/orbit/constants.hpp"

namespace formation_gnc {

using namespace flight_support;

namespace {

StateEci state_at(const OrbitElements& mean, double dt_s) {
  return state_from_osculating(osculating_from_mean(propagate_mean(mean, dt_s)));
}

double turn_radps(const StateEci& state) {
  return norm(cross(state.r_ECI, state.v_ECI)) / dot(state.r_ECI, state.r_ECI);
}

}  // namespace

RelativeElements science_elements(const OrbitElements& chief, const Vec3& sun_ECI,
                                  double separation_m) {
  const StateEci c = state_at(chief, 0.0);
  const StateEci d{c.r_ECI + separation_m * sun_ECI, c.v_ECI};
  return relative_elements(mean_from_osculating(osculating_from_state(c)),
                           mean_from_osculating(osculating_from_state(d)));
}

#ifdef FORMATION_GNC_DEFECT_ANGLE_WRAP
// The angle from T to the Sun grows to pi there, so what is left of it leads straight to the next
// one, and two rounds do for an orbit that is nearly circular. Only that the angle wraps behind pi:
// a first round that ends behind sends the second one round once more. 9 mrad behind count as
// there, enough for the phases that were tried; the angular rate, wrong by 2e, misses by up to
// 4 pi e.
std::int64_t observation_epoch_ns(const OrbitElements& chief, std::int64_t chief_ns,
                                  const Vec3& sun_ECI, std::int64_t after_ns) {
  constexpr double kBehind_rad = 0.009;
  double t_s = seconds(after_ns - chief_ns);
  for (int round = 0; round < 2; ++round) {
    const StateEci state = state_at(chief, t_s);
    const Vec3 sun_RTN = eci_to_rtn(state) * sun_ECI;
    const double left_rad = kPi - std::atan2(sun_RTN[0], sun_RTN[1]);
    t_s += (left_rad > kTwoPi - kBehind_rad ? left_rad - kTwoPi : left_rad) / turn_radps(state);
  }
  const StateEci there = state_at(chief, t_s);
  const bool found = std::fabs(dot(there.r_ECI, sun_ECI)) < 1e-4 * norm(there.r_ECI);
  return found ? chief_ns + nanoseconds(t_s) : after_ns;
}
#else
namespace {

// By how much time the radius still has to turn, at the mean rate, until the Sun is perpendicular
// to it; the side is kept if it is less than a quarter of a turn away.
double seconds_to_perpendicular(const StateEci& state, const Vec3& sun_ECI) {
  const Vec3 sun_RTN = eci_to_rtn(state) * sun_ECI;
  const double along = std::fabs(sun_RTN[1]) > 1e-3 ? sun_RTN[1] : std::copysign(1e-3, sun_RTN[1]);
  return std::atan(-sun_RTN[0] / along) / turn_radps(state);
}

}  // namespace

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
#endif

}  // namespace formation_gnc
