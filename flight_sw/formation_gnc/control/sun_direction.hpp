/// Flight's own apparent direction of the Sun: the axis along which the telescope is aligned.
///
/// Method      Heliocentric longitude and latitude of the Earth by the largest terms of VSOP87D
///             (Bretagnon & Francou 1988), mean equinox of date; to FK5; annual aberration (Ron &
///             Vondrak's constant, 20.49552"); mean obliquity and precession of IAU 1976 back to
///             EME2000. Meeus, Astronomical Algorithms (1998), ch. 25 and 32.
/// Frame       EME2000. Seen from the Earth's centre; a spacecraft sees the Sun up to 9.5" off by
///             parallax and 5.2" by its own speed, which `observer` takes into account.
/// Accuracy    1" over 2016-2030; 10" are 2 mm at 40 m.
/// Valid for   1980 to 2060.
/// Checked by  test_suites/unit/flight_sw/formation_gnc/sun_direction_test.cpp, against ERFA
#pragma once

#include <cstdint>

#include "support/orbit/earth_rotation.hpp"

namespace formation_gnc {

/// Unit vector from the Earth's centre to the apparent Sun.
/// @param t_ns  GPS time, ns since 1980-01-06.
flight_support::Vec3 sun_direction_EME2000(std::int64_t t_ns);

/// The same, seen from a spacecraft: parallax and the aberration of its own motion included.
flight_support::Vec3 sun_direction_EME2000(std::int64_t t_ns,
                                           const flight_support::StateEci& observer);

}  // namespace formation_gnc
