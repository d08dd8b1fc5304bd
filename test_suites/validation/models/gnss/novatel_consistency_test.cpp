// What logs of real NovAtel receivers say about one another, decoded by the flight software's
// decoder.
#include <orrery/models/gnss/lnav.hpp>

#include <cmath>
#include <cstring>
#include <map>

#include "novatel_log_files.hpp"

namespace orrery::novatel {
namespace {

constexpr double kSpeedOfLight_mps = 299792458;

using Counts = std::map<int, int>;

struct Found {
  Counts logs;
  novatel_framer framer;
};

Found found_in(const ByteBuffer& log, std::size_t chunk) {
  Counts logs;
  const novatel_framer framer = for_each_frame(
      log, chunk, 8192, [&](const novatel_frame& frame) { ++logs[frame.header.message_id]; });
  return {logs, framer};
}

class NovatelLogsConsistencyTest : public NovatelLogs {};

// Counts of the data's README; short-header INSPVAS and NMEA lie between the logs.
TEST_F(NovatelLogsConsistencyTest, LogsAmidTextAndShortHeadersAreAllFound) {
  for (const std::size_t chunk : {1u, 64u, 4096u}) {
    const Found bestpos = found_in(binary("oem7_bestpos.gps"), chunk);
    EXPECT_EQ(bestpos.logs, (Counts{{42, 5}, {99, 5}, {726, 2}, {1163, 2}, {1465, 2}}));
    EXPECT_EQ(bestpos.framer.short_frames, 10u);
    EXPECT_GT(bestpos.framer.passed_over, 0u);
    EXPECT_EQ(bestpos.framer.bad_frames, 0u);
    EXPECT_EQ(found_in(binary("oem7_time.gps"), chunk).logs, (Counts{{101, 6}}));
  }
}

// TIME against its own header: UTC is GPS time less 18 s since 2017. No ASCII twin exists.
TEST_F(NovatelLogsConsistencyTest, TimeLogSaysItsHeadersInstantInUtc) {
  int seen = 0;
  for_each_frame(binary("oem7_time.gps"), 100, 4096, [&](const novatel_frame& frame) {
    novatel_time time;
    ASSERT_TRUE(novatel_get_time(&frame, &time));
    EXPECT_EQ(time.clock_status, 0u);
    EXPECT_EQ(time.utc_status, 1u);
    EXPECT_NEAR(time.utc_offset_s, -18, 1e-6);
    EXPECT_LT(std::abs(time.offset_s), 1e-6);
    EXPECT_GT(time.offset_sigma_s, 0);
    const SimTime utc = gps_midnight(static_cast<int>(time.year), time.month, time.day) +
                        std::chrono::hours(time.hour) + std::chrono::minutes(time.minute) +
                        std::chrono::milliseconds(time.millisecond);
    EXPECT_EQ(to_ns(utc + 18s), novatel_time_ns(&frame));
    ByteBuffer again;
    ASSERT_TRUE(reencode(frame, again));
    EXPECT_EQ(std::memcmp(again.data() + kHeaderBytes, frame.body, frame.header.body_bytes), 0);
    ++seen;
  });
  EXPECT_EQ(seen, 6);
}

// L1 and L2 of GPS; GLONASS channels of 562.5 and 437.5 kHz around 1602 and 1246 MHz (its ICD).
double wavelength_m(const novatel_observation& o) {
  const bool second = NOVATEL_SIGNAL(o.tracking_status) != 0;
  if (NOVATEL_SYSTEM(o.tracking_status) == 0) {
    return kSpeedOfLight_mps / (second ? 1227.60e6 : 1575.42e6);
  }
  const double channel = o.glonass_frequency - 7.0;
  return kSpeedOfLight_mps / (second ? 1246e6 + 437.5e3 * channel : 1602e6 + 562.5e3 * channel);
}

// What an observation moved by since an earlier one, less what the mean Doppler says [m].
struct Unexplained {
  double code_m, phase_m, code_sigma_m;
};

Unexplained moved(const novatel_observation& a, const novatel_observation& b, double dt_s) {
  constexpr double kRoll = 8388608;
  const double lambda_m = wavelength_m(a);
  const double doppler_cycles = -0.5 * (a.doppler_Hz + b.doppler_Hz) * dt_s;
  const double phase_cycles = novatel_restored_phase_cycles(&b, lambda_m);
  EXPECT_EQ(a.prn, b.prn);
  EXPECT_NEAR(b.lock_time_s - a.lock_time_s, dt_s, 0.05);
  EXPECT_LE(std::abs(phase_cycles - b.pseudorange_m / lambda_m), kRoll / 2);
  // Restored is the roll-over next to the pseudorange; the receiver's own need not be that.
  const double phase =
      std::remainder(phase_cycles - a.carrier_phase_cycles - doppler_cycles, kRoll);
  return {b.pseudorange_m - a.pseudorange_m - lambda_m * doppler_cycles, lambda_m * phase,
          a.pseudorange_sigma_m};
}

// Five or six seconds after a RANGE a RANGECMP reports the same signals, moved on by the mean
// Doppler and by what the clock drift changed in between, common to all: -0.06 and 1.07 m are
// observed. Left are the Doppler's noise over that time (observed: at most 0.25 m) and the code's
// (1.05 m where its sigma is 0.49 m, else below 0.6 m). A wrong bit, sign or scale would leave
// hundreds.
TEST_F(NovatelLogsConsistencyTest, RangeCmpContinuesWhatRangeReported) {
  for (const char* file : {"OnceEachAgain.GPS", "MorePropak.GPS"}) {
    std::map<std::uint32_t, novatel_observation> before;
    std::int64_t t_ns = 0;
    std::vector<Unexplained> signals;
    for_each_frame(binary(file), 100, 8192, [&](const novatel_frame& frame) {
      novatel_observation o;
      for (std::uint32_t i = 0; novatel_get_range(&frame, i, &o) != 0; ++i) {
        before[o.tracking_status] = o;
        t_ns = novatel_time_ns(&frame);
      }
      const double dt_s = 1e-9 * static_cast<double>(novatel_time_ns(&frame) - t_ns);
      for (std::uint32_t i = 0; novatel_get_rangecmp(&frame, i, &o) != 0; ++i) {
        if (before.count(o.tracking_status) == 0) continue;
        signals.push_back(moved(before[o.tracking_status], o, dt_s));
      }
    });
    ASSERT_GE(signals.size(), 24u) << file;
    double clock_m = 0;
    for (const Unexplained& s : signals) clock_m += s.phase_m / static_cast<double>(signals.size());
    EXPECT_LT(std::abs(clock_m), 3) << file;
    for (const Unexplained& s : signals) {
      EXPECT_NEAR(s.phase_m, clock_m, 0.4) << file;
      EXPECT_NEAR(s.code_m, clock_m, 0.4 + 3 * s.code_sigma_m) << file;
    }
  }
}

BroadcastEphemeris to_broadcast(const novatel_gpsephem& m) {
  return {.prn = static_cast<int>(m.prn),
          .week = static_cast<int>(m.week),
          .toe_s = m.toe_s,
          .sqrt_a_sqrtm = std::sqrt(m.semi_major_axis_m),
          .eccentricity = m.eccentricity,
          .i0_rad = m.i0_rad,
          .raan0_rad = m.raan0_rad,
          .argument_of_perigee_rad = m.argument_of_perigee_rad,
          .mean_anomaly_rad = m.mean_anomaly_rad,
          .delta_n_radps = m.delta_n_radps,
          .raan_rate_radps = m.raan_rate_radps,
          .i_rate_radps = m.i_rate_radps,
          .cuc_rad = m.cuc_rad,
          .cus_rad = m.cus_rad,
          .crc_m = m.crc_m,
          .crs_m = m.crs_m,
          .cic_rad = m.cic_rad,
          .cis_rad = m.cis_rad,
          .toc_s = m.toc_s,
          .af0_s = m.af0_s,
          .af1_sps = m.af1_sps,
          .af2_sps2 = m.af2_sps2,
          .tgd_s = m.tgd_s,
          .iode = static_cast<int>(m.iode1),
          .iodc = static_cast<int>(m.iodc),
          .health = static_cast<int>(m.health)};
}

// A receiver computed these from subframes, so our steps must hit them: half a step would be 2e-10
// of an angle of 1 rad and 1e-4 or more of the rates. It took the true pi, which is 2.2e-15 more
// than the message's, relatively; a rounding each on its side and ours.
TEST_F(NovatelLogsConsistencyTest, ValuesOfARealEphemerisAreWholeStepsOfTheMessage) {
  int seen = 0;
  for (const char* file : {"OnceEachAgain.GPS", "PropakWithGlonass.GPS"}) {
    for_each_frame(binary(file), 100, 8192, [&](const novatel_frame& frame) {
      novatel_gpsephem log;
      if (novatel_get_gpsephem(&frame, &log) == 0) return;
      SCOPED_TRACE(log.prn);
      ++seen;
      const BroadcastEphemeris e = to_broadcast(log);
      const BroadcastEphemeris q = lnav::quantised(e);
      const auto expect_whole = [](double value, double rounded) {
        EXPECT_NEAR(rounded, value, 3e-15 * std::abs(value));
      };
      expect_whole(e.sqrt_a_sqrtm, q.sqrt_a_sqrtm);
      expect_whole(e.eccentricity, q.eccentricity);
      expect_whole(e.i0_rad, q.i0_rad);
      expect_whole(e.raan0_rad, q.raan0_rad);
      expect_whole(e.argument_of_perigee_rad, q.argument_of_perigee_rad);
      expect_whole(e.mean_anomaly_rad, q.mean_anomaly_rad);
      expect_whole(e.delta_n_radps, q.delta_n_radps);
      expect_whole(e.raan_rate_radps, q.raan_rate_radps);
      expect_whole(e.i_rate_radps, q.i_rate_radps);
      expect_whole(e.cuc_rad, q.cuc_rad);
      expect_whole(e.cus_rad, q.cus_rad);
      expect_whole(e.crc_m, q.crc_m);
      expect_whole(e.crs_m, q.crs_m);
      expect_whole(e.cic_rad, q.cic_rad);
      expect_whole(e.cis_rad, q.cis_rad);
      expect_whole(e.af0_s, q.af0_s);
      expect_whole(e.af1_sps, q.af1_sps);
      expect_whole(e.af2_sps2, q.af2_sps2);
      expect_whole(e.tgd_s, q.tgd_s);
      EXPECT_EQ(q.toe_s, e.toe_s);
      EXPECT_EQ(q.toc_s, e.toc_s);
      EXPECT_EQ(q.week, e.week);
      // Our log of it has the receiver's own mean motion and a variance of the table.
      const GpsEphem ours = to_gpsephem(e, log.tow_s, static_cast<int>(log.z_week));
      EXPECT_NEAR(ours.corrected_mean_motion_radps, log.corrected_mean_motion_radps, 1e-18);
      bool in_table = false;
      for (int index = 0; index < 16; ++index) {
        const double ura_m = lnav::ura_m(index);
        in_table = in_table || ura_m * ura_m == log.ura_variance_m2;
      }
      EXPECT_TRUE(in_table) << log.ura_variance_m2;
    });
  }
  EXPECT_EQ(seen, 38 + 18);  // the data's README
}

}  // namespace
}  // namespace orrery::novatel
