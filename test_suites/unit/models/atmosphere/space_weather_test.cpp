#include <orrery/models/atmosphere/space_weather.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <functional>
#include <limits>
#include <string>
#include <vector>

namespace orrery {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::ThrowsMessage;

// UTC midnight; GPS was ahead by this many seconds.
SimTime utc_midnight(int year, int month, int day, Duration gps_minus_utc) {
  return gps_midnight(year, month, day) + gps_minus_utc;
}

// ---- Constant

TEST(SpaceWeatherTest, ConstantIsTheSameAtAllTimes) {
  const SpaceWeather weather =
      SpaceWeather::constant({.f107_sfu = 120, .f107a_sfu = 110, .ap_daily = 7});
  for (const SimTime t : {gps_midnight(1990, 1, 1), gps_midnight(2150, 6, 7) + 12345s}) {
    const SpaceWeatherIndices now = weather.at(t);
    EXPECT_EQ(now.f107_sfu, 120);
    EXPECT_EQ(now.f107a_sfu, 110);
    EXPECT_EQ(now.ap_daily, 7);
    EXPECT_FALSE(now.ap_history);
    EXPECT_FALSE(weather.next_change(t));
  }
}

TEST(SpaceWeatherTest, ConstantOutsideTheModelsRangeIsRefused) {
  EXPECT_THAT([] { SpaceWeather::constant({.f107_sfu = 20}); },
              ThrowsMessage<std::domain_error>(
                  AllOf(HasSubstr("f107_sfu = 20"), HasSubstr("50"), HasSubstr("450"))));
  EXPECT_THAT(
      [] { SpaceWeather::constant({.ap_daily = std::numeric_limits<double>::quiet_NaN()}); },
      ThrowsMessage<std::domain_error>(HasSubstr("ap_daily = nan")));
}

// ---- Monthly

// Counted by hand from the table: the 81 days around 2016-03-31 are 10 of February (103.5), March
// (91.6), April (93.4), 10 of May (93.1).
TEST(SpaceWeatherTest, MonthlyTableGivesItsMonthsValuesAndTheMeanOf81Days) {
  const SpaceWeather weather = SpaceWeather::monthly();
  const SpaceWeatherIndices march = weather.at(utc_midnight(2016, 3, 31, 17s));
  EXPECT_EQ(march.f107_sfu, 91.6);
  EXPECT_EQ(march.ap_daily, 11);
  EXPECT_FALSE(march.ap_history);
  EXPECT_NEAR(march.f107a_sfu, (10 * 103.5 + 31 * 91.6 + 30 * 93.4 + 10 * 93.1) / 81, 1e-12);

  // The flux of the day before, the Ap of the day.
  const SpaceWeatherIndices april = weather.at(utc_midnight(2016, 5, 1, 17s));
  EXPECT_EQ(april.f107_sfu, 93.4);
  EXPECT_EQ(april.ap_daily, 12);
}

TEST(SpaceWeatherTest, InstantsOutsideTheTableAreRefusedWithTheCoveredDays) {
  const SpaceWeather weather = SpaceWeather::monthly();
  const SimTime first = utc_midnight(2014, 2, 10, 16s), end = utc_midnight(2025, 11, 22, 18s);
  EXPECT_NO_THROW(weather.at(first));
  EXPECT_NO_THROW(weather.at(end - 1ns));
  EXPECT_THAT([&] { weather.at(first - 1s); },
              ThrowsMessage<std::out_of_range>(
                  AllOf(HasSubstr("2014-02-09 23:59:59 UTC is outside space_weather_monthly.csv"),
                        HasSubstr("covers 2014-02-10 to 2025-11-21 UTC"))));
  EXPECT_THAT([&] { weather.at(end); },
              ThrowsMessage<std::out_of_range>(HasSubstr("2025-11-22 00:00:00 UTC is outside")));
  EXPECT_THAT(
      [&] {
        weather.at(JulianDate{std::numeric_limits<double>::quiet_NaN(), 0});
      },
      ThrowsMessage<std::invalid_argument>(HasSubstr("not a Julian date")));
}

TEST(SpaceWeatherTest, MalformedMonthlyTablesAreRefusedWithTheirLine) {
  const std::string header = "year,month,f107_obs_monthly_mean,ap_monthly_mean\n";
  const struct {
    std::string text, message;
  } cases[] = {
      {"", "line 0: the first line is not year,month"},
      {"year;month\n", "line 1: the first line is not year,month"},
      {header + "2014,1,158.6,6\n2014,3,149.9,6\n", "line 3: the month does not follow"},
      {header + "2014,1,158.6,6\n2014,2,170.3\n", "line 3: '2014,2,170.3' does not have 4 fields"},
      {header + "2014,1,158.6,6,7\n", "line 2: '2014,1,158.6,6,7' does not have 4 fields"},
      {header + "2014,1,nan,6\n", "line 2: F10.7 is 'nan'; accepted: 1 to 2000"},
      {header + "2014,1,1e308,6\n", "line 2: F10.7 is '1e308'; accepted: 1 to 2000"},
      {header + "2014,1,158.6,-1\n", "line 2: Ap is '-1'; accepted: 0 to 400"},
      {header + "2014,13,158.6,6\n", "line 2: month is '13'; accepted: a whole number, 1 to 12"},
      {header + "2014,1,158.6,6", "line 2: cut short: the last line has no line end"},
      {header + "2014,1,158.6,6\n", "too short for a mean of 81 days"},
  };
  for (const auto& c : cases) {
    EXPECT_THAT([&] { SpaceWeather::parse_monthly(c.text, "t.csv"); },
                ThrowsMessage<std::invalid_argument>(
                    AllOf(HasSubstr("SpaceWeather: t.csv, "), HasSubstr(c.message))));
  }
}

// ---- CelesTrak

struct Row {
  int year, month, day;
  int ap[8];
  double observed, mean81;
};

// A line of the documented format, with values that our reader must not take for its own: the
// adjusted flux and its means differ from the observed ones.
std::string line_of(const Row& r) {
  char text[160];
  std::snprintf(
      text, sizeof text,
      "%4d %02d %02d %4d %2d %2d %2d %2d %2d %2d %2d %2d %2d %3d %3d %3d %3d %3d %3d %3d %3d "
      "%3d %3d %3.1f %1d %3d %5.1f %1d %5.1f %5.1f %5.1f %5.1f %5.1f\r\n",
      r.year, r.month, r.day, 2540, 7, 10, 13, 17, 20, 23, 27, 30, 33, 173, r.ap[0], r.ap[1],
      r.ap[2], r.ap[3], r.ap[4], r.ap[5], r.ap[6], r.ap[7], 77, 0.3, 1, 12, 70.1, 0, 70.2, 70.3,
      r.observed, r.mean81, 70.4);
  return text;
}

// Days from 2020-02-26, past a leap day, every ap different: interval k counted from the first is
// k.
std::vector<Row> rows_of(int days) {
  std::vector<Row> rows;
  int month = 2, day = 26;
  for (int i = 0; i < days; ++i) {
    Row row{2020, month, day, {}, 100.0 + i, 90.0 + i};
    for (int k = 0; k < 8; ++k) row.ap[k] = 8 * i + k;
    rows.push_back(row);
    if (++day > 29) day = 1, ++month;
  }
  return rows;
}

std::string section(const std::string& name, const std::vector<Row>& rows, int announced) {
  std::string text =
      "NUM_" + name + "_POINTS " + std::to_string(announced) + "\r\nBEGIN " + name + "\r\n";
  for (const Row& row : rows) text += line_of(row);
  return text + "END " + name + "\r\n";
}

const std::string kHead =
    "DATATYPE CssiSpaceWeather\r\nVERSION 1.2\r\nUPDATED 2020 Mar 02 00:00:00 UTC\r\n# a "
    "comment\r\n#\r\n";

std::string document(int observed, int predicted) {
  std::vector<Row> rows = rows_of(observed + predicted);
  const std::vector<Row> tail(rows.begin() + observed, rows.end());
  rows.resize(static_cast<std::size_t>(observed));
  std::string text = kHead + section("OBSERVED", rows, observed) + "\r\n";
  if (predicted > 0) text += section("DAILY_PREDICTED", tail, predicted);
  return text;
}

TEST(SpaceWeatherTest, CelestrakDayGivesTheFluxOfTheDayBeforeAndTheHistoryOfAp) {
  const SpaceWeather weather = SpaceWeather::parse_celestrak(document(4, 1), "sw.txt");
  EXPECT_EQ(weather.covered(), "2020-02-29 to 2020-03-01 UTC");
  // 2020-02-29 13:00 UTC: the fourth day, its fifth interval, number 3 * 8 + 4.
  const SpaceWeatherIndices now = weather.at(utc_midnight(2020, 2, 29, 18s) + 13h);
  EXPECT_EQ(now.f107_sfu, 102);
  EXPECT_EQ(now.f107a_sfu, 93);
  EXPECT_EQ(now.ap_daily, 77);
  // Means of the numbers 24 to 17 and 16 to 9: four to eleven, and twelve to nineteen intervals
  // back.
  ASSERT_TRUE(now.ap_history);
  EXPECT_THAT(*now.ap_history, ElementsAre(77, 28, 27, 26, 25, 20.5, 12.5));

  // A predicted day follows the observed ones.
  const SpaceWeatherIndices next = weather.at(utc_midnight(2020, 3, 1, 18s));
  EXPECT_EQ(next.f107_sfu, 103);
  EXPECT_THAT(*next.ap_history, ElementsAre(77, 32, 31, 30, 29, 24.5, 16.5));
}

TEST(SpaceWeatherTest, IntervalsChangeAtMultiplesOfThreeHoursOfUtc) {
  const SpaceWeather weather = SpaceWeather::parse_celestrak(document(5, 0), "sw.txt");
  const SimTime nine = utc_midnight(2020, 2, 29, 18s) + 9h;
  EXPECT_EQ((*weather.at(nine - 1ns).ap_history)[1], 26);
  EXPECT_EQ((*weather.at(nine).ap_history)[1], 27);
  EXPECT_EQ(weather.next_change(nine - 1ns), nine);
  EXPECT_EQ(weather.next_change(nine), nine + 3h);
}

TEST(SpaceWeatherTest, DaysOfTheMonthlyTableChangeAtMidnightUtcThroughALeapSecond) {
  const SpaceWeather weather = SpaceWeather::monthly();
  // 2016 ended with a leap second: 2017-01-01 begins at GPS time 18 s after its midnight, 23:59:60
  // with the 17 s of before. The leap second itself already reads as the new day (time_scales.hpp).
  const SimTime leap = gps_midnight(2017, 1, 1) + 17s;
  EXPECT_EQ(weather.next_change(leap - 5s), leap);
  EXPECT_EQ(weather.next_change(leap + 500ms), gps_midnight(2017, 1, 2) + 18s);
  EXPECT_EQ(weather.next_change(leap + 1s), gps_midnight(2017, 1, 2) + 18s);
  EXPECT_EQ(weather.at(leap - 1ns).ap_daily, 10);
  EXPECT_EQ(weather.at(leap - 1s).f107_sfu, 75.1);
  EXPECT_EQ(weather.at(leap + 1s + 24h).f107_sfu, 77.4);
}

TEST(SpaceWeatherTest, NextMultipleWorksBeforeTheGpsEpoch) {
  EXPECT_EQ(next_utc_multiple(from_ns(0), 24h), from_ns(to_ns(24h)));
  EXPECT_EQ(next_utc_multiple(from_ns(-1), 24h), from_ns(0));
}

// Whatever byte it ends at, a file that was cut short is refused.
TEST(SpaceWeatherTest, EveryCutFileIsRefused) {
  const std::string whole = document(5, 2);
  ASSERT_NO_THROW(SpaceWeather::parse_celestrak(whole, "sw.txt"));
  const std::size_t end_of_observed =
      whole.find("END OBSERVED") + std::string("END OBSERVED\r\n").size();
  for (std::size_t size = 0; size < whole.size(); ++size) {
    // Whole sections are a whole file: predictions may be absent.
    if (size == end_of_observed || size == end_of_observed + 2) continue;
    EXPECT_THAT([&] { SpaceWeather::parse_celestrak(whole.substr(0, size), "sw.txt"); },
                ThrowsMessage<std::invalid_argument>(HasSubstr("sw.txt, line")))
        << size;
  }
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

TEST(SpaceWeatherTest, MalformedCelestrakFilesAreRefusedWithTheirLine) {
  const std::string good = document(5, 0);
  const std::string second_day = line_of(rows_of(2)[1]);
  const struct {
    std::string text, message;
  } cases[] = {
      {std::string("\x7f\x45LF", 4), "line 1: byte 0x7f at column 1 is not printable ASCII"},
      {"DATATYPE CssiSpaceWeather", "line 1: cut short: the last line has no line end"},
      {"DATATYPE Others\n", "line 1: not a CelesTrak space-weather file"},
      {replaced(good, "POINTS 5", "POINTS 4"), "END OBSERVED is missing: more lines than the 4"},
      {replaced(good, "POINTS 5", "POINTS 6"), "line 13: OBSERVED ends after 5 of 6"},
      {replaced(good, "POINTS 5", "POINTS 99999999999999999999"), "NUM_OBSERVED_POINTS is '9999"},
      {replaced(good, "POINTS 5", "POINTS -3"), "NUM_OBSERVED_POINTS is '-3'"},
      {replaced(good, "BEGIN OBSERVED", "BEGIN"), "line 7: BEGIN OBSERVED is missing"},
      {replaced(good, "NUM_OBSERVED_POINTS", "NUM_SOMETHING_POINTS"), "section 'SOMETHING'"},
      {replaced(good, "NUM_OBSERVED_POINTS", "NUM_POINTS"), "line 6: unknown: 'NUM_POINTS 5'"},
      {replaced(good, "# a comment", "what is this"), "line 4: unknown: 'what is this'"},
      {replaced(good, second_day, ""),
       "line 9: the day does not follow the one before: 1 days off"},
      {replaced(good, "2020 02 27", "2020 02 30"), "line 9: no such date: 2020-2-30"},
      {replaced(good, "2020 02 27", "2020 13 27"), "line 9: month is '13'"},
      {replaced(good, "101.0", "  nan"), "line 9: column 118 is 'nan'"},
      {replaced(good, "101.0", "9e999"), "line 9: column 118 is '9e999'"},
      {replaced(good, "101.0", "9999."), "line 9: observed F10.7 is '9999.'; accepted: 1 to 2000"},
      {replaced(good, "101.0", "     "), "line 9: observed F10.7 is ''"},
      {replaced(good, "101.0", "1x1.0"), "line 9: column 118 is '1x1.0'"},
      {replaced(good, " 101.0", "101.0"), "line 9: the line has 129 characters; accepted: 130"},
      {good + good, "unknown: 'DATATYPE CssiSpaceWeather'"},
      {good + section("OBSERVED", rows_of(5), 5), "section 'OBSERVED' is unknown, repeated"},
      {kHead, "line 5: cut short: no section OBSERVED"},
      {kHead + section("OBSERVED", rows_of(3), 3), "only 3 days; accepted: 4 or more"},
  };
  for (const auto& c : cases) {
    EXPECT_THAT([&] { SpaceWeather::parse_celestrak(c.text, "sw.txt"); },
                ThrowsMessage<std::invalid_argument>(
                    AllOf(HasSubstr("SpaceWeather: sw.txt, "), HasSubstr(c.message))));
  }
}

TEST(SpaceWeatherTest, FileThatCannotBeReadIsNamed) {
  EXPECT_THAT([] { SpaceWeather::load_celestrak("/no/such/file.txt"); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("cannot read '/no/such/file.txt'")));
  EXPECT_THAT([] { SpaceWeather::load_celestrak(testing::TempDir()); },
              ThrowsMessage<std::invalid_argument>(HasSubstr(testing::TempDir())));
}

}  // namespace
}  // namespace orrery
