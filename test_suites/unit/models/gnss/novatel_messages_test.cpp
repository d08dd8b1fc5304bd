#include <orrery/models/gnss/novatel_messages.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

namespace orrery::novatel {
namespace {

// 2025-03-20 00:00:10 GPS, week 2358 = 0x0936, 345610000 ms = 0x14999710 (novatel_test.cpp).
constexpr SimTime kTime = from_ns((16510LL * 86400 + 10) * 1'000'000'000);
constexpr Header kHeader{.t = kTime};

ByteBuffer from_hex(std::string_view hex) {
  ByteBuffer out;
  unsigned value = 0;
  int digits = 0;
  for (const char c : hex) {
    if (c == ' ') continue;
    value = value * 16 + static_cast<unsigned>(c <= '9' ? c - '0' : c - 'a' + 10);
    if (++digits % 2 == 0) {
      out.push_back(static_cast<std::byte>(value & 0xFF));
      value = 0;
    }
  }
  return out;
}

// A body as the layout tables have it: each value with the offset that its table gives.
class Layout {
 public:
  template <class T>
  Layout& at(std::size_t offset, T value) {
    EXPECT_EQ(bytes_.size(), offset);
    static_assert(std::endian::native == std::endian::little);
    const std::size_t start = bytes_.size();
    bytes_.resize(start + sizeof value);
    std::memcpy(bytes_.data() + start, &value, sizeof value);
    return *this;
  }
  Layout& text(std::size_t offset, std::string_view value, std::size_t width) {
    EXPECT_EQ(bytes_.size(), offset);
    for (const char c : value) bytes_.push_back(static_cast<std::byte>(c));
    bytes_.resize(offset + width);
    return *this;
  }
  ByteBuffer bytes() const { return bytes_; }

 private:
  ByteBuffer bytes_;
};

// Header and CRC are checked here once for all, so that each test is left with a body.
ByteBuffer body_of(const ByteBuffer& frame, std::uint16_t id) {
  ByteBuffer head =
      from_hex("aa4412 1c 0000 00 20 0000 0000 64 b4 3609 10979914 00000000 0000 803e");
  const std::size_t body_bytes = frame.size() - kHeaderBytes - kCrcBytes;
  head[4] = static_cast<std::byte>(id & 0xFF);
  head[5] = static_cast<std::byte>(id >> 8);
  head[8] = static_cast<std::byte>(body_bytes & 0xFF);
  head[9] = static_cast<std::byte>(body_bytes >> 8);
  EXPECT_EQ(ByteBuffer(frame.begin(), frame.begin() + kHeaderBytes), head);
  EXPECT_EQ(crc32(frame), 0u) << "CRC over a frame and its CRC";
  return {frame.begin() + kHeaderBytes, frame.end() - kCrcBytes};
}

template <class Message>
ByteBuffer body_of(const Message& message, std::uint16_t id) {
  ByteBuffer frame;
  append(kHeader, message, frame);
  return body_of(frame, id);
}

ByteBuffer range_body(std::span<const RangeObservation> observations) {
  ByteBuffer frame;
  append_range(kHeader, observations, frame);
  return body_of(frame, 43);
}

ByteBuffer rangecmp_body(const RangeObservation& observation) {
  ByteBuffer frame;
  append_rangecmp(kHeader, {&observation, 1}, frame);
  return body_of(frame, 140);
}

// The word that the tables give for GPS L1 C/A in lock on channel 0.
TEST(NovatelChannelStatusTest, LockedGpsL1IsTheManualsWord) {
  EXPECT_EQ(to_word({}), 0x08003C04u);
  EXPECT_EQ(to_word({.channel = 7}), 0x08003C04u | 7u << 5);
}

// Each field alone, so that no two can stand for each other.
TEST(NovatelChannelStatusTest, EveryFieldHasItsBits) {
  constexpr ChannelStatus kNothing{.state = TrackingState::kIdle,
                                   .phase_locked = false,
                                   .parity_known = false,
                                   .code_locked = false,
                                   .correlator = 0,
                                   .primary_L1 = false};
  const auto with = [&](auto set) {
    ChannelStatus status = kNothing;
    set(status);
    return to_word(status);
  };
  EXPECT_EQ(to_word(kNothing), 0u);
  EXPECT_EQ(with([](auto& s) { s.state = TrackingState::kAidedPhaseLock; }), 11u);
  EXPECT_EQ(with([](auto& s) { s.channel = 31; }), 31u << 5);
  EXPECT_EQ(with([](auto& s) { s.phase_locked = true; }), 1u << 10);
  EXPECT_EQ(with([](auto& s) { s.parity_known = true; }), 1u << 11);
  EXPECT_EQ(with([](auto& s) { s.code_locked = true; }), 1u << 12);
  EXPECT_EQ(with([](auto& s) { s.correlator = 7; }), 7u << 13);
  EXPECT_EQ(with([](auto& s) { s.system = 7; }), 7u << 16);
  EXPECT_EQ(with([](auto& s) { s.grouped = true; }), 1u << 20);
  EXPECT_EQ(with([](auto& s) { s.signal = GpsSignal::kL2CM; }), 17u << 21);
  EXPECT_EQ(with([](auto& s) { s.primary_L1 = true; }), 1u << 27);
  EXPECT_EQ(with([](auto& s) { s.half_cycle_added = true; }), 1u << 28);
  EXPECT_EQ(with([](auto& s) { s.prn_locked_out = true; }), 1u << 30);
  EXPECT_EQ(with([](auto& s) { s.forced_assignment = true; }), 1u << 31);
}

// Written from the table; the doubles are 20 000 000 = 0x1.312D p24 and 1.5, -2.
TEST(NovatelRangeTest, BytesAreThoseWrittenByHand) {
  const RangeObservation observation{.prn = 17,
                                     .glonass_frequency = 3,
                                     .pseudorange_m = 20'000'000,
                                     .pseudorange_sigma_m = 0.25f,
                                     .carrier_phase_cycles = 1.5,
                                     .carrier_phase_sigma_cycles = 0.125f,
                                     .doppler_Hz = -2.0f,
                                     .cn0_dBHz = 45.0f,
                                     .lock_time_s = 1024.0f};
  EXPECT_EQ(range_body({&observation, 1}), from_hex("01000000 "                  // one observation
                                                    "1100 0300 "                 // PRN, frequency
                                                    "00000000d0127341 0000803e"  // pseudorange
                                                    "000000000000f8bf 0000003e"  // minus the phase
                                                    "000000c0 00003442 00008044 043c0008"));
}

TEST(NovatelRangeTest, AccumulatedDopplerFallsWhenThePhaseRangeGrows) {
  const RangeObservation observation{.carrier_phase_cycles = 123456789.25};
  double adr = 0;
  std::memcpy(&adr, range_body({&observation, 1}).data() + 4 + 16, 8);
  EXPECT_EQ(adr, -123456789.25);
}

TEST(NovatelRangeTest, ObservationsFollowTheirCountInSteps) {
  for (const std::size_t count : {0u, 1u, 12u, 40u}) {
    std::vector<RangeObservation> observations(count);
    for (std::size_t i = 0; i < count; ++i) observations[i].prn = static_cast<std::uint16_t>(i + 1);
    const ByteBuffer body = range_body(observations);
    ASSERT_EQ(body.size(), 4 + 44 * count);
    EXPECT_EQ(std::to_integer<std::size_t>(body[0]), count);
    for (std::size_t i = 0; i < count; ++i) {
      EXPECT_EQ(std::to_integer<std::size_t>(body[4 + 44 * i]), i + 1);
    }
  }
}

TEST(NovatelRangeTest, MoreThanTheLengthFieldCanCountIsRefusedWhole) {
  const std::vector<RangeObservation> observations(1490);  // 4 + 44 x 1489 = 65520 still fits
  ByteBuffer out = from_hex("abcd");
  EXPECT_THAT([&] { append_range(kHeader, observations, out); },
              testing::ThrowsMessage<std::invalid_argument>(testing::HasSubstr("65564 bytes")));
  EXPECT_EQ(out, from_hex("abcd"));
  append_range(kHeader, std::span(observations).first(1489), out);
  EXPECT_EQ(out.size(), 2 + 28 + 65520 + 4);
}

// Doppler 3.5 Hz = 896/256; pseudorange 20000000.125 m = 2560000016/128 = 0x98968010; phase -0.5
// cycles, sent as +0.5 = 128/256; sigmas of index 2 and 5/512; lock 10.5 s = 336/32 = 0x150; 45
// dB-Hz is 25 above 20: 25 << 21 = 0x03200000. The low four bits of the pseudorange, 0, come on top
// of the Doppler's 28.
TEST(NovatelRangeCmpTest, BytesAreThoseWrittenByHand) {
  EXPECT_EQ(rangecmp_body({.prn = 31,
                           .glonass_frequency = 9,
                           .pseudorange_m = 20000000.125,
                           .pseudorange_sigma_m = 0.12f,
                           .carrier_phase_cycles = -0.5,
                           .carrier_phase_sigma_cycles = 5.0f / 512,
                           .doppler_Hz = 3.5f,
                           .cn0_dBHz = 45.0f,
                           .lock_time_s = 10.5f}),
            from_hex("01000000 043c0008 80030000 01688909 80000000 42 1f 50012027 0000"));
}

// -1 Hz is 0xFFFFF00 in 28 bits; the four bits above are the pseudorange's lowest, 7/128 m.
TEST(NovatelRangeCmpTest, NegativeDopplerLeavesThePseudorangesBits) {
  const ByteBuffer body = rangecmp_body({.pseudorange_m = 7.0 / 128, .doppler_Hz = -1.0f});
  EXPECT_EQ(ByteBuffer(body.begin() + 8, body.begin() + 16), from_hex("00ffff7f 00000000"));
}

std::int32_t phase_word(double carrier_phase_cycles) {
  std::int32_t word = 0;
  std::memcpy(&word, rangecmp_body({.carrier_phase_cycles = carrier_phase_cycles}).data() + 16, 4);
  return word;
}

// The manual's restoration: the roll-over count is that which brings ADR nearest to minus the
// pseudorange in cycles. Quantisation: half of 1/256 cycle.
TEST(NovatelRangeCmpTest, RestoredPhaseIsTheSentOneToHalfAStep) {
  constexpr double kRoll = 8388608;
  constexpr double kWavelength_m = 299792458.0 / 1575.42e6;
  for (double range_m = 19e6; range_m < 27e6; range_m += 123456.789) {
    for (const double ambiguity : {-3e6, -5.0, 0.0, 5.0, 3e6}) {
      const double phase = range_m / kWavelength_m + ambiguity;
      const double adr = phase_word(phase) / 256.0;
      EXPECT_LE(std::abs(adr), kRoll);
      const double rolls = std::round((range_m / kWavelength_m + adr) / kRoll);
      EXPECT_NEAR(adr - kRoll * rolls, -phase, 0.5 / 256 + 1e-6);
    }
  }
}

TEST(NovatelRangeCmpTest, PhaseRollsOverAtTheEndOfItsWord) {
  constexpr double kEnd = 8388608;
  EXPECT_EQ(phase_word(-(kEnd - 1.0 / 256)), 0x7FFFFFFF);
  EXPECT_EQ(phase_word(kEnd), std::numeric_limits<std::int32_t>::min());
  EXPECT_EQ(phase_word(-kEnd), std::numeric_limits<std::int32_t>::min());  // one step on
  EXPECT_EQ(phase_word(0.0), 0);
}

TEST(NovatelRangeCmpTest, WhatIsBeyondAFieldTakesItsEnd) {
  const ByteBuffer high = rangecmp_body({.pseudorange_m = 1e9,
                                         .pseudorange_sigma_m = 1e3f,
                                         .carrier_phase_sigma_cycles = 1.0f,
                                         .doppler_Hz = 1e6f,
                                         .cn0_dBHz = 60.0f,
                                         .lock_time_s = 1e6f});
  EXPECT_EQ(ByteBuffer(high.begin() + 8, high.end()),
            from_hex("fffffff7 ffffffff 00000000 ff 00 ffffff03 0000"));
  const ByteBuffer low = rangecmp_body({.pseudorange_m = -1,
                                        .pseudorange_sigma_m = 0.001f,
                                        .doppler_Hz = -1e6f,
                                        .cn0_dBHz = 10.0f,
                                        .lock_time_s = -1.0f});
  EXPECT_EQ(ByteBuffer(low.begin() + 8, low.end()),
            from_hex("00000008 00000000 00000000 00 00 00000000 0000"));
}

TEST(NovatelRangeCmpTest, NotANumberIsSentAsAnEndAndNeverAsGarbage) {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  const ByteBuffer body = rangecmp_body({.pseudorange_m = kNaN,
                                         .carrier_phase_cycles = kNaN,
                                         .doppler_Hz = static_cast<float>(kNaN)});
  EXPECT_EQ(ByteBuffer(body.begin() + 8, body.begin() + 20),
            from_hex("00000008 00000000 00000000"));
}

TEST(NovatelMessageTest, BestPosFollowsItsTable) {
  const BestPos message{.latitude_deg = 1.5,
                        .longitude_deg = -2.5,
                        .height_msl_m = 500'000,
                        .undulation_m = -29.25f,
                        .sigma_latitude_m = 1.25f,
                        .sigma_longitude_m = 2.25f,
                        .sigma_height_m = 3.25f,
                        .station_id = {'B', 'A', 'S', 'E'},
                        .differential_age_s = 4.25f,
                        .solution_age_s = 5.25f,
                        .satellites_tracked = 12,
                        .satellites_used = 11,
                        .satellites_used_L1 = 10,
                        .satellites_used_multi_frequency = 9,
                        .extended_solution_status = 6,
                        .galileo_beidou_mask = 5,
                        .gps_glonass_mask = 1};
  EXPECT_EQ(body_of(message, 42), Layout()
                                      .at(0, 0u)
                                      .at(4, 16u)
                                      .at(8, 1.5)
                                      .at(16, -2.5)
                                      .at(24, 500'000.0)
                                      .at(32, -29.25f)
                                      .at(36, 61u)
                                      .at(40, 1.25f)
                                      .at(44, 2.25f)
                                      .at(48, 3.25f)
                                      .text(52, "BASE", 4)
                                      .at(56, 4.25f)
                                      .at(60, 5.25f)
                                      .text(64, "\x0c\x0b\x0a\x09", 4)
                                      .text(68, std::string_view("\0\6\5\1", 4), 4)
                                      .bytes());
}

TEST(NovatelMessageTest, TimeFollowsItsTable) {
  const Time message{.clock_status = 1,
                     .offset_s = 5e-8,
                     .offset_sigma_s = 1e-8,
                     .utc_offset_s = -18,
                     .year = 2025,
                     .month = 3,
                     .day = 19,
                     .hour = 23,
                     .minute = 59,
                     .millisecond = 52000};
  EXPECT_EQ(body_of(message, 101), Layout()
                                       .at(0, 1u)
                                       .at(4, 5e-8)
                                       .at(12, 1e-8)
                                       .at(20, -18.0)
                                       .at(28, 2025u)
                                       .text(32, "\x03\x13\x17\x3b", 4)
                                       .at(36, 52000u)
                                       .at(40, 1u)
                                       .bytes());
}

TEST(NovatelMessageTest, RawEphemFollowsItsTable) {
  RawEphem message{.prn = 5, .reference_week = 2358, .reference_s = 345600};
  for (std::size_t k = 0; k < 3; ++k)
    message.subframes[k].fill(static_cast<std::byte>(0x11 * (k + 1)));
  EXPECT_EQ(body_of(message, 41), Layout()
                                      .at(0, 5u)
                                      .at(4, 2358u)
                                      .at(8, 345600u)
                                      .text(12, std::string(30, '\x11'), 30)
                                      .text(42, std::string(30, '\x22'), 30)
                                      .text(72, std::string(30, '\x33'), 30)
                                      .bytes());
}

// Offsets of the table; each value differs from all others, so that no two can be exchanged.
TEST(NovatelMessageTest, GpsEphemFollowsItsTable) {
  const GpsEphem message{.prn = 1,
                         .tow_s = 1.5,
                         .health = 2,
                         .iode1 = 3,
                         .iode2 = 4,
                         .week = 5,
                         .z_week = 6,
                         .toe_s = 2.5,
                         .semi_major_axis_m = 3.5,
                         .delta_n_radps = 4.5,
                         .mean_anomaly_rad = 5.5,
                         .eccentricity = 6.5,
                         .argument_of_perigee_rad = 7.5,
                         .cuc_rad = 8.5,
                         .cus_rad = 9.5,
                         .crc_m = 10.5,
                         .crs_m = 11.5,
                         .cic_rad = 12.5,
                         .cis_rad = 13.5,
                         .i0_rad = 14.5,
                         .i_rate_radps = 15.5,
                         .raan0_rad = 16.5,
                         .raan_rate_radps = 17.5,
                         .iodc = 7,
                         .toc_s = 18.5,
                         .tgd_s = 19.5,
                         .af0_s = 20.5,
                         .af1_sps = 21.5,
                         .af2_sps2 = 22.5,
                         .anti_spoofing = 8,
                         .corrected_mean_motion_radps = 23.5,
                         .ura_variance_m2 = 24.5};
  EXPECT_EQ(body_of(message, 7), Layout()
                                     .at(0, 1u)
                                     .at(4, 1.5)
                                     .at(12, 2u)
                                     .at(16, 3u)
                                     .at(20, 4u)
                                     .at(24, 5u)
                                     .at(28, 6u)
                                     .at(32, 2.5)
                                     .at(40, 3.5)
                                     .at(48, 4.5)
                                     .at(56, 5.5)
                                     .at(64, 6.5)
                                     .at(72, 7.5)
                                     .at(80, 8.5)
                                     .at(88, 9.5)
                                     .at(96, 10.5)
                                     .at(104, 11.5)
                                     .at(112, 12.5)
                                     .at(120, 13.5)
                                     .at(128, 14.5)
                                     .at(136, 15.5)
                                     .at(144, 16.5)
                                     .at(152, 17.5)
                                     .at(160, 7u)
                                     .at(164, 18.5)
                                     .at(172, 19.5)
                                     .at(180, 20.5)
                                     .at(188, 21.5)
                                     .at(196, 22.5)
                                     .at(204, 8u)
                                     .at(208, 23.5)
                                     .at(216, 24.5)
                                     .bytes());
}

// Axis, correction and mean motion of a real receiver's log (PRN 1 of OnceEachAgain.ASC in the
// reference data: GAVLab/novatel), printed to 10 digits: half a unit of the tenth.
TEST(NovatelMessageTest, GpsEphemOfABroadcastHasItsAxisAndMeanMotion) {
  const GpsEphem log = to_gpsephem({.prn = 1,
                                    .week = 1687,
                                    .toe_s = 417600,
                                    .sqrt_a_sqrtm = std::sqrt(2.656005046e+07),
                                    .delta_n_radps = 4.701624413e-09,
                                    .iode = 62,
                                    .iodc = 62 + 256,
                                    .ura_index = 3},
                                   410400, 1687);
  EXPECT_NEAR(log.semi_major_axis_m, 2.656005046e+07, 1e-7);
  EXPECT_NEAR(log.corrected_mean_motion_radps, 1.458611304e-04, 0.6e-13);
  EXPECT_EQ(log.iode1, 62u);
  EXPECT_EQ(log.iode2, 62u);
  EXPECT_EQ(log.iodc, 318u);
  EXPECT_NEAR(log.ura_variance_m2, 5.7 * 5.7, 1e-12);  // index 3, IS-GPS-200 20.3.3.3.1.3
}

TEST(NovatelMessageTest, IonUtcFollowsItsTable) {
  const IonUtc message{.alpha = {1.5, 2.5, 3.5, 4.5},
                       .beta = {5.5, 6.5, 7.5, 8.5},
                       .utc_reference_week = 2358,
                       .utc_reference_s = 405504,
                       .A0_s = 9.5,
                       .A1_sps = 10.5,
                       .leap_week = 1929,
                       .leap_day = 7,
                       .leap_seconds = 18,
                       .leap_seconds_future = -19};
  EXPECT_EQ(body_of(message, 8), Layout()
                                     .at(0, 1.5)
                                     .at(8, 2.5)
                                     .at(16, 3.5)
                                     .at(24, 4.5)
                                     .at(32, 5.5)
                                     .at(40, 6.5)
                                     .at(48, 7.5)
                                     .at(56, 8.5)
                                     .at(64, 2358u)
                                     .at(68, 405504u)
                                     .at(72, 9.5)
                                     .at(80, 10.5)
                                     .at(88, 1929u)
                                     .at(92, 7u)
                                     .at(96, 18)
                                     .at(100, -19)
                                     .at(104, 0u)
                                     .bytes());
}

TEST(NovatelMessageTest, AlmanacFollowsItsTable) {
  const AlmanacEntry entry{.prn = 1,
                           .week = 2,
                           .toa_s = 1.5,
                           .eccentricity = 2.5,
                           .raan_rate_radps = 3.5,
                           .raan0_rad = 4.5,
                           .argument_of_perigee_rad = 5.5,
                           .mean_anomaly_rad = 6.5,
                           .af0_s = 7.5,
                           .af1_sps = 8.5,
                           .corrected_mean_motion_radps = 9.5,
                           .semi_major_axis_m = 10.5,
                           .delta_inclination_rad = 11.5,
                           .configuration = 3,
                           .health_6bit = 4,
                           .health_8bit = 5,
                           .anti_spoofing = 6};
  ByteBuffer frame;
  append_almanac(kHeader, {&entry, 1}, frame);
  EXPECT_EQ(body_of(frame, 73), Layout()
                                    .at(0, 1u)
                                    .at(4, 1u)
                                    .at(8, 2u)
                                    .at(12, 1.5)
                                    .at(20, 2.5)
                                    .at(28, 3.5)
                                    .at(36, 4.5)
                                    .at(44, 5.5)
                                    .at(52, 6.5)
                                    .at(60, 7.5)
                                    .at(68, 8.5)
                                    .at(76, 9.5)
                                    .at(84, 10.5)
                                    .at(92, 11.5)
                                    .at(100, 3u)
                                    .at(104, 4u)
                                    .at(108, 5u)
                                    .at(112, 6u)
                                    .bytes());
}

TEST(NovatelMessageTest, VersionPadsItsTextsAndCutsLongOnes) {
  const VersionComponent component{.model = "L12LGRV",
                                   .serial_number = "DAB06210079",
                                   .hardware = "OEMV3G-3.01-2T2",
                                   .software = "0123456789abcdefTOO LONG",
                                   .boot = "3.000",
                                   .date = "2010/Apr/29",
                                   .time = "16:11:14"};
  ByteBuffer frame;
  append_version(kHeader, {&component, 1}, frame);
  EXPECT_EQ(body_of(frame, 37), Layout()
                                    .at(0, 1u)
                                    .at(4, 1u)
                                    .text(8, "L12LGRV", 16)
                                    .text(24, "DAB06210079", 16)
                                    .text(40, "OEMV3G-3.01-2T2", 16)
                                    .text(56, "0123456789abcdef", 16)
                                    .text(72, "3.000", 16)
                                    .text(88, "2010/Apr/29", 12)
                                    .text(100, "16:11:14", 12)
                                    .bytes());
}

TEST(NovatelMessageTest, ABufferThatIsKeptIsNotAllocatedAgain) {
  const std::vector<RangeObservation> observations(12);
  ByteBuffer out;
  append_range(kHeader, observations, out);
  const std::byte* const data = out.data();
  for (int epoch = 0; epoch < 3; ++epoch) {
    out.clear();
    append_range(kHeader, observations, out);
    EXPECT_EQ(out.data(), data);
  }
}

}  // namespace
}  // namespace orrery::novatel
