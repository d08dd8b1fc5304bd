/// Orbit and clock of one GPS satellite as the satellite itself broadcasts them (LNAV subframes
/// 1-3).
///
/// Source  IS-GPS-200, 20.3.3.3 (clock, health) and 20.3.3.4 (orbit, Table 20-III). Units here are
/// SI
///         and radians; the message's semicircles are converted with its own kGpsPi (lnav.hpp).
#pragma once

#include <orrery/harness/kernel/simulator_only.hpp>

namespace orrery {

/// The message's value of pi, IS-GPS-200 Table 20-IV. Using the true one moves a satellite by 0.8
/// um.
constexpr double kGpsPi = 3.1415926535898;

/// Everything a user needs for the satellite's position and clock between toe - 2 h and toe + 2 h.
/// Times of week count from the start of `week`, which is the full GPS week of toe, not modulo
/// 1024.
struct BroadcastEphemeris {
  int prn = 0;   // 1 to 32
  int week = 0;  // of toe and toc

  // Orbit at toe, in the Earth-fixed frame of WGS 84 by the user algorithm of Table 20-IV.
  double toe_s = 0;         // 0 to 604784, a multiple of 16
  double sqrt_a_sqrtm = 0;  // square root of the semi-major axis
  double eccentricity = 0;  // 0 to 0.03
  double i0_rad = 0;        // inclination
  double raan0_rad = 0;     // longitude of the ascending node at the start of the week
  double argument_of_perigee_rad = 0;
  double mean_anomaly_rad = 0;      // M0
  double delta_n_radps = 0;         // mean motion less that of Kepler's law
  double raan_rate_radps = 0;       // relative to inertial space
  double i_rate_radps = 0;          // IDOT
  double cuc_rad = 0, cus_rad = 0;  // second harmonics of the argument of latitude,
  double crc_m = 0, crs_m = 0;      // of the radius
  double cic_rad = 0, cis_rad = 0;  // and of the inclination: cosine, sine

  // Clock: offset to GPS time af0 + af1 (t - toc) + af2 (t - toc)^2, without relativity.
  double toc_s = 0;  // 0 to 604784, a multiple of 16
  double af0_s = 0, af1_sps = 0, af2_sps2 = 0;
  double tgd_s = 0;  // a single-frequency L1 user's clock is slower by this

  int iode = 0;       // issue of the orbit, 0 to 255, equal to iodc % 256
  int iodc = 0;       // issue of the clock, 0 to 1023
  int health = 0;     // 6 bits, 0: all signals good
  int ura_index = 0;  // 0 to 15; 0: at most 2.4 m, 15: no prediction
  int l2_codes = 1;   // 1: P code on L2, 2: C/A code
  bool l2p_data_off = false;
  bool fit_interval_above_4h = false;
  int aodo = 31;  // age of correction data in units of 900 s; 31: no table to correct

  bool operator==(const BroadcastEphemeris&) const = default;
};

}  // namespace orrery
