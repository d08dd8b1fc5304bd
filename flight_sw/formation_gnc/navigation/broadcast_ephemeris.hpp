/// GPS satellites from their broadcast ephemerides, as the receiver passes them on.
///
/// Method      User algorithm of IS-GPS-200 (table 20-IV), velocity by its derivative; clock with
///             the relativistic term, less T_GD for L1 C/A.
/// Frames      ECEF (WGS 84) at the same instant.
/// Accuracy    Velocity 1e-4 m/s; position is exact to rounding.
/// Checked by  test_suites/unit/flight_sw/formation_gnc/broadcast_ephemeris_test.cpp
#pragma once

#include <cstdint>

#include "support/matrix.hpp"
#include "support/novatel/novatel.h"

namespace formation_gnc {

constexpr double kSpeedOfLight_mps = 299792458.0;
constexpr double kL1_Hz = 1575.42e6;
constexpr double kWavelength_m = kSpeedOfLight_mps / kL1_Hz;

/// The parameters, SI units and radians.
struct BroadcastEphemeris {
  std::uint8_t prn = 0;
  std::uint16_t iodc = 0;
  std::uint8_t health = 0;  ///< 0: good
  std::int64_t toe_ns = 0;  ///< GPS ns since 1980-01-06
  std::int64_t toc_ns = 0;
  double toe_s = 0.0;  ///< of the week
  double sqrt_a_sqrtm = 0.0, eccentricity = 0.0, m0_rad = 0.0, delta_n_radps = 0.0;
  double omega_rad = 0.0, raan0_rad = 0.0, raan_rate_radps = 0.0, i0_rad = 0.0, i_rate_radps = 0.0;
  double cuc_rad = 0.0, cus_rad = 0.0, crc_m = 0.0, crs_m = 0.0, cic_rad = 0.0, cis_rad = 0.0;
  double af0_s = 0.0, af1_sps = 0.0, af2_sps2 = 0.0, tgd_s = 0.0;
};

/// Of a RAWEPHEM or GPSEPHEM log. The week of either is the full one of the log's header.
/// @return false, with `ephemeris` untouched, for any other log, for subframes that are not 1 to 3
///         of one issue, and for values that no GPS satellite has (a 2.5e7 to 2.8e7 m, e < 0.1).
bool read_ephemeris(const novatel_frame& frame, BroadcastEphemeris* ephemeris);

/// A satellite at an instant.
struct SatelliteState {
  flight_support::Vec3 r;  ///< [m]
  flight_support::Vec3 v;  ///< [m/s], derivative in the frame of r
  double clock_m = 0.0;    ///< c (satellite time - GPS time + relativity - T_GD) [m]
  double clock_rate_mps = 0.0;
};

/// In ECEF, `t_ns` being GPS time (of transmission).
SatelliteState satellite_ECEF(const BroadcastEphemeris& ephemeris, std::int64_t t_ns);

/// Two issues of each satellite. Which one serves an epoch depends on the epoch alone (the toe
/// nearest to it), so a replay sees what was seen before.
class EphemerisStore {
 public:
  /// Takes the place of the same issue, or of the older one. Unhealthy ones are kept and make the
  /// satellite unusable.
  void add(const BroadcastEphemeris& ephemeris);
  /// Null: none within 2 h 30 min of toe, or unhealthy.
  const BroadcastEphemeris* find(int prn, std::int64_t t_ns) const;

 private:
  BroadcastEphemeris issues_[32][2];  // prn 0: free
};

}  // namespace formation_gnc
