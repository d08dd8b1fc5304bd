/// ECEF (ITRF, no polar motion) to ECI (EME2000: mean equator and equinox of J2000).
///
/// Method      IAU 1976 precession, the 13 largest terms of IAU 1980 nutation, GMST of 1982 with
///             the equation of the equinoxes. Seidelmann (ed.), Explanatory Supplement (1992),
///             §3.2.
/// Accuracy    0.1 arcsec against the full series with equal UT1 (3 m at 550 km); leaving out polar
///             motion costs up to 0.5 arcsec, leaving UT1 - UTC at zero up to 15 arcsec per second.
/// Valid for   1990 to 2050.
/// Checked by  test_suites/unit/flight_sw/earth_rotation_test.cpp, against ERFA
#pragma once

#include <cstdint>

#include "support/matrix.hpp"

namespace flight_support {

/// What an onboard clock of GPS time does not know; uploaded when it changes.
struct EarthTime {
  int leap_seconds = 18;         ///< GPS - UTC [s], 18 since 2017
  double ut1_minus_utc_s = 0.0;  ///< IERS Bulletin A
};

/// Position [m] and velocity [m/s] in EME2000.
struct StateEci {
  Vec3 r_ECI;
  Vec3 v_ECI;
};

/// TT in Julian centuries since J2000.
double tt_centuries(std::int64_t epoch_ns);
/// Turns components in EME2000 into components in the mean equator and equinox of date.
Mat3 precession(double tt_cy);
double mean_obliquity_rad(double tt_cy);

/// R_IE, which turns components in ECEF into components in ECI.
/// @param epoch_ns  GPS time, ns since 1980-01-06.
Mat3 ecef_to_eci(std::int64_t epoch_ns, const EarthTime& earth_time);

/// Turns a position and a velocity relative to the rotating Earth into ECI.
StateEci eci_from_ecef(std::int64_t epoch_ns, const Vec3& r_ECEF, const Vec3& v_ECEF,
                       const EarthTime& earth_time);

}  // namespace flight_support
