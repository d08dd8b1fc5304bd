/// Numerical prediction of an orbit over an hour or less.
///
/// Method      RK4 in Cartesian EME2000 in equal steps; the field is what the caller gives. Steps
/// of
///             10 s cost 1 um of the relative position at 40 m after half an hour, steps of 30 s
///             0.1 mm.
/// Checked by  test_suites/unit/flight_sw/formation_gnc/fine_alignment_test.cpp
#pragma once

#include <cstdint>

#include "support/orbit/earth_rotation.hpp"

namespace formation_gnc {

/// Gravitational acceleration [m/s^2] at a point [m], both in EME2000. Pure.
class GravityModel {
 public:
  virtual ~GravityModel() = default;
  virtual flight_support::Vec3 acceleration_ECI(std::int64_t t_ns,
                                                const flight_support::Vec3& r_ECI) const = 0;
};

/// J2, J3 and J4 about the z axis of EME2000 (0.1 deg off the Earth's in 2025): for tests, and
/// where nothing better is at hand.
class ZonalGravity : public GravityModel {
 public:
  flight_support::Vec3 acceleration_ECI(std::int64_t t_ns,
                                        const flight_support::Vec3& r_ECI) const override;
};

/// The state at `to_ns`, later or earlier, in steps of at most `longest_step_s`.
flight_support::StateEci propagate(const GravityModel& gravity,
                                   const flight_support::StateEci& state, std::int64_t from_ns,
                                   std::int64_t to_ns, double longest_step_s = 10.0);

}  // namespace formation_gnc
