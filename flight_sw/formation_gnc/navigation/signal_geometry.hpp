/// What a receiver should measure of a satellite, and how that depends on the state.
///
/// Range       Between the antenna at the true instant of reception (tag less clock error) and the
///             satellite at that of transmission, both in ECI, so that there is no Sagnac term.
///             Light time by iteration. 1 us of clock error moves a LEO by 7.6 mm.
/// Checked by  test_suites/unit/flight_sw/formation_gnc/signal_geometry_test.cpp
#pragma once

#include <cstdint>

#include "formation_gnc/navigation/broadcast_ephemeris.hpp"
#include "formation_gnc/navigation/gnss_epoch.hpp"
#include "formation_gnc/navigation/orbit_pair.hpp"

namespace formation_gnc {

/// Satellites in ECI near the time of transmission of one epoch, from the broadcast ephemerides.
class SatelliteTable {
 public:
  static constexpr int kCapacity = 2 * kChannels;

  /// Adds those of `epoch` that are not there yet; starts anew if the epoch's tag is another.
  void prepare(const GnssEpoch& epoch, const EphemerisStore& ephemerides,
               const flight_support::EarthTime& earth_time, EarthAttitude* earth);
  /// Null: no ephemeris, or unhealthy.
  const SatelliteState* find(int prn) const;
  /// Seconds before the tag at which the states hold.
  static constexpr double kBefore_s = 0.075;

 private:
  std::int64_t t_ns_ = -1;
  int count_ = 0;
  std::uint8_t prn_[kCapacity];
  SatelliteState state_[kCapacity];  // ECI
};

/// A receiver's antenna at an epoch's tag.
struct AntennaState {
  Vec3 r_ECI, v_ECI;
  double clock_m = 0.0;
};

struct Predicted {
  double range_m = 0.0;       ///< range less satellite clock plus receiver clock: of code and phase
  Vec3 line_of_sight;         ///< unit vector to the satellite, ECI; d range / d r = -line_of_sight
  double clock_factor = 1.0;  ///< d range / d (receiver clock in metres)
};

/// @param satellite  From SatelliteTable.
Predicted predict(const AntennaState& antenna, const SatelliteState& satellite);

/// Thermal noise [m] of code and phase at a C/N0: delay lock loop of 0.0076 Hz, phase lock loop of
/// 15 Hz; 0.144 m and 0.66 mm at 45 dB-Hz (Bell & D'Amico, Table 2).
double code_sigma_m(double cn0_dBHz);
double phase_sigma_m(double cn0_dBHz);

}  // namespace formation_gnc
