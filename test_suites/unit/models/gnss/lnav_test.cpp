#include <orrery/models/gnss/lnav.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

#include "broadcast_sample.hpp"

namespace orrery::lnav {
namespace {

// A field as a string of '0' and '1' by repeated division, two's complement by adding 2^bits.
std::string field(long long value, int bits) {
  if (value < 0) value += 1LL << bits;
  std::string text;
  for (int i = 0; i < bits; ++i, value /= 2) text.insert(text.begin(), value % 2 != 0 ? '1' : '0');
  EXPECT_EQ(value, 0) << "the test's own value does not fit";
  return text;
}

std::string bits_of(const Subframe& subframe) {
  std::string text;
  for (const std::byte b : subframe) text += field(std::to_integer<long long>(b), 8);
  return text;
}

// Fields of the message as whole numbers, chosen with their signs mixed.
constexpr RawBroadcast kRaw;
constexpr int kTow = 338430;

std::string words_1_and_2(int id) {
  return field(0x8B, 8) + field(0, 16) + field(kTow / 6 + id, 17) + "01" + field(id, 3) + "00";
}

// Figure 20-1 of IS-GPS-200, field after field.
TEST(LnavTest, SubframesAreThoseOfABitByBitPacker) {
  const Subframes subframes = pack(to_ephemeris(kRaw), kTow);
  const RawBroadcast& r = kRaw;
  EXPECT_EQ(bits_of(subframes[0]),
            words_1_and_2(1) + field(r.week % 1024, 10) + field(1, 2) + field(r.ura, 4) +
                field(r.health, 6) + field(r.iodc / 256, 2) + field(0, 1) + field(0, 23) +
                field(0, 24) + field(0, 24) + field(0, 16) + field(r.tgd, 8) +
                field(r.iodc % 256, 8) + field(r.toc, 16) + field(r.af2, 8) + field(r.af1, 16) +
                field(r.af0, 22) + "00");
  EXPECT_EQ(bits_of(subframes[1]), words_1_and_2(2) + field(r.iodc % 256, 8) + field(r.crs, 16) +
                                       field(r.delta_n, 16) + field(r.m0, 32) + field(r.cuc, 16) +
                                       field(r.e, 32) + field(r.cus, 16) + field(r.sqrt_a, 32) +
                                       field(r.toe, 16) + "0" + field(31, 5) + "00");
  EXPECT_EQ(bits_of(subframes[2]), words_1_and_2(3) + field(r.cic, 16) + field(r.raan0, 32) +
                                       field(r.cis, 16) + field(r.i0, 32) + field(r.crc, 16) +
                                       field(r.perigee, 32) + field(r.raan_rate, 24) +
                                       field(r.iodc % 256, 8) + field(r.i_rate, 14) + "00");
}

// What RTKLIB 2.4.3 asks of RAWEPHEM: preamble, ids 1, 2, 3, and issues that agree.
TEST(LnavTest, PreambleIdsAndIssuesAreWhatRtklibAsksFor) {
  const Subframes subframes = pack(to_ephemeris(kRaw), kTow);
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_EQ(subframes[k][0], std::byte{0x8B});
    EXPECT_EQ(bits_of(subframes[k]).substr(43, 3), field(static_cast<long long>(k) + 1, 3));
  }
  const std::string low_iodc = bits_of(subframes[0]).substr(168, 8);
  EXPECT_EQ(bits_of(subframes[1]).substr(48, 8), low_iodc);
  EXPECT_EQ(bits_of(subframes[2]).substr(216, 8), low_iodc);
}

TEST(LnavTest, WhatWasPackedIsUnpackedToTheBit) {
  const BroadcastEphemeris sent = to_ephemeris(kRaw);
  EXPECT_EQ(unpack(pack(sent, kTow), sent.prn, sent.week), sent);
  EXPECT_EQ(quantised(sent), sent);
}

TEST(LnavTest, FlagsAndCodesSurvive) {
  BroadcastEphemeris sent = to_ephemeris(kRaw);
  sent.l2_codes = 2;
  sent.l2p_data_off = true;
  sent.fit_interval_above_4h = true;
  sent.aodo = 3;
  EXPECT_EQ(quantised(sent), sent);
}

// Half a step of each field, Tables 20-I and 20-III; the angles come back within +-pi.
TEST(LnavTest, QuantisationMovesAValueByHalfAStepAtMost) {
  BroadcastEphemeris sent = to_ephemeris(kRaw);
  sent.sqrt_a_sqrtm += 0.4 * std::ldexp(1, -19);
  sent.mean_anomaly_rad += 0.4 * std::ldexp(kGpsPi, -31);
  sent.af0_s -= 0.4 * std::ldexp(1, -31);
  EXPECT_EQ(quantised(sent), to_ephemeris(kRaw));
  sent.sqrt_a_sqrtm += 0.2 * std::ldexp(1, -19);
  EXPECT_NEAR(quantised(sent).sqrt_a_sqrtm - to_ephemeris(kRaw).sqrt_a_sqrtm, std::ldexp(1, -19),
              1e-12);
}

TEST(LnavTest, AnglesAreTakenModuloATurn) {
  BroadcastEphemeris sent = to_ephemeris(kRaw);
  sent.raan0_rad += 2 * kGpsPi;
  sent.argument_of_perigee_rad -= 4 * kGpsPi;
  EXPECT_EQ(quantised(sent), to_ephemeris(kRaw));
  sent.mean_anomaly_rad = kGpsPi;  // one semicircle does not fit: it is minus one
  EXPECT_EQ(quantised(sent).mean_anomaly_rad, -kGpsPi);
}

// Week 2047 is 1023 of the message's count and 2048 is 0 again: rollover of November 2038.
TEST(LnavTest, WeekIsTheOneNearestTheReference) {
  BroadcastEphemeris sent = to_ephemeris(kRaw);
  for (const int week : {0, 1023, 1024, 2047, 2048, 2358}) {
    sent.week = week;
    const Subframes subframes = pack(sent, kTow);
    for (const int off : {-511, -1, 0, 1, 511}) {
      EXPECT_EQ(unpack(subframes, sent.prn, week + off).week, week) << week << " " << off;
    }
  }
}

// Sent in the last frame of week 2357 for toe = 0 of week 2358, and the other way round: subframe 1
// counts the week of its transmission.
TEST(LnavTest, ToeMayLieAcrossATurnOfTheWeek) {
  BroadcastEphemeris sent = to_ephemeris(kRaw);
  sent.week = 2358;
  sent.toe_s = sent.toc_s = 0;
  const Subframes before = pack(sent, 604770);
  EXPECT_EQ(bits_of(before[0]).substr(48, 10), field(2357 % 1024, 10));
  EXPECT_EQ(bits_of(before[0]).substr(24, 17), field(100796, 17));
  EXPECT_EQ(unpack(before, sent.prn, 2357), sent);
  sent.toe_s = sent.toc_s = 604784;
  const Subframes after = pack(sent, 0);
  EXPECT_EQ(bits_of(after[0]).substr(48, 10), field(2359 % 1024, 10));
  EXPECT_EQ(unpack(after, sent.prn, 2358), sent);
}

// The count of the hand-over word is that of the next subframe, which for subframe 5 would be 0 of
// the next week.
TEST(LnavTest, HandOverWordCountsToTheNextSubframe) {
  const Subframes subframes = pack(to_ephemeris(kRaw), 604770);
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_EQ(bits_of(subframes[k]).substr(24, 17),
              field(100795 + static_cast<long long>(k) + 1, 17));
  }
}

