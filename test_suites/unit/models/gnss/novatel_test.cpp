#include <orrery/models/gnss/novatel.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <cstring>
#include <string>

namespace orrery::novatel {
namespace {

Bytes bytes_of(std::string_view text) {
  return std::as_bytes(std::span(text.data(), text.size()));
}

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

// The polynomial division itself, bit by bit: the definition that the table abbreviates.
std::uint32_t crc32_by_division(Bytes bytes) {
  std::uint32_t remainder = 0;
  for (const std::byte b : bytes) {
    remainder ^= std::to_integer<std::uint32_t>(b);
    for (int bit = 0; bit < 8; ++bit) {
      remainder = (remainder & 1u) != 0 ? (remainder >> 1) ^ 0xEDB88320u : remainder >> 1;
    }
  }
  return remainder;
}

// Reads a little-endian field at an offset, as the layout tables give it.
template <class T>
T field(Bytes bytes, std::size_t offset) {
  T value;
  static_assert(std::endian::native == std::endian::little);
  std::memcpy(&value, bytes.data() + offset, sizeof value);
  return value;
}

// CRC-32 catalogue, https://reveng.sourceforge.io/crc-catalogue: the check word of this polynomial
// with initial value 0 and no inversion; the widespread variants give 0xCBF43926 and 0x340BC6D9.
TEST(NovatelCrcTest, CheckWordIsThatOfTheUninvertedVariant) {
  EXPECT_EQ(crc32(bytes_of("123456789")), 0x2DFD2D88u);
  EXPECT_EQ(crc32({}), 0u);
}

TEST(NovatelCrcTest, TableAgreesWithPolynomialDivisionAtEveryByte) {
  ByteBuffer bytes;
  for (int i = 0; i < 256; ++i) {
    bytes.push_back(static_cast<std::byte>((167 * i + 13) & 0xFF));
    ASSERT_EQ(crc32(bytes), crc32_by_division(bytes)) << i;
  }
}

TEST(NovatelCrcTest, ContinuesWhereAnEarlierCallStopped) {
  EXPECT_EQ(crc32(bytes_of("6789"), crc32(bytes_of("12345"))), 0x2DFD2D88u);
  // Long enough for both parts to go the way of whole blocks.
  ByteBuffer bytes;
  for (int i = 0; i < 700; ++i) bytes.push_back(static_cast<std::byte>((167 * i + i / 9) & 0xFF));
  const std::uint32_t whole = crc32_by_division(bytes);
  for (const std::size_t cut : {1u, 63u, 64u, 81u, 300u, 636u, 699u}) {
    const Bytes all(bytes);
    EXPECT_EQ(crc32(all.subspan(cut), crc32(all.first(cut))), whole) << cut;
  }
}

// A frame written down from the layout tables of the manual: each group is one field. Values were
// chosen so that their IEEE-754 words can be written by hand: 1.5 = 1.1b x 2^0 and so on.
TEST(NovatelFrameTest, BestXyzMatchesTheFrameWrittenByHand) {
  // 2025-03-20 00:00:10 GPS: 16510 days after 1980-01-06 are 2358 weeks and 4 days;
  // 4 x 86400 s + 10 s = 345610000 ms = 0x14999710.
  const SimTime t = from_ns((16510LL * 86400 + 10) * 1'000'000'000);
  const BestXyz message{.r_ECEF = {1.5, -2.0, 0.0},
                        .sigma_r_ECEF = {1.5, 1.5, 1.5},
                        .v_ECEF = {-0.5, 1024.0, 3.0},
                        .sigma_v_ECEF = {0.25, 0.25, 0.25},
                        .station_id = {'A', 'B', '1', '\0'},
                        .velocity_latency_s = 0.5f,
                        .differential_age_s = 2.0f,
                        .solution_age_s = 1.0f,
                        .satellites_tracked = 12,
                        .satellites_used = 11,
                        .satellites_used_L1 = 10,
                        .satellites_used_multi_frequency = 9,
                        .extended_solution_status = 0x06,
                        .galileo_beidou_mask = 0x11,
                        .gps_glonass_mask = 0x01};
  ByteBuffer frame;
  append({.t = t}, message, frame);

  ByteBuffer expected = from_hex(
      "aa4412 1c f100 00 20 7000 0000 64 b4 3609 10979914 00000000 0000 803e "  // header
      "00000000 10000000 "                                   // SOL_COMPUTED, SINGLE
      "000000000000f83f 00000000000000c0 0000000000000000 "  // position
      "0000c03f 0000c03f 0000c03f "                          // its sigma
      "00000000 08000000 "                                   // SOL_COMPUTED, DOPPLER_VELOCITY
      "000000000000e0bf 0000000000009040 0000000000000840 "  // velocity
      "0000803e 0000803e 0000803e "                          // its sigma
      "41423100 0000003f 00000040 0000803f "                 // station, latency, ages
      "0c 0b 0a 09 00 06 11 01");
  ASSERT_EQ(expected.size(), kHeaderBytes + kBestXyzBytes);
  const std::uint32_t crc = crc32_by_division(expected);
  for (int i = 0; i < 4; ++i) expected.push_back(static_cast<std::byte>(crc >> (8 * i) & 0xFF));

  EXPECT_EQ(frame, expected);
}

TEST(NovatelFrameTest, CrcOverAWholeFrameIsZero) {
  ByteBuffer frame;
  append_frame({.message_id = 43, .t = from_ns(0)}, bytes_of("any body"), frame);
  EXPECT_EQ(crc32(frame), 0u);
}

TEST(NovatelFrameTest, FramesFollowOneAnotherInOneBuffer) {
  ByteBuffer stream;
  append_frame({.message_id = 1, .t = from_ns(0)}, bytes_of("one"), stream);
  const ByteBuffer first = stream;
  append_frame({.message_id = 2, .t = from_ns(0)}, {}, stream);
  ASSERT_EQ(stream.size(), first.size() + kHeaderBytes + kCrcBytes);
  EXPECT_TRUE(std::equal(first.begin(), first.end(), stream.begin()));
  EXPECT_EQ(field<std::uint16_t>(Bytes(stream).subspan(first.size()), 4), 2);
}

TEST(NovatelFrameTest, WeekTurnsOverAfterItsLastMillisecond) {
  constexpr std::int64_t kWeekNs = 604'800'000'000'000;
  const auto week_and_ms = [](std::int64_t ns) {
    ByteBuffer frame;
    append_frame({.message_id = 1, .t = from_ns(ns)}, {}, frame);
    return std::pair(field<std::uint16_t>(frame, 14), field<std::uint32_t>(frame, 16));
  };
  EXPECT_EQ(week_and_ms(1024 * kWeekNs - 1), std::pair(std::uint16_t{1023}, 604'799'999u));
  EXPECT_EQ(week_and_ms(1024 * kWeekNs), std::pair(std::uint16_t{1024}, 0u));  // not modulo 1024
}

TEST(NovatelFrameTest, TimeBeforeTheGpsEpochIsRefused) {
  ByteBuffer frame;
  EXPECT_THAT([&] { append_frame({.message_id = 1, .t = from_ns(-1)}, {}, frame); },
              testing::ThrowsMessage<std::invalid_argument>(testing::HasSubstr("-1 ns")));
  EXPECT_TRUE(frame.empty());
}

TEST(NovatelFrameTest, BodyBeyondTheLengthFieldIsRefused) {
  ByteBuffer frame;
  const ByteBuffer body(65536);
  EXPECT_THAT([&] { append_frame({.message_id = 1, .t = from_ns(0)}, body, frame); },
              testing::ThrowsMessage<std::invalid_argument>(testing::HasSubstr("65536 bytes")));
}

}  // namespace
}  // namespace orrery::novatel
