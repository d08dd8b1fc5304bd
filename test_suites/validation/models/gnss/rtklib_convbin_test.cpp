// RTKLIB's convbin reads a log of the encoder: RINEX observations and navigation data are what went
// in.
#include <orrery/models/gnss/lnav.hpp>
#include <orrery/models/gnss/novatel_messages.hpp>

#include <cmath>
#include <span>

#include "../../../unit/harness/record/scratch_folder.hpp"
#include "../../../unit/models/gnss/broadcast_sample.hpp"
#include "rtklib.hpp"

namespace orrery::novatel {
namespace {

// In the past of any machine's clock, for RTKLIB completes the 10-bit week by it: 2025-03-20, week
// 2358.
constexpr SimTime kStart = from_ns(16510LL * 86400 * 1'000'000'000);
constexpr int kEpochs = 30;
constexpr int kSatellites = 8;
constexpr int kSlipEpoch = 15, kSlipSatellite = 3;
constexpr int kUnknownParitySatellite = 5;

std::string name_of(int satellite) {
  const int prn = satellite + 1;
  return std::string(prn < 10 ? "G0" : "G") + std::to_string(prn);
}

// Smooth and arbitrary: convbin takes the numbers as they are.
RangeObservation observation(int satellite, int epoch) {
  const double s = satellite;
  const double t = epoch;
  const bool slipped = satellite == kSlipSatellite && epoch >= kSlipEpoch;
  return {.prn = static_cast<std::uint16_t>(satellite + 1),
          .pseudorange_m = 20'123'456.125 + 1e5 * s + 500.25 * t,
          .pseudorange_sigma_m = 0.25f,
          .carrier_phase_cycles = 105'747'512.375 + 5e5 * s + 2628.5 * t,
          .carrier_phase_sigma_cycles = 0.01f,
          .doppler_Hz = static_cast<float>(-2628.5 + 8 * s),
          .cn0_dBHz = static_cast<float>(30 + 2 * s),
          .lock_time_s = static_cast<float>(slipped ? epoch - kSlipEpoch : 100 + epoch),
          .tracking_status = to_word({.channel = static_cast<std::uint8_t>(satellite),
                                      .parity_known = satellite != kUnknownParitySatellite})};
}

BroadcastEphemeris ephemeris(int satellite) {
  RawBroadcast raw;
  raw.iodc += satellite;
  raw.m0 += 100'000'007LL * satellite;
  raw.health = satellite == 7 ? 63 : 0;
  BroadcastEphemeris e = to_ephemeris(raw);
  e.prn = satellite + 1;
  return e;
}

constexpr IonUtc kIonUtc{.alpha = {1.1176e-8, 7.4506e-9, -5.9605e-8, -5.9605e-8},
                         .beta = {9.0112e4, 1.6384e4, -1.9661e5, -6.5536e4},
                         .utc_reference_week = 2358,
                         .utc_reference_s = 405504,
                         .leap_week = 1929,
                         .leap_day = 7,
                         .leap_seconds = 18,
                         .leap_seconds_future = 18};

ByteBuffer log_of(bool compressed) {
  ByteBuffer out;
  append({.t = kStart}, kIonUtc, out);
  for (int satellite = 0; satellite < kSatellites; ++satellite) {
    const BroadcastEphemeris e = ephemeris(satellite);
    append({.t = kStart},
           RawEphem{.prn = static_cast<std::uint32_t>(e.prn),
                    .reference_week = static_cast<std::uint32_t>(e.week),
                    .reference_s = static_cast<std::uint32_t>(e.toe_s),
                    .subframes = lnav::pack(e, 345600)},
           out);
  }
  for (int epoch = 0; epoch < kEpochs; ++epoch) {
    std::vector<RangeObservation> observations;
    for (int s = 0; s < kSatellites; ++s) observations.push_back(observation(s, epoch));
    const Header header{.t = kStart + std::chrono::seconds(epoch)};
    compressed ? append_rangecmp(header, observations, out)
               : append_range(header, observations, out);
    append(header, BestXyz{.r_ECEF = {7e6, 0, 0}}, out);  // ignored, and harmless
  }
  return out;
}

class RtklibConvbinTest : public testing::TestWithParam<bool> {
 protected:
  void SetUp() override {
    ORRERY_NEED_RTKLIB("convbin");
    const ByteBuffer log = log_of(GetParam());
    std::ofstream(folder_ / "log.gps", std::ios::binary)
        .write(reinterpret_cast<const char*>(log.data()), static_cast<std::streamsize>(log.size()));
    rtklib::run(folder_.path(),
                "convbin -r nov -v 3.04 -od -os -oi -ot -ol -o log.obs -n log.nav log.gps");
  }
  ScratchFolder folder_;
};

// RINEX prints 1 mm and 1/1000 cycle; RANGECMP's own steps are 1/128 m, 1/256 cycle and 1/256 Hz,
// all of which the values above are multiples of.
TEST_P(RtklibConvbinTest, ObservationsArriveAsTheyWere) {
  const std::vector<rtklib::RinexEpoch> epochs =
      rtklib::read_rinex_observations(folder_ / "log.obs");
  ASSERT_EQ(epochs.size(), std::size_t{kEpochs});
  EXPECT_EQ(epochs[10].time, "2025 03 20 00 00 10.0000000");
  for (int k = 0; k < kEpochs; ++k) {
    ASSERT_EQ(epochs[static_cast<std::size_t>(k)].satellites.size(), std::size_t{kSatellites});
    for (int s = 0; s < kSatellites; ++s) {
      SCOPED_TRACE(name_of(s) + " at " + std::to_string(k));
      const RangeObservation sent = observation(s, k);
      rtklib::RinexSatellite got = epochs[static_cast<std::size_t>(k)].satellites.at(name_of(s));
      EXPECT_NEAR(got["C1C"].value, sent.pseudorange_m, 0.51e-3);
      EXPECT_NEAR(got["L1C"].value, sent.carrier_phase_cycles, 0.51e-3);  // not its negative
      EXPECT_NEAR(got["D1C"].value, sent.doppler_Hz, 0.51e-3);
      EXPECT_NEAR(got["S1C"].value, sent.cn0_dBHz, 1e-3);
    }
  }
}

// Loss of lock: bit 0 at the injected slip and nowhere else; bit 1, half a cycle, where the parity
// is unknown.
TEST_P(RtklibConvbinTest, FlagsAreFirstEpochsTheInjectedSlipAndTheUnknownParity) {
  int k = 0;
  for (rtklib::RinexEpoch& epoch : rtklib::read_rinex_observations(folder_ / "log.obs")) {
    for (int s = 0; s < kSatellites; ++s) {
      const int slip = k == 0 || (s == kSlipSatellite && k == kSlipEpoch) ? 1 : 0;
      const int half = s == kUnknownParitySatellite ? 2 : 0;
      EXPECT_EQ(epoch.satellites[name_of(s)]["L1C"].loss_of_lock, slip | half)
          << name_of(s) << " at " << k;
    }
    ++k;
  }
  EXPECT_EQ(k, kEpochs);
}

// RINEX 3.04, Table A6: the order of the numbers; it prints 12 digits behind "0.".
TEST_P(RtklibConvbinTest, NavigationDataAreTheQuantisedElements) {
  const auto records = rtklib::read_rinex_navigation(rtklib::read_text(folder_ / "log.nav"));
  ASSERT_EQ(records.size(), std::size_t{kSatellites});
  for (int s = 0; s < kSatellites; ++s) {
    SCOPED_TRACE(name_of(s));
    const BroadcastEphemeris e = ephemeris(s);
    const std::vector<double>& got = records.at(name_of(s));
    const double expected[] = {e.af0_s,
                               e.af1_sps,
                               e.af2_sps2,
                               double(e.iode),
                               e.crs_m,
                               e.delta_n_radps,
                               e.mean_anomaly_rad,
                               e.cuc_rad,
                               e.eccentricity,
                               e.cus_rad,
                               e.sqrt_a_sqrtm,
                               e.toe_s,
                               e.cic_rad,
                               e.raan0_rad,
                               e.cis_rad,
                               e.i0_rad,
                               e.crc_m,
                               e.argument_of_perigee_rad,
                               e.raan_rate_radps,
                               e.i_rate_radps,
                               double(e.l2_codes),
                               double(e.week),
                               0};
    ASSERT_GE(got.size(), 29u);
    for (std::size_t i = 0; i < std::size(expected); ++i) {
      EXPECT_NEAR(got[i], expected[i], 5.1e-12 * std::abs(expected[i])) << "number " << i;
    }
    EXPECT_NEAR(got[23], 5.7, 0.01);  // URA of index 3: IS-GPS-200, 20.3.3.3.1.3
    EXPECT_EQ(got[24], e.health);
    EXPECT_NEAR(got[25], e.tgd_s, 5.1e-12 * std::abs(e.tgd_s));
    EXPECT_EQ(got[26], e.iodc);
    EXPECT_EQ(got[27], 345606);  // what the hand-over word of subframe 1 counts to
  }
}

// Printed to four digits behind "0.".
TEST_P(RtklibConvbinTest, IonosphereAndLeapSecondsStandInTheHeader) {
  std::map<std::string, std::string> labelled;
  std::istringstream file(rtklib::read_text(folder_ / "log.nav"));
  for (std::string line; std::getline(file, line) && line.find("END OF HEADER") == line.npos;) {
    labelled[line.substr(60, 9) + line.substr(0, 4)] = line;
  }
  const auto coefficients = [&](const std::string& key, const std::array<double, 4>& expected) {
    std::string line = labelled[key];
    ASSERT_GE(line.size(), 60u) << key;
    for (char& c : line) c = c == 'D' ? 'E' : c;
    for (std::size_t i = 0; i < 4; ++i) {
      EXPECT_NEAR(std::stod(line.substr(5 + 12 * i, 12)), expected[i],
                  5.1e-4 * std::abs(expected[i]))
          << key << " " << i;
    }
  };
  coefficients("IONOSPHERGPSA", kIonUtc.alpha);
  coefficients("IONOSPHERGPSB", kIonUtc.beta);
  EXPECT_EQ(std::stoi(labelled["LEAP SECO    "]), 18);
}

INSTANTIATE_TEST_SUITE_P(Logs, RtklibConvbinTest, testing::Bool(), [](const auto& compressed) {
  return std::string(compressed.param ? "RANGECMP" : "RANGE");
});

}  // namespace
}  // namespace orrery::novatel
