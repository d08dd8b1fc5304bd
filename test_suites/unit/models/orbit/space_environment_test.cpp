#include <orrery/models/orbit/space_environment.hpp>
#include <orrery/models/orbit/sun_moon.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <stdexcept>
#include <string>
#include <vector>

namespace orrery {
namespace {

// 2016-12-30 to 2017-01-03, UT1-UTC about -0.4 s and then 0.6 s.
constexpr const char* kTable =
    "VERSION 1.1\nNUM_OBSERVED_POINTS 5\nBEGIN OBSERVED\n"
    "2016 12 30 57752  0.1  0.30 -0.4000  0.001 -0.11 -0.010  0 0  36\n"
    "2016 12 31 57753  0.1  0.30 -0.4010  0.001 -0.11 -0.010  0 0  36\n"
    "2017 01 01 57754  0.1  0.30  0.5980  0.001 -0.11 -0.010  0 0  37\n"
    "2017 01 02 57755  0.1  0.30  0.5970  0.001 -0.11 -0.010  0 0  37\n"
    "2017 01 03 57756  0.1  0.30  0.5960  0.001 -0.11 -0.010  0 0  37\nEND OBSERVED\n";

// h^4/24 max|f''''| with h = 1 h. The Moon: 3.8e8 m at 2.66e-6 rad/s, its eccentric and solar terms
// at twice to three times that: some 4e-14 m/s^4, 0.3 m. Observed 0.24 m.
// The Sun: rounding of its mean longitude, 200 rad: 3e-14 rad at 1.5e11 m, 4 mm. Observed 14 mm.
TEST(EarthEnvironmentTest, SunAndMoonAreThoseOfTheSeries) {
  const EarthEnvironment environment;
  double moon_m = 0, sun_m = 0;
  for (int k = 0; k < 4000; ++k) {
    const SimTime t(days(16000) + k * (7h + 11min + 3s + 1ns));
    const Surroundings around = environment.surroundings(t);
    moon_m = std::max(moon_m, norm(around.r_moon_ECI - moon_position_ECI(t)));
    sun_m = std::max(sun_m, norm(around.r_sun_ECI - sun_position_ECI(t)));
  }
  RecordProperty("largest_moon_error_m", std::to_string(moon_m));
  RecordProperty("largest_sun_error_m", std::to_string(sun_m));
  EXPECT_LT(moon_m, 0.4);
  EXPECT_LT(sun_m, 0.03);
}

TEST(EarthEnvironmentTest, ResultDoesNotDependOnWhatWasAskedBefore) {
  const EarthEnvironment forwards, backwards;
  const auto at = [](int k) { return SimTime(days(13510) + k * 31min); };
  std::vector<Surroundings> first;
  for (int k = 0; k < 300; ++k) first.push_back(forwards.surroundings(at(k)));
  for (int k = 299; k >= 0; --k) {
    const Surroundings again = backwards.surroundings(at(k));
    EXPECT_EQ(again.R_EI, first[k].R_EI);
    EXPECT_EQ(again.omega_EI_ECEF, first[k].omega_EI_ECEF);
    EXPECT_EQ(again.r_sun_ECI, first[k].r_sun_ECI);
    EXPECT_EQ(again.r_moon_ECI, first[k].r_moon_ECI);
  }
}

TEST(EarthEnvironmentTest, TakesATableOfEarthOrientation) {
  const EarthOrientationTable table = EarthOrientationTable::parse(kTable, "table.txt");
  const EarthEnvironment environment(table);
  const SimTime t = gps_midnight(2017, 1, 2);
  EXPECT_EQ(environment.surroundings(t).R_EI, EarthOrientation(table).R_EI(t));
  EXPECT_NE(environment.surroundings(t).R_EI, EarthEnvironment().surroundings(t).R_EI);
  EXPECT_THAT([&] { environment.surroundings(table.last() + 1ns); },
              testing::ThrowsMessage<std::out_of_range>(testing::HasSubstr("table.txt")));
}

TEST(EarthEnvironmentTest, InstantsWithoutLeapSecondsAreRefused) {
  EXPECT_THROW(EarthEnvironment().surroundings(gps_midnight(2200, 12, 31) + days(2)),
               std::invalid_argument);
}

}  // namespace
}  // namespace orrery
