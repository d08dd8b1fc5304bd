/// The relative orbit in which the telescope observes, and when.
///
/// The deputy stands at +separation along the Sun line with no inertial velocity relative to the
/// chief. Where the Sun line is perpendicular to the chief's radius (twice a revolution) that is
/// a*da = 0, a*de = T (sin u, -cos u), a*di = N (sin u, -cos u), a*dl = -T, with T and N its
/// along-track and cross-track parts: e and i vectors are parallel, and differential gravity acts
/// along the Sun line only.
///
/// Checked by  test_suites/unit/flight_sw/formation_gnc/transfer_planner_test.cpp
#pragma once

#include <cstdint>

#include "support/orbit/relative_elements.hpp"

namespace formation_gnc {

/// a_roe [m] at the observation; mean, of the exact states and so with what J2 makes of them.
/// @param chief  Mean elements at the observation.
flight_support::RelativeElements science_elements(const flight_support::OrbitElements& chief,
                                                  const flight_support::Vec3& sun_ECI,
                                                  double separation_m);

/// First instant after `after_ns` at which the Sun is perpendicular to the chief's radius while it
/// flies north. Exists unless the Sun stands within 1 deg of the orbit's pole or all but in line
/// with the northernmost point; then `after_ns` comes back.
/// @param chief  Mean elements at `chief_ns`.
std::int64_t observation_epoch_ns(const flight_support::OrbitElements& chief, std::int64_t chief_ns,
                                  const flight_support::Vec3& sun_ECI, std::int64_t after_ns);

}  // namespace formation_gnc