struct Refusal {
  const char* text;
  void (*spoil)(BroadcastEphemeris&);
};

class LnavRefusalTest : public testing::TestWithParam<Refusal> {};

TEST_P(LnavRefusalTest, NamesSatelliteValueAndRange) {
  BroadcastEphemeris sent = to_ephemeris(kRaw);
  GetParam().spoil(sent);
  EXPECT_THAT([&] { pack(sent, kTow); },
              testing::ThrowsMessage<std::invalid_argument>(testing::AllOf(
                  testing::HasSubstr("PRN 17"), testing::HasSubstr(GetParam().text))));
}

INSTANTIATE_TEST_SUITE_P(
    Values, LnavRefusalTest,
    testing::Values(
        Refusal{"iode = 1 with iodc = 613; accepted: iodc modulo 256",
                [](BroadcastEphemeris& e) { e.iode = 1; }},
        Refusal{"iodc = 1024; accepted: 0 to 1023", [](BroadcastEphemeris& e) { e.iodc = 1024; }},
        Refusal{"toe_s = 345601; accepted: multiples of 16 from 0 to 604784",
                [](BroadcastEphemeris& e) { e.toe_s = 345601; }},
        Refusal{"toc_s = 604800", [](BroadcastEphemeris& e) { e.toc_s = 604800; }},
        Refusal{"week = -1", [](BroadcastEphemeris& e) { e.week = -1; }},
        Refusal{"health = 64; accepted: 0 to 63", [](BroadcastEphemeris& e) { e.health = 64; }},
        Refusal{"ura_index = 16", [](BroadcastEphemeris& e) { e.ura_index = 16; }},
        Refusal{"tgd_s = 1e-06; accepted: -5.9", [](BroadcastEphemeris& e) { e.tgd_s = 1e-6; }},
        Refusal{"eccentricity = -0.1; accepted: 0 to 0.49",
                [](BroadcastEphemeris& e) { e.eccentricity = -0.1; }},
        Refusal{"sqrt_a_sqrtm = 8192", [](BroadcastEphemeris& e) { e.sqrt_a_sqrtm = 8192; }},
        Refusal{"af0_s = nan", [](BroadcastEphemeris& e) { e.af0_s = std::nan(""); }},
        Refusal{
            "raan0_rad = inf",
            [](BroadcastEphemeris& e) { e.raan0_rad = std::numeric_limits<double>::infinity(); }},
        Refusal{"i_rate_radps = 1e-08", [](BroadcastEphemeris& e) { e.i_rate_radps = 1e-8; }}));

