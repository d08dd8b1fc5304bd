#include <orrery/harness/kernel/time.hpp>

#include <gtest/gtest.h>

#include <clocale>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace orrery {
namespace {

constexpr std::int64_t kNsPerWeek = 604800LL * 1'000'000'000LL;

// IS-GPS-200: week 0 begins at 1980-01-06; the 10-bit week rolled over at the beginning of
// 1999-08-22 (week 1024) and of 2019-04-07 (week 2048).
TEST(GpsTimeTest, WeekRolloversFallOnTheirPublishedDays) {
  EXPECT_EQ(to_ns(gps_midnight(1980, 1, 6)), 0);
  EXPECT_EQ(to_ns(gps_midnight(1999, 8, 22)), 1024 * kNsPerWeek);
  EXPECT_EQ(to_ns(gps_midnight(2019, 4, 7)), 2048 * kNsPerWeek);
}

// The epoch of the reference mission: a Thursday, day 4 of GPS week 2358 (GPS calendar of the
// National Geodetic Survey).
TEST(GpsTimeTest, ReferenceEpochIsThursdayOfWeek2358) {
  const std::int64_t ns = to_ns(gps_midnight(2025, 3, 20));
  EXPECT_EQ(ns / kNsPerWeek, 2358);
  EXPECT_EQ(ns % kNsPerWeek, 345600LL * 1'000'000'000LL);
}

// From 1980-01-01 to 2200-01-01 there are 220 years, of which 54 have a leap day (1980 to 2196 in
// fours, without 2100); the epoch comes 5 days later.
TEST(GpsTimeTest, LeapYearsAreGregorian) {
  EXPECT_EQ(gps_midnight(2200, 1, 1) - gps_midnight(1980, 1, 6), days(220 * 365 + 54 - 5));
  EXPECT_EQ(gps_midnight(2000, 3, 1) - gps_midnight(2000, 2, 28), days(2));
  EXPECT_EQ(gps_midnight(2100, 3, 1) - gps_midnight(2100, 2, 28), days(1));
}

TEST(GpsTimeTest, WhatIsNoDateIsRejectedByName) {
  EXPECT_THROW(gps_midnight(2025, 2, 29), std::invalid_argument);
  EXPECT_THROW(gps_midnight(2025, 4, 31), std::invalid_argument);
  EXPECT_THROW(gps_midnight(2025, 13, 1), std::invalid_argument);
  EXPECT_THROW(gps_midnight(2025, 0, 1), std::invalid_argument);
  EXPECT_THROW(gps_midnight(2025, 1, 0), std::invalid_argument);
  EXPECT_THROW(gps_midnight(2025, 257, 1), std::invalid_argument);  // 1 in 8 bits
  EXPECT_THROW(gps_midnight(2025, 1, 257), std::invalid_argument);
  EXPECT_THROW(gps_midnight(1979, 12, 31), std::invalid_argument);
  try {
    gps_midnight(2201, 7, 4);
    FAIL() << "the year 2201 was accepted";
  } catch (const std::invalid_argument& error) {
    EXPECT_STREQ(error.what(), "gps_midnight: 2201-7-4 is not a date of the years 1980 to 2200");
  }
}

TEST(GpsTimeTest, CalendarShowsEveryNanosecond) {
  const SimTime midnight = gps_midnight(2025, 3, 20);
  EXPECT_EQ(to_string(midnight + 10s), "2025-03-20T00:00:10.000000000 GPST");
  EXPECT_EQ(to_calendar(midnight + 10s), "2025-03-20T00:00:10.000000000");
  EXPECT_EQ(to_calendar(midnight + 23h + 59min + 59s + 999'999'999ns),
            "2025-03-20T23:59:59.999999999");
  EXPECT_EQ(to_calendar(midnight - 1ns), "2025-03-19T23:59:59.999999999");
}

TEST(GpsTimeTest, CalendarHoldsBeforeTheEpochAndAtBothEndsOfTheRange) {
  EXPECT_EQ(to_calendar(from_ns(-1)), "1980-01-05T23:59:59.999999999");
  // 2^63 ns = 106751 d 23 h 47 min 16.854775808 s; the days 106752 before and 106751 after
  // 1980-01-06 by Python 3's datetime.date.
  EXPECT_EQ(to_calendar(SimTime::min()), "1687-09-26T00:12:43.145224192");
  EXPECT_EQ(to_calendar(SimTime::max()), "2272-04-15T23:47:16.854775807");
}

TEST(DurationTextTest, IsExactAndWithoutTrailingZeros) {
  EXPECT_EQ(to_string(Duration(0)), "0 s");
  EXPECT_EQ(to_string(12s + 500ms), "12.5 s");
  EXPECT_EQ(to_string(-3ns), "-3 ns");
  EXPECT_EQ(to_string(-1500us), "-1.5 ms");
  EXPECT_EQ(to_string(999ns), "999 ns");
  EXPECT_EQ(to_string(1001ns), "1.001 us");
  EXPECT_EQ(to_string(weeks(1)), "604800 s");
  EXPECT_EQ(to_string(1s + 1ns), "1.000000001 s");
  EXPECT_EQ(to_string(Duration::min()), "-9223372036.854775808 s");
}

TEST(DurationTextTest, DoesNotFollowTheLocale) {
  // Where none of these locales is installed the test shows nothing, and harms nothing.
  for (const char* name : {"de_DE.UTF-8", "fr_FR.UTF-8", "en_US.UTF-8"}) {
    if (std::setlocale(LC_ALL, name) == nullptr) continue;
    EXPECT_EQ(to_string(1234567s + 500ms), "1234567.5 s") << name;
  }
  std::setlocale(LC_ALL, "C");
}

TEST(FromSecondsTest, RoundsToTheNearestNanosecond) {
  EXPECT_EQ(from_seconds(0.5), 500ms);
  EXPECT_EQ(from_seconds(-0.5), -500ms);
  EXPECT_EQ(from_seconds(0.1), 100ms);
  EXPECT_EQ(from_seconds(0.4e-9), 0ns);
  EXPECT_EQ(from_seconds(0.6e-9), 1ns);
  EXPECT_EQ(from_seconds(-0.6e-9), -1ns);
}

// 2^30 + 2^-20 s is a double; 2^-20 s = 953.67431640625 ns. In one product with 1e9 the
// nanoseconds, 1.07e18, would be rounded to multiples of 128.
TEST(FromSecondsTest, KeepsNanosecondsAfterDecades) {
  EXPECT_EQ(from_seconds(0x1p30 + 0x1p-20), 1073741824s + 954ns);
}

TEST(FromSecondsTest, RejectsWhatIsNoDuration) {
  EXPECT_NO_THROW(from_seconds(9.2e9));
  EXPECT_NO_THROW(from_seconds(-9.2e9));
  EXPECT_THROW(from_seconds(9.3e9), std::invalid_argument);
  EXPECT_THROW(from_seconds(std::numeric_limits<double>::infinity()), std::invalid_argument);
  try {
    from_seconds(std::nan(""));
    FAIL() << "nan was accepted";
  } catch (const std::invalid_argument& error) {
    EXPECT_STREQ(error.what(), "from_seconds: seconds = nan s is outside -9.2e9 ... 9.2e9 s");
  }
}

}  // namespace
}  // namespace orrery
