/// Physical constants of the package.
#pragma once

#include <cstdint>

namespace flight_support {

// GGM05S (Tapley et al. 2013): the header's mu and radius, and J2 = -sqrt(5) C20.
constexpr double kMuEarth_m3ps2 = 3.986004415e14;
constexpr double kRadiusEarth_m = 6378136.3;
constexpr double kJ2 = 1.0826358e-3;
// IERS Conventions 1996: rate of GAST, used to turn the velocity.
constexpr double kEarthRotation_radps = 7.292115146706979e-5;

constexpr double kPi = 3.14159265358979323846;
constexpr double kTwoPi = 2.0 * kPi;
constexpr std::int64_t kSecond_ns = 1000000000;
constexpr std::int64_t kWeek_ns = 604800 * kSecond_ns;

constexpr double seconds(std::int64_t ns) {
  return static_cast<double>(ns) * 1e-9;
}
/// Rounds to the nearest nanosecond; for spans below 10^6 s the rounding of the double is far below
/// 1 ns.
constexpr std::int64_t nanoseconds(double s) {
  return static_cast<std::int64_t>(s * 1e9 + (s < 0.0 ? -0.5 : 0.5));
}

}  // namespace flight_support