TEST(LnavTest, AFrameStartsEveryThirtySeconds) {
  for (const int tow : {-30, 7, 604800}) {
    EXPECT_THAT([&] { pack(to_ephemeris(kRaw), tow); },
                testing::ThrowsMessage<std::invalid_argument>(
                    testing::HasSubstr("tow_s = " + std::to_string(tow))));
  }
}

TEST(LnavTest, ForeignSubframesAreRefused) {
  const Subframes sound = pack(to_ephemeris(kRaw), kTow);
  const auto expect_refused = [](const Subframes& subframes, const char* text) {
    EXPECT_THAT([&] { unpack(subframes, 17, 2358); },
                testing::ThrowsMessage<std::invalid_argument>(testing::HasSubstr(text)));
  };
  expect_refused({sound[1], sound[1], sound[2]}, "subframe id 2; accepted: 139 and 1");
  Subframes preamble = sound;
  preamble[2][0] = std::byte{0x74};
  expect_refused(preamble, "preamble 116");
  RawBroadcast next = kRaw;
  next.iodc += 1;
  expect_refused({sound[0], sound[1], pack(to_ephemeris(next), kTow)[2]}, "issues 613, 101, 102");
}

// IS-GPS-200, 20.3.3.3.1.3.
TEST(LnavTest, UserRangeAccuracyIsTheNominalOne) {
  EXPECT_EQ(ura_m(0), 2);
  EXPECT_EQ(ura_m(6), 16);
  EXPECT_EQ(ura_m(14), 4096);
  for (int n = 0; n <= 6; ++n) EXPECT_NEAR(ura_m(n), std::exp2(1 + n / 2.0), 0.05);
  for (int n = 7; n < 15; ++n) EXPECT_EQ(ura_m(n), std::exp2(n - 2));
  EXPECT_THROW(ura_m(16), std::invalid_argument);
}

}  // namespace
}  // namespace orrery::lnav
