/// How fast the Earth moves, for the aberration of stars, and where the Sun is seen from it.
///
/// Method      Kepler's ellipse with the Sun's longitude of the Astronomical Almanac's
/// low-precision
///             formulae, referred to the equinox of J2000; the Sun is taken to stand at the
///             barycentre.
/// Frame       Equator and equinox of J2000 (ECI within the frame bias).
/// Accuracy    30 m/s from 2000 to 2050, 13 of it the Sun's own motion: 0.02 arcsec of aberration;
///             the Sun 0.02 deg.
/// Checked by  test_suites/unit/flight_sw/rpo_kit/frame_processor_test.cpp, against ERFA
#pragma once

#include <cstdint>

#include "support/matrix.hpp"

namespace rpo_kit {

/// @param t_ns  GPS time, ns since 1980-01-06; a minute more or less does not matter. [m/s]
flight_support::Vec3 earth_velocity_ECI(std::int64_t t_ns);

/// Unit vector from the Earth to the Sun.
flight_support::Vec3 sun_direction_ECI(std::int64_t t_ns);

}  // namespace rpo_kit
