#include <orrery/models/atmosphere/space_weather.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

namespace orrery {
namespace {

// The whole CelesTrak file, 1957 to 2026 observed (space_weather/README.md of the reference data).
class CelestrakFileTest : public testing::Test {
 protected:
  void SetUp() override {
    const std::filesystem::path path =
        std::filesystem::path(ORRERY_REFERENCE_DATA) / "space_weather" / "SW-All_v1.2.txt.gz";
    if (!std::filesystem::exists(path)) {
      GTEST_SKIP() << "no " << path << " (ORRERY_REFERENCE_DATA)";
    }
    std::FILE* const pipe = popen(("gzip -dc '" + path.string() + "'").c_str(), "r");
    ASSERT_NE(pipe, nullptr);
    char part[4096];
    for (std::size_t n; (n = fread(part, 1, sizeof part, pipe)) > 0;) text_.append(part, n);
    ASSERT_EQ(pclose(pipe), 0) << "gzip -dc " << path;
  }

  // GPS minus UTC was 18 s from 2017 on.
  static SimTime utc(int year, int month, int day) { return gps_midnight(year, month, day) + 18s; }

  std::string text_;
};

// Read off the file by eye, lines "2024 05 08" to "2024 05 11". At 01:00 the running interval is
// the first of the 11th; means of the ap 4 to 11 intervals back (22 7 9 12 12 of the 10th, 7 9 4 of
// the 9th) and 12 to 19 back (4 5 3 5 3 of the 9th, 4 3 7 of the 8th).
TEST_F(CelestrakFileTest, StormOfMay2024HasItsIndices) {
  const SpaceWeather weather = SpaceWeather::parse_celestrak(text_, "SW-All");
  EXPECT_EQ(weather.covered(), "1957-10-04 to 2026-10-05 UTC");
  const SpaceWeatherIndices now = weather.at(utc(2024, 5, 11) + 1h);
  EXPECT_EQ(now.f107_sfu, 223.4);
  EXPECT_EQ(now.f107a_sfu, 177.1);
  EXPECT_EQ(now.ap_daily, 271);
  ASSERT_TRUE(now.ap_history);
  EXPECT_THAT(*now.ap_history, testing::ElementsAre(271, 400, 300, 300, 179, 10.25, 4.25));
}

// The centred mean of the file is that of 81 of its own daily values, in the same columns, to the
// 0.05 of its rounding; so columns, days and their order are the right ones throughout.
TEST_F(CelestrakFileTest, MeansOfTheFileAreMeansOfItsDays) {
  const SpaceWeather weather = SpaceWeather::parse_celestrak(text_, "SW-All");
  int days = 0, far = 0;
  for (SimTime day = utc(2018, 1, 1); day < utc(2023, 1, 1); day += 24h, ++days) {
    double sum = 0;
    // The flux of a day is what the day after is given.
    for (int k = -40; k <= 40; ++k) sum += weather.at(day + (k + 1) * 24h).f107_sfu;
    far += std::abs(sum / 81 - weather.at(day).f107a_sfu) > 0.06;
  }
  EXPECT_EQ(days, 1826);
  EXPECT_EQ(far, 0);
}

// Ap of a day is the mean of its eight ap, rounded.
TEST_F(CelestrakFileTest, DailyApIsTheMeanOfTheThreeHourlyOnes) {
  const SpaceWeather weather = SpaceWeather::parse_celestrak(text_, "SW-All");
  for (SimTime day = utc(2017, 1, 1); day < utc(2026, 1, 1); day += 24h) {
    double sum = 0;
    for (int k = 0; k < 8; ++k) sum += (*weather.at(day + k * 3h).ap_history)[1];
    EXPECT_NEAR(sum / 8, weather.at(day).ap_daily, 0.5) << to_string(day);
  }
}

}  // namespace
}  // namespace orrery
