/// A broadcast ephemeris for tests, as the whole numbers of the LNAV message.
#pragma once

#include <orrery/models/gnss/broadcast_ephemeris.hpp>

namespace orrery {

/// Of a usual GPS satellite; signs are mixed and no two numbers are equal.
struct RawBroadcast {
  int week = 2358, ura = 3, health = 0, iodc = 613;
  long long toe = 345600 / 16, toc = 345600 / 16;
  long long tgd = -11, af2 = -1, af1 = -123, af0 = 987654;
  long long crs = -1234, delta_n = 13001, m0 = -1234567890, cuc = -2345, e = 87654321, cus = 3456;
  long long sqrt_a = 2701954321;
  long long cic = -45, raan0 = 1987654321, cis = 56, i0 = 657890123, crc = 7890,
            perigee = -1098765432, raan_rate = -23456, i_rate = -567;
};

/// The constants are powers of two, written out; semicircles times kGpsPi.
inline BroadcastEphemeris to_ephemeris(const RawBroadcast& r) {
  constexpr double k2p5 = 32, k2p19 = 524288, k2p29 = 536870912, k2p31 = 2147483648,
                   k2p33 = 8589934592, k2p43 = 8796093022208, k2p55 = 36028797018963968;
  const auto d = [](long long raw) { return static_cast<double>(raw); };
  return {.prn = 17,
          .week = r.week,
          .toe_s = 16 * d(r.toe),
          .sqrt_a_sqrtm = d(r.sqrt_a) / k2p19,
          .eccentricity = d(r.e) / k2p33,
          .i0_rad = d(r.i0) / k2p31 * kGpsPi,
          .raan0_rad = d(r.raan0) / k2p31 * kGpsPi,
          .argument_of_perigee_rad = d(r.perigee) / k2p31 * kGpsPi,
          .mean_anomaly_rad = d(r.m0) / k2p31 * kGpsPi,
          .delta_n_radps = d(r.delta_n) / k2p43 * kGpsPi,
          .raan_rate_radps = d(r.raan_rate) / k2p43 * kGpsPi,
          .i_rate_radps = d(r.i_rate) / k2p43 * kGpsPi,
          .cuc_rad = d(r.cuc) / k2p29,
          .cus_rad = d(r.cus) / k2p29,
          .crc_m = d(r.crc) / k2p5,
          .crs_m = d(r.crs) / k2p5,
          .cic_rad = d(r.cic) / k2p29,
          .cis_rad = d(r.cis) / k2p29,
          .toc_s = 16 * d(r.toc),
          .af0_s = d(r.af0) / k2p31,
          .af1_sps = d(r.af1) / k2p43,
          .af2_sps2 = d(r.af2) / k2p55,
          .tgd_s = d(r.tgd) / k2p31,
          .iode = r.iodc % 256,
          .iodc = r.iodc,
          .health = r.health,
          .ura_index = r.ura};
}

}  // namespace orrery
