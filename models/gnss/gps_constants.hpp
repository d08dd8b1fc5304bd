/// Constants of the GPS interface. Only for what the message and its user algorithm say; forces on
/// a spacecraft have their own (models/orbit/earth.hpp).
#pragma once

#include <orrery/harness/kernel/time.hpp>

namespace orrery::gps {

// IS-GPS-200, 20.3.3.4.3 and Table 20-IV; kGpsPi stands beside the ephemeris.
constexpr double kMu_m3ps2 = 3.986005e14;
constexpr double kOmegaEarth_radps = 7.2921151467e-5;
constexpr double kSpeedOfLight_mps = 299792458;
constexpr double kRelativity_spsqrtm = -4.442807633e-10;  // F of 20.3.3.3.3.1

// IS-GPS-200, 3.3.1.1.
constexpr double kL1_Hz = 1575.42e6;
constexpr double kL2_Hz = 1227.60e6;
constexpr double kL1Wavelength_m = kSpeedOfLight_mps / kL1_Hz;
constexpr double kL2Wavelength_m = kSpeedOfLight_mps / kL2_Hz;
constexpr double kGamma = (kL1_Hz / kL2_Hz) * (kL1_Hz / kL2_Hz);  // of the ionosphere, L2 to L1

constexpr int kSatellites = 32;  // PRN 1 to 32
constexpr Duration kWeek = weeks(1);

/// Full week (not modulo 1024) and seconds of week as an instant; to the nearest nanosecond.
inline SimTime from_week(int week, double seconds) {
  return SimTime(week * kWeek + from_seconds(seconds));
}
constexpr int week_of(SimTime t) {
  return static_cast<int>(t.time_since_epoch() / kWeek);
}
/// Whole seconds are exact.
constexpr double second_of_week(SimTime t) {
  const Duration of_week = t.time_since_epoch() % kWeek;
  return static_cast<double>(of_week / 1s) + to_seconds(of_week % 1s);
}

}  // namespace orrery::gps
