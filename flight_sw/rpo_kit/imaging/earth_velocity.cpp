#include "rpo_kit/imaging/earth_velocity.hpp"

#include <cmath>

#include "support/orbit/constants.hpp"

namespace rpo_kit {
namespace {

constexpr double kDegree = flight_support::kPi / 180.0;
constexpr double kGpsEpochToJ2000_days = 7300.5;
constexpr double kEccentricity = 0.01670;
constexpr double kPerihelion = 102.947 * kDegree;  // longitude, J2000; moves 0.3 deg a century
constexpr double kObliquity = 23.43928 * kDegree;
// 2 pi au per sidereal year, over sqrt(1 - e^2).
constexpr double kSpeed_mps = 29788.9;

// Longitude in the mean equinox of date, less the precession since J2000.
double sun_longitude_rad(std::int64_t t_ns) {
  const double d = flight_support::seconds(t_ns) / 86400.0 - kGpsEpochToJ2000_days;
  const double g = (357.528 + 0.9856003 * d) * kDegree;
  return (280.460 + 0.9856474 * d - 3.8247e-5 * d) * kDegree +
         (1.915 * std::sin(g) + 0.020 * std::sin(2.0 * g)) * kDegree;
}

flight_support::Vec3 from_ecliptic(double x, double y) {
  return flight_support::vec3(x, std::cos(kObliquity) * y, std::sin(kObliquity) * y);
}

}  // namespace

flight_support::Vec3 earth_velocity_ECI(std::int64_t t_ns) {
  const double earth = sun_longitude_rad(t_ns) + flight_support::kPi;
  return from_ecliptic(-kSpeed_mps * (std::sin(earth) + kEccentricity * std::sin(kPerihelion)),
                       kSpeed_mps * (std::cos(earth) + kEccentricity * std::cos(kPerihelion)));
}

flight_support::Vec3 sun_direction_ECI(std::int64_t t_ns) {
  const double sun = sun_longitude_rad(t_ns);
  return from_ecliptic(std::cos(sun), std::sin(sun));
}

}  // namespace rpo_kit
