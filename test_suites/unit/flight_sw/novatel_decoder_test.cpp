// The flight software's NovAtel decoder: framing of any stream, and every log the encoder can make.
#include <orrery/harness/kernel/random.hpp>

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "../models/gnss/novatel_reencode.hpp"

namespace orrery::novatel {
namespace {

constexpr SimTime kTime = from_ns((16510LL * 86400 + 10) * 1'000'000'000);
constexpr std::size_t kCapacity = 4096;

ByteBuffer bytes_of(std::string_view text) {
  const Bytes bytes = std::as_bytes(std::span(text));
  return {bytes.begin(), bytes.end()};
}

ByteBuffer operator+(ByteBuffer a, const ByteBuffer& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

ByteBuffer frame_of(std::uint16_t id, std::size_t body_bytes) {
  ByteBuffer out;
  ByteBuffer body(body_bytes, static_cast<std::byte>(id));
  append_frame({.message_id = id, .t = kTime}, body, out);
  return out;
}

// AA 44 13, length, id, week, ms, body, CRC: the manual's short header.
ByteBuffer short_frame(ByteBuffer body) {
  ByteBuffer out = bytes_of("\xAA\x44\x13");
  out.push_back(static_cast<std::byte>(body.size()));
  out = out + bytes_of(std::string_view("\xfc\x01\x36\x09\x10\x97\x99\x14", 8)) + body;
  const std::uint32_t crc = crc32(out);
  for (int i = 0; i < 4; ++i) out.push_back(static_cast<std::byte>(crc >> (8 * i) & 0xFF));
  return out;
}

std::vector<int> ids_in(const ByteBuffer& stream, std::size_t chunk = kCapacity,
                        std::size_t capacity = kCapacity) {
  std::vector<int> ids;
  for_each_frame(stream, chunk, capacity,
                 [&](const novatel_frame& frame) { ids.push_back(frame.header.message_id); });
  return ids;
}

using Ids = std::vector<int>;

TEST(NovatelFramerTest, HeaderIsReadFieldByField) {
  ByteBuffer stream;
  append_frame({.message_id = 0x1234,
                .t = kTime,
                .message_type = 0x9F,
                .port_address = 0x40,
                .sequence = 0x5678,
                .idle_time_half_percent = 131,
                .time_status = TimeStatus::kCoarse,
                .receiver_status = 0x89ABCDEF,
                .reserved = 0xD821,
                .software_build = 3153},
               bytes_of("body"), stream);
  int seen = 0;
  for_each_frame(stream, 7, kCapacity, [&](const novatel_frame& frame) {
    ++seen;
    EXPECT_EQ(frame.header.message_id, 0x1234);
    EXPECT_EQ(frame.header.message_type, 0x9F);
    EXPECT_TRUE(novatel_is_response(&frame));
    EXPECT_EQ(frame.header.port_address, 0x40);
    EXPECT_EQ(frame.header.body_bytes, 4);
    EXPECT_EQ(frame.header.sequence, 0x5678);
    EXPECT_EQ(frame.header.idle_time_half_percent, 131);
    EXPECT_EQ(frame.header.time_status, 100);
    EXPECT_EQ(frame.header.week, 2358);
    EXPECT_EQ(frame.header.ms, 345610000u);
    EXPECT_EQ(frame.header.receiver_status, 0x89ABCDEFu);
    EXPECT_EQ(frame.header.reserved, 0xD821);
    EXPECT_EQ(frame.header.software_build, 3153);
    EXPECT_EQ(novatel_time_ns(&frame), to_ns(kTime));
    EXPECT_EQ(std::memcmp(frame.body, "body", 4), 0);
  });
  EXPECT_EQ(seen, 1);
}

TEST(NovatelFramerTest, CutsOfTheStreamMeanNothing) {
  const ByteBuffer stream = frame_of(43, 532) + frame_of(1, 0) + frame_of(241, 112);
  for (std::size_t chunk = 1; chunk < 200; ++chunk) {
    ASSERT_EQ(ids_in(stream, chunk), (Ids{43, 1, 241})) << chunk;
  }
}

TEST(NovatelFramerTest, TextBetweenFramesIsPassedOver) {
  const ByteBuffer stream = bytes_of("[COM1]<OK\r\n") + frame_of(43, 48) +
                            bytes_of("$GPGGA,123519,4807.038,N,01131.000,E,1,08,0.9*47\r\n") +
                            frame_of(241, 112) + bytes_of("#BESTPOSA,COM1,0;\xAA\x44") +
                            frame_of(42, 72);
  EXPECT_EQ(ids_in(stream), (Ids{43, 241, 42}));
}

// A frame inside a short-header log's body is not a log: the body is passed over whole.
TEST(NovatelFramerTest, ShortHeaderLogsAreCheckedAndPassedOver) {
  const ByteBuffer stream =
      short_frame(frame_of(99, 8)) + frame_of(43, 48) + short_frame({}) + frame_of(42, 72);
  std::vector<int> ids;
  const novatel_framer framer =
      for_each_frame(stream, 5, kCapacity,
                     [&](const novatel_frame& frame) { ids.push_back(frame.header.message_id); });
  EXPECT_EQ(ids, (Ids{43, 42}));
  EXPECT_EQ(framer.short_frames, 2u);
  EXPECT_EQ(framer.frames, 2u);
  EXPECT_EQ(framer.passed_over, 0u);
}

TEST(NovatelFramerTest, ADamagedShortHeaderLogDoesNotHideTheNext) {
  ByteBuffer damaged = short_frame(bytes_of("body"));
  damaged[14] ^= std::byte{1};
  damaged[3] = std::byte{255};  // now it claims to reach over the frame behind it
  EXPECT_EQ(ids_in(damaged + frame_of(43, 48) + frame_of(42, 300)), (Ids{43, 42}));
}

TEST(NovatelFramerTest, EveryDamagedBitCostsItsOwnFrameOnly) {
  const ByteBuffer sound = frame_of(43, 48);
  const ByteBuffer behind = frame_of(42, 72) + ByteBuffer(kCapacity, std::byte{0});
  for (std::size_t bit = 0; bit < 8 * sound.size(); ++bit) {
    ByteBuffer damaged = sound;
    damaged[bit / 8] ^= static_cast<std::byte>(1u << (bit % 8));
    ASSERT_EQ(ids_in(damaged + behind), Ids{42}) << "bit " << bit;
  }
}

TEST(NovatelFramerTest, FalseStartsInsideAFrameAreNotBelieved) {
  ByteBuffer body = bytes_of(std::string_view("\xAA\x44\x12\x1C\x07\x00\x00\x20\x00\x00", 10));
  body.resize(60);
  ByteBuffer outer;
  append_frame({.message_id = 43, .t = kTime}, body, outer);
  EXPECT_EQ(ids_in(outer + frame_of(42, 72)), (Ids{43, 42}));
  outer[5] ^= std::byte{1};  // damaged: the search goes through its body, and finds nothing there
  EXPECT_EQ(ids_in(outer + frame_of(42, 72) + ByteBuffer(100)), Ids{42});
}

TEST(NovatelFramerTest, AFrameOfExactlyTheRoomFitsAndALongerOneIsPassedOver) {
  const ByteBuffer stream = frame_of(43, 112) + frame_of(44, 113) + frame_of(42, 72);
  EXPECT_EQ(ids_in(stream, 1, 144), (Ids{43, 42}));
}

TEST(NovatelFramerTest, TooSmallARoomTakesEverythingAndFindsNothing) {
  unsigned char room[31];
  novatel_framer framer;
  EXPECT_EQ(novatel_framer_init(&framer, room, sizeof room), 0);
  const ByteBuffer stream = frame_of(1, 0);
  EXPECT_EQ(ids_in(stream, 10, 31), Ids{});
  EXPECT_EQ(ids_in(stream, 10, 32), Ids{1});
}

TEST(NovatelFramerTest, CountersSayWhatWasLost) {
  ByteBuffer damaged = frame_of(43, 48);
  damaged[40] ^= std::byte{1};
  const novatel_framer framer = for_each_frame(bytes_of("noise") + damaged + frame_of(42, 72), 9,
                                               kCapacity, [](const novatel_frame&) {});
  EXPECT_EQ(framer.frames, 1u);
  EXPECT_EQ(framer.bad_frames, 1u);
  EXPECT_EQ(framer.passed_over, 5u + 28 + 48 + 4);
}

// What the framer is to find, by searching the whole stream at once.
Ids naive(const ByteBuffer& stream, std::size_t capacity) {
  Ids ids;
  const auto u = [&](std::size_t at) { return std::to_integer<std::size_t>(stream[at]); };
  for (std::size_t at = 0; at + 10 <= stream.size();) {
    const bool sync = u(at) == 0xAA && u(at + 1) == 0x44;
    const bool full = sync && u(at + 2) == 0x12 && u(at + 3) == 28 && (u(at + 6) & 0x60) == 0;
    const bool brief = sync && u(at + 2) == 0x13;
    const std::size_t total = full ? 32 + u(at + 8) + 256 * u(at + 9) : 16 + u(at + 3);
    const bool candidate = (full || brief) && total <= capacity;
    if (candidate && at + total > stream.size()) break;
    if (candidate && crc32(Bytes(stream).subspan(at, total)) == 0) {
      if (full) ids.push_back(static_cast<int>(u(at + 4) + 256 * u(at + 5)));
      at += total;
    } else {
      ++at;
    }
  }
  return ids;
}

class NovatelFramerModelTest : public testing::TestWithParam<std::uint64_t> {};

ByteBuffer random_piece(RandomStream& random) {
  const auto size = static_cast<std::size_t>(random.integer(0, 150));
  const std::int64_t kind = random.integer(0, 9);
  if (kind < 4) return frame_of(static_cast<std::uint16_t>(random.integer(0, 300)), size);
  if (kind == 4) return short_frame(ByteBuffer(size, std::byte{0xAA}));
  if (kind == 5) return bytes_of(std::string_view("\xAA\x44\x12\x1C\x01\0\0\x20\x30\0", 10));
  if (kind == 6) return bytes_of("\xAA\x44\x13");
  ByteBuffer damaged = frame_of(7, size);
  const std::int64_t last = static_cast<std::int64_t>(damaged.size()) - 1;
  const auto at = static_cast<std::size_t>(random.integer(0, last));
  if (kind < 9) {
    damaged[at] ^= static_cast<std::byte>(random.integer(1, 255));
  } else {
    damaged.resize(at);
  }
  return damaged;
}

TEST_P(NovatelFramerModelTest, FindsWhatASearchOfTheWholeStreamFinds) {
  RandomStream random(GetParam());
  ByteBuffer stream;
  for (int piece = 0; piece < 60; ++piece) stream = stream + random_piece(random);
  for (const std::size_t capacity : {32u, 144u, 4096u}) {
    const Ids expected = naive(stream, capacity);
    for (const std::size_t chunk : {1u, 13u, 144u, 5000u}) {
      ASSERT_EQ(ids_in(stream, chunk, capacity), expected) << capacity << " " << chunk;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Seeds, NovatelFramerModelTest, testing::Range<std::uint64_t>(1, 21));

// One of each log, no two values alike.
ByteBuffer one_of_each() {
  ByteBuffer out;
  const Header h{.t = kTime};
  const RangeObservation observations[] = {
      {.prn = 31,
       .glonass_frequency = 9,
       .pseudorange_m = 20123456.125,
       .pseudorange_sigma_m = 0.113f,
       .carrier_phase_cycles = -4194304.25,
       .carrier_phase_sigma_cycles = 3.0f / 512,
       .doppler_Hz = -3456.75f,
       .cn0_dBHz = 43,
       .lock_time_s = 1234.5f,
       .tracking_status = to_word({.channel = 5, .parity_known = false})},
      {.prn = 2, .pseudorange_m = 21e6, .pseudorange_sigma_m = 152, .cn0_dBHz = 51}};
  RangeObservation compressed[] = {observations[0], observations[1]};
  compressed[1].carrier_phase_sigma_cycles = 16.0f / 512;
  append_range(h, observations, out);
  append_rangecmp(h, compressed, out);
  append(h,
         BestXyz{.r_ECEF = {1, -2, 3},
                 .sigma_r_ECEF = {4, 5, 6},
                 .v_ECEF = {-7, 8, 9},
                 .sigma_v_ECEF = {10, 11, 12},
                 .station_id = {'A', 'B', 'C', 'D'},
                 .velocity_latency_s = 13,
                 .differential_age_s = 14,
                 .solution_age_s = 15,
                 .satellites_tracked = 16,
                 .satellites_used = 17,
                 .satellites_used_L1 = 18,
                 .satellites_used_multi_frequency = 19,
                 .extended_solution_status = 20,
                 .galileo_beidou_mask = 21,
                 .gps_glonass_mask = 22},
         out);
  append(h,
         BestPos{.latitude_deg = 1,
                 .longitude_deg = 2,
                 .height_msl_m = 3,
                 .undulation_m = 4,
                 .sigma_latitude_m = 5,
                 .sigma_longitude_m = 6,
                 .sigma_height_m = 7,
                 .station_id = {'E', 'F', 'G', 'H'},
                 .differential_age_s = 8,
                 .solution_age_s = 9,
                 .satellites_tracked = 10,
                 .satellites_used = 11,
                 .satellites_used_L1 = 12,
                 .satellites_used_multi_frequency = 13,
                 .reserved = 14,
                 .extended_solution_status = 15,
                 .galileo_beidou_mask = 16,
                 .gps_glonass_mask = 17},
         out);
  append(h,
         Time{.clock_status = 1,
              .offset_s = 2,
              .offset_sigma_s = 3,
              .utc_offset_s = -18,
              .year = 2025,
              .month = 4,
              .day = 5,
              .hour = 6,
              .minute = 7,
              .millisecond = 8,
              .utc_status = 9},
         out);
  RawEphem raw{.prn = 1, .reference_week = 2, .reference_s = 3};
  for (std::size_t k = 0; k < 3; ++k) raw.subframes[k].fill(static_cast<std::byte>(k + 4));
  append(h, raw, out);
  GpsEphem ephemeris{.prn = 1,
                     .tow_s = 2,
                     .health = 3,
                     .iode1 = 4,
                     .iode2 = 5,
                     .week = 6,
                     .z_week = 7,
                     .toe_s = 8,
                     .semi_major_axis_m = 9,
                     .delta_n_radps = 10,
                     .mean_anomaly_rad = 11,
                     .eccentricity = 12,
                     .argument_of_perigee_rad = 13,
                     .cuc_rad = 14,
                     .cus_rad = 15,
                     .crc_m = 16,
                     .crs_m = 17,
                     .cic_rad = 18,
                     .cis_rad = 19,
                     .i0_rad = 20,
                     .i_rate_radps = 21,
                     .raan0_rad = 22,
                     .raan_rate_radps = 23,
                     .iodc = 24,
                     .toc_s = 25,
                     .tgd_s = 26,
                     .af0_s = 27,
                     .af1_sps = 28,
                     .af2_sps2 = 29,
                     .anti_spoofing = 30,
                     .corrected_mean_motion_radps = 31,
                     .ura_variance_m2 = 32};
  append(h, ephemeris, out);
  append(h,
         IonUtc{.alpha = {1, 2, 3, 4},
                .beta = {5, 6, 7, 8},
                .utc_reference_week = 9,
                .utc_reference_s = 10,
                .A0_s = 11,
                .A1_sps = 12,
                .leap_week = 13,
                .leap_day = 14,
                .leap_seconds = 15,
                .leap_seconds_future = -16,
                .reserved = 17},
         out);
  const AlmanacEntry entries[] = {{.prn = 1,
                                   .week = 2,
                                   .toa_s = 3,
                                   .eccentricity = 4,
                                   .raan_rate_radps = 5,
                                   .raan0_rad = 6,
                                   .argument_of_perigee_rad = 7,
                                   .mean_anomaly_rad = 8,
                                   .af0_s = 9,
                                   .af1_sps = 10,
                                   .corrected_mean_motion_radps = 11,
                                   .semi_major_axis_m = 12,
                                   .delta_inclination_rad = 13,
                                   .configuration = 14,
                                   .health_6bit = 15,
                                   .health_8bit = 16,
                                   .anti_spoofing = 17},
                                  {.prn = 2}};
  append_almanac(h, entries, out);
  const VersionComponent component{.type = 1,
                                   .model = "model",
                                   .serial_number = "serial",
                                   .hardware = "hardware",
                                   .software = "software of 16 ch",
                                   .boot = "boot",
                                   .date = "2010/Apr/29",
                                   .time = "16:11:14"};
  append_version(h, {&component, 1}, out);
  return out;
}

// The encoder's layouts are checked against the tables (novatel_messages_test.cpp). Bytes that come
// back equal through structs whose fields have names prove the decoder's.
TEST(NovatelDecoderTest, EveryLogComesBackByteByByte) {
  const ByteBuffer stream = one_of_each();
  ByteBuffer again;
  for_each_frame(stream, 100, kCapacity, [&](const novatel_frame& frame) {
    EXPECT_TRUE(reencode(frame, again)) << frame.header.message_id;
  });
  EXPECT_EQ(again, stream);
}

TEST(NovatelDecoderTest, ABodyThatIsTooShortIsNotRead) {
  ByteBuffer scratch;
  int known = 0;
  for_each_frame(one_of_each(), 100, kCapacity, [&](novatel_frame frame) {
    const std::uint32_t entries = novatel_count(&frame);
    --frame.header.body_bytes;
    if (entries > 0) {
      EXPECT_EQ(novatel_count(&frame), entries - 1) << frame.header.message_id;
    } else {
      EXPECT_FALSE(reencode(frame, scratch)) << frame.header.message_id;
    }
    ++known;
  });
  EXPECT_EQ(known, 10);
}

TEST(NovatelDecoderTest, ACountBeyondTheBodyIsCutToWhatIsThere) {
  ByteBuffer body(4 + 44 + 43);
  std::fill_n(body.begin(), 4, std::byte{0xFF});
  ByteBuffer stream;
  append_frame({.message_id = kRangeId, .t = kTime}, body, stream);
  for_each_frame(stream, 100, kCapacity, [&](const novatel_frame& frame) {
    novatel_observation observation;
    EXPECT_EQ(novatel_count(&frame), 1u);
    EXPECT_TRUE(novatel_get_range(&frame, 0, &observation));
    EXPECT_FALSE(novatel_get_range(&frame, 1, &observation));
    EXPECT_FALSE(novatel_get_rangecmp(&frame, 0, &observation));
  });
}

TEST(NovatelDecoderTest, AResponseIsNoLog) {
  ByteBuffer stream;
  append({.t = kTime, .message_type = 0x80}, BestXyz{}, stream);
  append_range({.t = kTime, .message_type = 0x80}, std::vector<RangeObservation>(1), stream);
  ByteBuffer scratch;
  for_each_frame(stream, 100, kCapacity, [&](const novatel_frame& frame) {
    EXPECT_FALSE(reencode(frame, scratch));
    EXPECT_EQ(novatel_count(&frame), 0u);
  });
}

TEST(NovatelDecoderTest, UnknownTimeIsZero) {
  const auto time_of = [](const Header& header) {
    ByteBuffer stream;
    append_frame(header, {}, stream);
    std::int64_t ns = -1;
    for_each_frame(stream, 100, kCapacity,
                   [&](const novatel_frame& frame) { ns = novatel_time_ns(&frame); });
    return ns;
  };
  EXPECT_EQ(time_of({.t = kTime, .time_status = TimeStatus::kUnknown}), 0);
  EXPECT_EQ(time_of({.t = from_ns(5'000'000'000)}), 0);  // week 0
  EXPECT_EQ(time_of({.t = kTime + 1ms}), to_ns(kTime + 1ms));
}

// Half a step of the code is 0.02 cycles, far from the half roll-over that would be one too many.
TEST(NovatelDecoderTest, RestoredPhaseOfRangeCmpIsTheSentOne) {
  constexpr double kWavelength_m = 299792458.0 / 1575.42e6;
  for (const double range_m : {0.0, 19e6, 22.5e6, 26.9e6}) {
    for (const double ambiguity : {-4e6, -5.0, 0.0, 5.0, 4e6}) {
      const RangeObservation sent{.pseudorange_m = range_m,
                                  .carrier_phase_cycles = range_m / kWavelength_m + ambiguity};
      ByteBuffer stream;
      append_rangecmp({.t = kTime}, {&sent, 1}, stream);
      for_each_frame(stream, 100, kCapacity, [&](const novatel_frame& frame) {
        novatel_observation got;
        ASSERT_TRUE(novatel_get_rangecmp(&frame, 0, &got));
        EXPECT_NEAR(novatel_restored_phase_cycles(&got, kWavelength_m), sent.carrier_phase_cycles,
                    0.5 / 256 + 1e-6);
        EXPECT_NEAR(got.pseudorange_m, range_m, 0.5 / 128);
      });
    }
  }
}

TEST(NovatelDecoderTest, TrackingStatusMacrosNameTheEncodersBits) {
  const std::uint32_t word = to_word({.signal = GpsSignal::kL2CM});
  EXPECT_EQ(NOVATEL_SIGNAL(word), 17u);
  EXPECT_EQ(NOVATEL_SYSTEM(word), 0u);
  EXPECT_EQ(word & ~to_word({.phase_locked = false, .signal = GpsSignal::kL2CM}),
            NOVATEL_PHASE_LOCKED);
  EXPECT_EQ(word & ~to_word({.parity_known = false, .signal = GpsSignal::kL2CM}),
            NOVATEL_PARITY_KNOWN);
  EXPECT_EQ(word & ~to_word({.code_locked = false, .signal = GpsSignal::kL2CM}),
            NOVATEL_CODE_LOCKED);
}

}  // namespace
}  // namespace orrery::novatel
