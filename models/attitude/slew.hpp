/// A turn about a fixed axis from rest to rest, in the shortest time that a rate and an
/// acceleration allow.
#pragma once

#include <orrery/harness/kernel/time.hpp>

#include <array>

namespace orrery {

/// Of the reference mission [C]: 0.5 deg/s, 0.05 deg/s^2.
struct SlewLimits {
  double rate_degps = 0.5;            // above 0
  double acceleration_degps2 = 0.05;  // above 0
};

/// Trapezoid in rate: acceleration, constant rate, deceleration; below rate^2/acceleration (5 deg)
/// a triangle.
class SlewProfile {
 public:
  /// @param angle_rad  0 or more.
  /// @throws std::invalid_argument  a limit or the angle out of range.
  SlewProfile(double angle_rad, const SlewLimits& limits);

  double duration_s() const { return 2 * ramp_s_ + cruise_s_; }
  /// Angle turned [rad] and rate [rad/s] after `t_s` seconds: before and after the slew at rest.
  double angle_rad(double t_s) const;
  double rate_radps(double t_s) const;
  /// Where the acceleration jumps [s]: begin, end of the ramp, begin of the braking, end.
  std::array<double, 4> corners_s() const {
    return {0, ramp_s_, ramp_s_ + cruise_s_, duration_s()};
  }

 private:
  double angle_rad_, acceleration_radps2_, ramp_s_, cruise_s_;
};

}  // namespace orrery
