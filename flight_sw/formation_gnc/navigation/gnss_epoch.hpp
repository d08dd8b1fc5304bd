/// What a GNSS receiver measured at one epoch, as navigation takes it from its own receiver and, by
/// crosslink, from the companion's.
#pragma once

#include <cstdint>

#include "formation_gnc/navigation/state_order.hpp"
#include "support/matrix.hpp"

namespace formation_gnc {

using flight_support::Mat3;
using flight_support::Vec3;

/// Attitude q_BI: turns components in ECI into components in body axes. Hamilton, w first.
struct Quaternion {
  double w = 1.0, x = 0.0, y = 0.0, z = 0.0;
};
/// R_BI, which does to components what the Hamilton product q_BI (0, f) q_BI* does; any length
/// above 0.
Mat3 rotation_of(const Quaternion& q_BI);
/// Finite, and of a length between 0.5 and 2.
bool is_plausible(const Quaternion& q_BI);

/// One satellite of GPS on L1 C/A.
struct Observation {
  std::uint8_t prn = 0;       ///< 1 to 32
  double code_m = 0.0;        ///< pseudorange
  double phase_cycles = 0.0;  ///< grows with the range
  float cn0_dBHz = 0.0f;
  float lock_s = 0.0f;      ///< time of continuous tracking; a slip lets it fall back
  bool half_cycle = false;  ///< parity unknown: the phase may be off by half a cycle
};

/// One epoch of one receiver.
struct GnssEpoch {
  std::int64_t t_ns = 0;  ///< tag by the receiver's clock, GPS ns since 1980-01-06
  int count = 0;          ///< of observations
  Observation observation[kChannels] = {};
  bool has_fix = false;                        ///< the receiver's own solution, of its antenna
  Vec3 r_ECEF;                                 ///< [m]
  Vec3 v_ECEF;                                 ///< [m/s], relative to the rotating Earth
  float sigma_r_m = 0.0f, sigma_v_mps = 0.0f;  ///< per axis
};

/// Values that no receiver near the Earth sends, or a count out of range, make an epoch useless.
/// @return true if the tag, the count and (where there is one) the fix are plausible. Observations
///         are judged one by one, by is_plausible(const Observation&).
bool is_plausible(const GnssEpoch& epoch);
/// PRN 1 to 32, code 1.5e7 to 5e7 m (a LEO sees 2.0e7 to 2.9e7 m, a clock adds up to 3e5 m), phase
/// finite and below 2^40 cycles, C/N0 10 to 60 dB-Hz.
bool is_plausible(const Observation& observation);

}  // namespace formation_gnc
