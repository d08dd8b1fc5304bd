#include <orrery/models/frames/time_scales.hpp>

#include <gtest/gtest.h>

#include <stdexcept>

namespace orrery {
namespace {

constexpr std::int64_t kDay_s = 86400;
// 2017-01-01 00:00:00 UTC is day 13510 after the GPS epoch plus 18 leap seconds since it (IERS
// Bulletin C 52): 17 before, 18 from then on.
constexpr SimTime kNewYear2017_UTC = SimTime(13510 * kDay_s * 1s + 18s);

TEST(TimeScalesTest, TerrestrialTimeIsAheadByTheConstantOffset) {
  const JulianDate tt = gps_to_tt(SimTime(0s));
  EXPECT_EQ(tt.day, 2444244.5);
  EXPECT_NEAR(tt.fraction * 86400, 51.184, 1e-11);
}

TEST(TimeScalesTest, InstantsBeforeTheEpochFallOnTheDayBefore) {
  const JulianDate tt = gps_to_tt(SimTime(-60s));
  EXPECT_EQ(tt.day, 2444243.5);
  EXPECT_NEAR(tt.fraction * 86400, 86400 - 60 + 51.184, 1e-10);
}

TEST(TimeScalesTest, CenturiesCountFromJ2000) {
  // 2000-01-01 12:00:00 TT is 7300.5 days after the GPS epoch, less 51.184 s.
  const SimTime j2000 = SimTime(7300 * kDay_s * 1s + 43200s - 51184ms);
  EXPECT_NEAR(gps_to_tt_centuries(j2000), 0, 1e-20);
  EXPECT_NEAR(gps_to_tt_centuries(j2000 + days(36525)), 1, 1e-15);
}

TEST(TimeScalesTest, LeapSecondStartsTheNewOffsetAtMidnightUtc) {
  EXPECT_EQ(leap_seconds(SimTime(0s)), 19);
  EXPECT_EQ(leap_seconds(kNewYear2017_UTC - 2s), 36);
  EXPECT_EQ(leap_seconds(kNewYear2017_UTC - 1ns), 36) << "23:59:60.999999999";
  EXPECT_EQ(leap_seconds(kNewYear2017_UTC), 37);
  EXPECT_EQ(leap_seconds(kNewYear2017_UTC + days(3000)), 37);
}

TEST(TimeScalesTest, UtcLagsGpsByEighteenSecondsSince2017) {
  const JulianDate utc = gps_to_utc(kNewYear2017_UTC);
  EXPECT_EQ(utc.day, 2457754.5);
  EXPECT_EQ(utc.fraction, 0);
}

TEST(TimeScalesTest, DatesOutsideTheTableAreRefused) {
  EXPECT_THROW(leap_seconds(SimTime(-days(400))), std::invalid_argument);
  EXPECT_THROW(leap_seconds(SimTime(days(366 * 221))), std::invalid_argument);
}

}  // namespace
}  // namespace orrery
