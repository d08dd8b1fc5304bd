#include <orrery/models/ccsds/epoch.hpp>

#include <erfa.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

namespace orrery {
namespace {

using testing::AllOf;
using testing::HasSubstr;

CcsdsEpoch epoch(const char* text) {
  const std::optional<CcsdsEpoch> value = read_epoch(text);
  EXPECT_TRUE(value) << text;
  return value.value_or(CcsdsEpoch{});
}

TEST(CcsdsEpochTest, TextIsReadAndWrittenAgain) {
  const std::pair<const char*, const char*> texts[] = {
      {"2017-04-11T22:31:43.121856000000", "2017-04-11T22:31:43.121856"},
      {"2022-03-28T19:06:42.912Z", "2022-03-28T19:06:42.912"},
      {"1996-353T12:00:00.331", "1996-12-18T12:00:00.331"},  // 1996 was a leap year
      {"2023-365T00:00:00", "2023-12-31T00:00:00"},
      {"2024-02-29T23:59:59.9999999999", "2024-02-29T23:59:59.999999999"},
      {"2016-12-31T23:59:60.5", "2016-12-31T23:59:60.5"},
      {"0000-023T02:28:01", "0000-01-23T02:28:01"},
      {"1970-01-01T00:00:00.000000001", "1970-01-01T00:00:00.000000001"},
      {"1969-12-31T00:00:01", "1969-12-31T00:00:01"}};
  for (const auto& [text, again] : texts) {
    EXPECT_EQ(to_text(epoch(text)), again);
    EXPECT_EQ(epoch(again), epoch(text));
  }
}

TEST(CcsdsEpochTest, OtherTextIsNoEpoch) {
  for (const char* text : {"",
                           "2017",
                           "2017-04-11",
                           "2017-04-11 22:31:43",
                           "2017-4-11T22:31:43",
                           "17-04-11T22:31:43",
                           "2017-04-31T22:31:43",
                           "2023-02-29T00:00:00",
                           "2023-366T00:00:00",
                           "2024-367T00:00:00",
                           "2024-000T00:00:00",
                           "2017-13-01T00:00:00",
                           "2017-00-10T00:00:00",
                           "2017-04-11T24:00:00",
                           "2017-04-11T22:60:43",
                           "2017-04-11T22:31:60",
                           "2017-04-11T23:59:61",
                           "2017-04-11T22:31",
                           "2017-04-11T22:31:43.",
                           "2017-04-11T22:31:43,5",
                           "2017-04-11T22:31:43+01:00",
                           "2017-04-11T22:31:43ZZ",
                           "2017-04-11T22:31:-3",
                           "-017-04-11T22:31:43",
                           "nan",
                           "2017-04-11T22:31:43 "})
    EXPECT_FALSE(read_epoch(text)) << text;
}

// GPS - UTC = 18 s since 2017, 17 s before; TAI = GPS + 19 s; TT = TAI + 32.184 s.
TEST(CcsdsEpochTest, TimeSystemsMeetInSimTime) {
  const SimTime t = gps_midnight(2025, 1, 1) + 18s;
  EXPECT_EQ(to_sim_time(epoch("2025-01-01T00:00:00"), TimeSystem::kUTC), t);
  EXPECT_EQ(to_sim_time(epoch("2025-01-01T00:00:18"), TimeSystem::kGPS), t);
  EXPECT_EQ(to_sim_time(epoch("2025-01-01T00:00:37"), TimeSystem::kTAI), t);
  EXPECT_EQ(to_sim_time(epoch("2025-01-01T00:01:09.184"), TimeSystem::kTT), t);
  EXPECT_EQ(to_sim_time(epoch("1980-01-06T00:00:00"), TimeSystem::kUTC), SimTime());
}

TEST(CcsdsEpochTest, LeapSecondHasItsOwnSecond) {
  const SimTime new_year = gps_midnight(2017, 1, 1) + 18s;
  EXPECT_EQ(to_sim_time(epoch("2016-12-31T23:59:59"), TimeSystem::kUTC), new_year - 2s);
  EXPECT_EQ(to_sim_time(epoch("2016-12-31T23:59:60"), TimeSystem::kUTC), new_year - 1s);
  EXPECT_EQ(to_sim_time(epoch("2016-12-31T23:59:60.999999999"), TimeSystem::kUTC), new_year - 1ns);
  EXPECT_EQ(to_sim_time(epoch("2017-01-01T00:00:00"), TimeSystem::kUTC), new_year);
  EXPECT_EQ(to_text(to_epoch(new_year - 1ns, TimeSystem::kUTC)), "2016-12-31T23:59:60.999999999");
  EXPECT_EQ(to_text(to_epoch(new_year - 1s - 1ns, TimeSystem::kUTC)),
            "2016-12-31T23:59:59.999999999");
  EXPECT_EQ(to_text(to_epoch(new_year, TimeSystem::kUTC)), "2017-01-01T00:00:00");
}

TEST(CcsdsEpochTest, ConversionIsUndone) {
  for (const TimeSystem system :
       {TimeSystem::kUTC, TimeSystem::kTAI, TimeSystem::kGPS, TimeSystem::kTT}) {
    for (SimTime t = gps_midnight(1980, 1, 8); t < gps_midnight(2060, 1, 1);
         t += days(11) + 7h + 11min + 13s + 17ns)
      ASSERT_EQ(to_sim_time(to_epoch(t, system), system), t) << to_string(t);
  }
}

// ERFA's own way from a calendar of UTC to TAI; two-part dates resolve 1e-11 s, asked for 1 ns.
TEST(CcsdsEpochTest, UtcAgreesWithErfa) {
  for (SimTime t = gps_midnight(1980, 2, 1); t < gps_midnight(2025, 1, 1); t += days(97) + 12345s) {
    const CcsdsEpoch utc = to_epoch(t, TimeSystem::kUTC);
    const double k1970 = 2440587.5;
    double tai1 = 0, tai2 = 0;
    ASSERT_EQ(
        eraUtctai(k1970 + utc.day, 1e-9 * static_cast<double>(utc.ns_of_day) / 86400, &tai1, &tai2),
        0);
    const double gps_s = ((tai1 - 2444244.5) + tai2) * 86400 - 19;
    ASSERT_NEAR(gps_s, to_seconds(t.time_since_epoch()), 3e-7) << to_string(t);  // 1.4e9 s: 2e-7
  }
}

// The Astronomical Almanac's (section B) TDB - TT = 1.657 ms sin g + 0.022 ms sin(L - L_J), d days
// from J2000, against the full series of ERFA. What it leaves out is e times the first term, 0.014
// ms, and smaller ones; observed 0.019 ms.
TEST(CcsdsEpochTest, TdbFollowsTheEarthsOrbit) {
  constexpr double kDegree_rad = 0.017453292519943295;
  for (int month = 1; month <= 12; ++month) {
    const SimTime t = gps_midnight(2025, month, 4);
    const CcsdsEpoch tt = to_epoch(t, TimeSystem::kTT), tdb = to_epoch(t, TimeSystem::kTDB);
    const double d = to_seconds(t - gps_midnight(2000, 1, 1)) / 86400 - 0.5;
    const double g_rad = (357.53 + 0.98560028 * d) * kDegree_rad;
    const double L_minus_LJ_rad = (246.11 + 0.90251792 * d) * kDegree_rad;
    const double almanac_s = 1.657e-3 * std::sin(g_rad) + 0.022e-3 * std::sin(L_minus_LJ_rad);
    EXPECT_NEAR(1e-9 * static_cast<double>(tdb.ns_of_day - tt.ns_of_day), almanac_s, 25e-6);
    EXPECT_LE(std::abs(to_ns(to_sim_time(tdb, TimeSystem::kTDB) - t)), 1);
  }
}

TEST(CcsdsEpochTest, WhatCannotBeConvertedIsNamed) {
  const auto refused = [](const char* text, TimeSystem system, const char* what) {
    try {
      to_sim_time(epoch(text), system);
      ADD_FAILURE() << text;
    } catch (const std::invalid_argument& error) {
      EXPECT_THAT(error.what(), AllOf(HasSubstr("to_sim_time"), HasSubstr(what)));
    }
  };
  refused("2025-01-01T00:00:00", TimeSystem::kUT1, "time system UT1; accepted: UTC, TAI, GPS");
  refused("2025-01-01T00:00:00", TimeSystem::kMET, "MET");
  refused("1979-12-31T00:00:00", TimeSystem::kTAI, "1979-12-31T00:00:00");
  refused("2201-01-01T00:00:00", TimeSystem::kUTC, "1980 to 2200");
  refused("2025-06-30T23:59:60", TimeSystem::kUTC, "no leap second at 2025-06-30T23:59:60");
  refused("2016-12-31T23:59:60", TimeSystem::kTAI, "86400 s");
  EXPECT_THROW(to_epoch(gps_midnight(2025, 1, 1), TimeSystem::kTCB), std::invalid_argument);
}

TEST(CcsdsEpochTest, TimeSystemsAreFoundByName) {
  EXPECT_EQ(time_system_named("utc"), TimeSystem::kUTC);
  EXPECT_EQ(time_system_named("SCLK"), TimeSystem::kSCLK);
  EXPECT_EQ(time_system_named("GMT"), std::nullopt);
  for (const TimeSystem system : {TimeSystem::kTDB, TimeSystem::kGMST, TimeSystem::kMRT})
    EXPECT_EQ(time_system_named(name_of(system)), system);
}

}  // namespace
}  // namespace orrery
