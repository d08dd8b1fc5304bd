#include "support/gnss_fix.hpp"

#include <gtest/gtest.h>

#include "flight_test_support.hpp"

namespace flight_support {
namespace {

using Bytes = std::vector<unsigned char>;

GnssFix some_fix() {
  GnssFix fix;
  fix.epoch_ns = flight_test::kEpoch_ns + 250 * 1000000LL;
  fix.r_ECEF = flight_support::vec3(4.0e6, -3.2e6, 4.6e6);
  fix.v_ECEF = flight_support::vec3(-1234.5, 5678.25, 4321.125);
  fix.sigma_r_m = 1.5;
  fix.sigma_v_mps = 0.03125;
  return fix;
}

struct Heard {
  int fixes = 0, bad = 0, no_fix = 0;
  GnssFix last;
};

// Byte by byte, as the slowest of serial lines.
Heard parse(const Bytes& stream) {
  unsigned char room[kGnssRoomBytes];
  novatel_framer framer;
  novatel_framer_init(&framer, room, sizeof room);
  Heard heard;
  for (const unsigned char byte : stream) {
    EXPECT_EQ(novatel_framer_write(&framer, &byte, 1), 1u);
    novatel_frame frame;
    while (novatel_framer_next(&framer, &frame) != 0) {
      if (read_fix(frame, &heard.last)) {
        ++heard.fixes;
      } else {
        ++heard.no_fix;
      }
    }
  }
  heard.bad = static_cast<int>(framer.bad_frames);
  return heard;
}

Bytes operator+(Bytes a, const Bytes& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

TEST(GnssFixTest, AnOldSolutionUnderANewTimeIsARepetition) {
  GnssFix later = some_fix();
  EXPECT_FALSE(repeats(some_fix(), later)) << "the very same";
  later.epoch_ns += 1000000000LL;
  EXPECT_TRUE(repeats(some_fix(), later));
  later.v_ECEF[2] += 0.001;
  EXPECT_FALSE(repeats(some_fix(), later));
}

TEST(GnssFixTest, ReadsEveryField) {
  const Heard heard = parse(flight_test::bestxyz_frame(some_fix()));
  ASSERT_EQ(heard.fixes, 1);
  EXPECT_EQ(heard.last.epoch_ns, some_fix().epoch_ns);
  for (int k = 0; k < 3; ++k) {
    EXPECT_EQ(heard.last.r_ECEF[k], some_fix().r_ECEF[k]);
    EXPECT_EQ(heard.last.v_ECEF[k], some_fix().v_ECEF[k]);
  }
  EXPECT_DOUBLE_EQ(heard.last.sigma_r_m, 1.5);
  EXPECT_DOUBLE_EQ(heard.last.sigma_v_mps, 0.03125);
}

// The framer holds no more than a frame, so a stream that starts at any byte of one is found again
// at the next.
TEST(GnssFixTest, FindsTheNextFrameWhereverTheStreamBegins) {
  const Bytes frame = flight_test::bestxyz_frame(some_fix());
  for (std::size_t cut = 1; cut <= frame.size(); ++cut) {
    const Bytes tail(frame.begin() + static_cast<std::ptrdiff_t>(cut), frame.end());
    EXPECT_EQ(parse(tail + frame).fixes, 1) << "first byte " << cut;
  }
}

TEST(GnssFixTest, FindsTheNextFrameWhereverTheFirstBreaksOff) {
  const Bytes frame = flight_test::bestxyz_frame(some_fix());
  for (std::size_t cut = 1; cut < frame.size(); ++cut) {
    const Bytes head(frame.begin(), frame.begin() + static_cast<std::ptrdiff_t>(cut));
    EXPECT_EQ(parse(head + frame).fixes, 1) << "last byte " << cut;
  }
}

// CRC-32 detects every single-bit error; a flip in the sync or the header means no frame at all.
TEST(GnssFixTest, NoFlippedBitPasses) {
  const Bytes frame = flight_test::bestxyz_frame(some_fix());
  for (std::size_t bit = 0; bit < 8 * frame.size(); ++bit) {
    Bytes flipped = frame;
    flipped[bit / 8] = static_cast<unsigned char>(flipped[bit / 8] ^ (1u << (bit % 8)));
    const Heard heard = parse(flipped + frame);
    EXPECT_EQ(heard.fixes, 1) << "bit " << bit;
  }
}

TEST(GnssFixTest, GarbageHidesNoFrame) {
  flight_test::Noise noise(7);
  Bytes stream;
  for (int k = 0; k < 200; ++k) {
    const int junk = static_cast<int>(noise.uniform() * 300);
    for (int j = 0; j < junk; ++j) {
      const double draw = noise.uniform();
      // Rich in sync bytes, so that false starts are common.
      stream.push_back(draw < 0.2   ? 0xAA
                       : draw < 0.4 ? 0x44
                       : draw < 0.6 ? 0x12
                                    : static_cast<unsigned char>(256 * draw));
    }
    stream = stream + flight_test::bestxyz_frame(some_fix());
  }
  EXPECT_EQ(parse(stream).fixes, 200);
}

// A header that announces 65,535 bytes must not swallow the log behind it.
TEST(GnssFixTest, AHugeLengthIsNotWaitedFor) {
  Bytes huge = flight_test::bestxyz_frame(some_fix());
  flight_test::put_u16(&huge, 8, 65535);
  EXPECT_EQ(parse(huge + flight_test::bestxyz_frame(some_fix())).fixes, 1);
}

TEST(GnssFixTest, OtherLogsArePassedOver) {
  Bytes other(28 + 44 + 4, 0x55);
  other[0] = 0xAA, other[1] = 0x44, other[2] = 0x12, other[3] = 28;
  flight_test::put_u16(&other, 4, 101);  // TIME
  flight_test::put_u16(&other, 8, 44);
  flight_test::seal(&other);
  const Heard heard = parse(other + flight_test::bestxyz_frame(some_fix()) + other);
  EXPECT_EQ(heard.fixes, 1);
  EXPECT_EQ(heard.bad, 0);
}

TEST(GnssFixTest, ASoundFrameWithoutASolutionIsNoFix) {
  const auto with = [](std::size_t at, unsigned char value) {
    Bytes frame = flight_test::bestxyz_frame(some_fix());
    frame[at] = value;
    flight_test::seal(&frame);
    return frame;
  };
  EXPECT_EQ(parse(with(28, 1)).no_fix, 1);          // INSUFFICIENT_OBS
  EXPECT_EQ(parse(with(28 + 4, 0)).no_fix, 1);      // position type NONE
  EXPECT_EQ(parse(with(28 + 44, 6)).no_fix, 1);     // velocity: COLD_START
  EXPECT_EQ(parse(with(13, 20)).no_fix, 1);         // time UNKNOWN
  EXPECT_EQ(parse(with(28 + 15, 0x7F)).no_fix, 1);  // x is a huge number
}

TEST(GnssFixTest, WhatIsNoSpacecraftIsNoFix) {
  GnssFix below = some_fix();
  below.r_ECEF = 0.5 * below.r_ECEF;
  GnssFix not_a_number = some_fix();
  not_a_number.v_ECEF[1] = NAN;
  GnssFix certain = some_fix();
  certain.sigma_r_m = 0.0;
  for (const GnssFix& fix : {below, not_a_number, certain}) {
    EXPECT_EQ(parse(flight_test::bestxyz_frame(fix)).no_fix, 1);
  }
}

}  // namespace
}  // namespace flight_support
