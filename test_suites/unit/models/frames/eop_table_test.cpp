#include <orrery/models/frames/eop_leap_seconds.hpp>
#include <orrery/models/frames/eop_table.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <fstream>

namespace orrery {
namespace {

using testing::AllOf;
using testing::HasSubstr;

constexpr double kArcsecond_rad = 4.848136811095359935899141e-6;

// Made up, with round figures. 2016-12-30 to 2017-01-04, across the leap second. UT1-TAI, which a
// cubic reproduces, is -36.4 - 0.001 d + 0.0001 d^2 - 0.00001 d^3 s, d days from 2016-12-30; x is
// 0.1 + 0.002 d, y is 0.3 - 0.001 d^2 arcsec.
const std::string kCelestrak = R"(VERSION 1.1
UPDATED 2025 Jan 10 16:45:01 UTC
# a comment
NUM_OBSERVED_POINTS 4
BEGIN OBSERVED
2016 12 30 57752  0.100000  0.300000 -0.4000000  0.0010000 -0.110000 -0.010000  0.000100  0.000200  36
2016 12 31 57753  0.102000  0.299000 -0.4009100  0.0009000 -0.111000 -0.010500  0.000100  0.000200  36
2017 01 01 57754  0.104000  0.296000  0.5983200  0.0008000 -0.112000 -0.011000  0.000100  0.000200  37
2017 01 02 57755  0.106000  0.291000  0.5976300  0.0007000 -0.113000 -0.011500  0.000100  0.000200  37
END OBSERVED

NUM_PREDICTED_POINTS 2
BEGIN PREDICTED
2017 01 03 57756  0.108000  0.284000  0.5969600  0.0006000 -0.114000 -0.012000  0.000000  0.000000  37
2017 01 04 57757  0.110000  0.275000  0.5962500  0.0005000 -0.115000 -0.012500  0.000000  0.000000  37
END PREDICTED
)";

// The layout of finals2000A; the fourth row lacks the length of day and the pole offsets.
const std::string kFinals =
    "161230 57752.00 I  0.100000 0.000050  0.300000 0.000050  I-0.4000000 0.0000100  1.0000 0.0050 "
    " "
    "I     0.100    0.100     0.200    0.100\n"
    "161231 57753.00 I  0.102000 0.000050  0.299000 0.000050  I-0.4009100 0.0000100  0.9000 0.0050 "
    " "
    "I     0.100    0.100     0.200    0.100\n"
    "17 1 1 57754.00 I  0.104000 0.000050  0.296000 0.000050  I 0.5983200 0.0000100  0.8000 0.0050 "
    " "
    "I     0.100    0.100     0.200    0.100\n"
    "17 1 2 57755.00 P  0.106000 0.000050  0.291000 0.000050  P 0.5976300 0.0000100                "
    " "
    "                                       \n"
    "17 1 3 57756.00                                                                               "
    " "
    "                                       \n";

SimTime day(double days_from_2016_12_30) {
  // 0h UTC of 2016-12-30; the leap second makes 2016-12-31 a second longer, which counts as 1.2e-5
  // d.
  return gps_midnight(2016, 12, 30) + 17s + from_seconds(86400 * days_from_2016_12_30);
}

std::string with(std::string text, const std::string& old_part, const std::string& new_part) {
  const std::size_t at = text.find(old_part);
  EXPECT_NE(at, std::string::npos) << old_part;
  return text.replace(at, old_part.size(), new_part);
}

std::string without_line(std::string text, const std::string& begin) {
  const std::size_t at = text.find(begin);
  return text.erase(at, text.find('\n', at) + 1 - at);
}

// The message of the exception that parsing must throw.
std::string refusal(const std::string& text) {
  try {
    EarthOrientationTable::parse(text, "made_up.txt");
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  ADD_FAILURE() << "accepted: " << text.substr(0, 300);
  return "";
}

TEST(EarthOrientationTableTest, NoneIsZeroAtEveryInstant) {
  const EarthOrientationTable none = EarthOrientationTable::none();
  EXPECT_TRUE(none.is_none());
  for (const SimTime t :
       {gps_midnight(1980, 1, 6), gps_midnight(2025, 3, 20), gps_midnight(2199, 1, 1)}) {
    const EarthOrientationParameters p = none.at(t);
    EXPECT_EQ(p.ut1_minus_utc_s, 0);
    EXPECT_EQ(p.x_pole_rad, 0);
    EXPECT_EQ(p.y_pole_rad, 0);
    EXPECT_EQ(p.dpsi_rad, 0);
    EXPECT_EQ(p.deps_rad, 0);
  }
  EXPECT_THROW(none.first(), std::logic_error);
}

// A cubic through four points is a cubic's own value: rounding alone, 1e-14 s of 37 s.
// The nodes after the leap second stand 1 s later than whole days of 86400 s; the cubic moves by
// 1.2e-5 days, 1e-8 s in UT1 and 1e-8" in the pole.
TEST(EarthOrientationTableTest, CubicsAreReproducedAcrossTheLeapSecond) {
  const EarthOrientationTable table = EarthOrientationTable::parse(kCelestrak, "made_up.txt");
  for (const double d : {0.0, 0.25, 0.9, 1.0, 1.5, 1.999, 2.2, 3.7, 4.5, 5.0}) {
    const EarthOrientationParameters p = table.at(day(d));
    const double ut1_minus_tai_s = -36.4 - 0.001 * d + 0.0001 * d * d - 0.00001 * d * d * d;
    const double tai_minus_utc_s = day(d) < gps_midnight(2017, 1, 1) + 18s ? 36 : 37;
    EXPECT_NEAR(p.ut1_minus_utc_s, ut1_minus_tai_s + tai_minus_utc_s, 2e-8) << d;
    EXPECT_NEAR(p.x_pole_rad, kArcsecond_rad * (0.1 + 0.002 * d), 1e-7 * kArcsecond_rad) << d;
    EXPECT_NEAR(p.y_pole_rad, kArcsecond_rad * (0.3 - 0.001 * d * d), 2e-7 * kArcsecond_rad) << d;
    EXPECT_NEAR(p.dpsi_rad, kArcsecond_rad * (-0.11 - 0.001 * d), 1e-7 * kArcsecond_rad) << d;
    EXPECT_NEAR(p.deps_rad, kArcsecond_rad * (-0.01 - 0.0005 * d), 1e-7 * kArcsecond_rad) << d;
    EXPECT_NEAR(p.length_of_day_s, 1e-3 - 1e-4 * d, 1e-8) << d;
  }
}

TEST(EarthOrientationTableTest, RowsAreKeptInBothFormats) {
  for (const std::string& text : {kCelestrak, kFinals}) {
    const EarthOrientationTable table = EarthOrientationTable::parse(text, "made_up.txt");
    const EarthOrientationParameters p = table.at(day(1));
    EXPECT_NEAR(p.ut1_minus_utc_s, -0.40091, 2e-14);
    EXPECT_NEAR(p.x_pole_rad, 0.102 * kArcsecond_rad, 1e-20);
    EXPECT_NEAR(p.y_pole_rad, 0.299 * kArcsecond_rad, 1e-20);
    EXPECT_NEAR(p.length_of_day_s, 0.9e-3, 1e-18);
  }
}

TEST(EarthOrientationTableTest, CoverageEndsWithTheDataAndObservationsWithTheFlags) {
  const EarthOrientationTable celestrak = EarthOrientationTable::parse(kCelestrak, "made_up.txt");
  EXPECT_EQ(celestrak.first(), day(0));
  EXPECT_EQ(celestrak.last_observed(), day(3) + 1s);
  EXPECT_EQ(celestrak.last(), day(5) + 1s);
  const EarthOrientationTable finals = EarthOrientationTable::parse(kFinals, "made_up.txt");
  EXPECT_EQ(finals.last_observed(), day(2) + 1s);
  EXPECT_EQ(finals.last(), day(3) + 1s);
}

// UT1-TAI of the last two rows: 0.59763 - 37 and 0.59832 - 37 s, so that day was 0.69 ms long.
TEST(EarthOrientationTableTest, MissingLengthOfDayFollowsFromUt1) {
  const EarthOrientationTable table = EarthOrientationTable::parse(kFinals, "made_up.txt");
  EXPECT_NEAR(table.at(table.last()).length_of_day_s, 0.69e-3, 1e-13);
}

TEST(EarthOrientationTableTest, InstantsOutsideTheFileNameItsRange) {
  const EarthOrientationTable table = EarthOrientationTable::parse(kCelestrak, "made_up.txt");
  EXPECT_NO_THROW(table.at(table.first()));
  EXPECT_NO_THROW(table.at(table.last()));
  for (const SimTime t : {table.first() - 1ns, table.last() + 1ns, gps_midnight(2025, 3, 20)}) {
    try {
      table.at(t);
      ADD_FAILURE() << to_string(t);
    } catch (const std::out_of_range& error) {
      EXPECT_THAT(error.what(),
                  AllOf(HasSubstr(to_string(t)), HasSubstr("made_up.txt"),
                        HasSubstr("2016-12-30T00:00:17"), HasSubstr("2017-01-04T00:00:18")));
    }
  }
}

struct Defect {
  const char* name;
  std::string text;
  const char* line;
  const char* what;
};

void PrintTo(const Defect& defect, std::ostream* stream) {
  *stream << defect.name;
}

class EopDefectTest : public testing::TestWithParam<Defect> {};

TEST_P(EopDefectTest, IsRefusedWithSourceAndLine) {
  const Defect& defect = GetParam();
  EXPECT_THAT(refusal(defect.text),
              AllOf(HasSubstr("made_up.txt, " + std::string(defect.line)), HasSubstr(defect.what)));
}

const Defect kDefects[] = {
    {"CelestrakCutInARow", kCelestrak.substr(0, kCelestrak.find("2017 01 02") + 40), "line 9",
     "columns"},
    {"CelestrakCutBetweenRows", kCelestrak.substr(0, kCelestrak.find("2017 01 02")), "line 8",
     "END OBSERVED is missing"},
    {"CelestrakColumnMissing", with(kCelestrak, " 0.000100  0.000200  36\n", " 0.000100  36\n"),
     "line 6", "12 columns; accepted: 13"},
    {"CelestrakColumnTooMany", with(kCelestrak, "0.000200  36\n", "0.000200  36 1\n"), "line 6",
     "14 columns"},
    {"CelestrakNotANumber", with(kCelestrak, "0.299000", "0.2990x0"), "line 7", "'0.2990x0'"},
    {"CelestrakNan", with(kCelestrak, "0.299000", "nan"), "line 7", "'nan'"},
    {"CelestrakInfinite", with(kCelestrak, "0.299000", "inf"), "line 7", "'inf'"},
    {"CelestrakOverflow", with(kCelestrak, "0.299000", "1e999"), "line 7", "'1e999'"},
    {"CelestrakHuge", with(kCelestrak, "0.299000", "299000.0"), "line 7", "y of the pole"},
    {"CelestrakUt1Huge", with(kCelestrak, "0.5983200", "1.5983200"), "line 8", "UT1-UTC"},
    {"CelestrakLeapSecondWrong", with(kCelestrak, "0.000200  37", "0.000200  38"), "line 8",
     "ERFA"},
    {"CelestrakDayTwice", with(kCelestrak, "2016 12 31 57753", "2016 12 30 57752"), "line 7",
     "rows must be one day apart"},
    {"CelestrakDayMissing", without_line(kCelestrak, "2016 12 31"), "line 7",
     "MJD 57754 (2017-1-1) follows MJD 57752 (2016-12-30)"},
    {"CelestrakDateNotOfMjd", with(kCelestrak, "2016 12 31 57753", "2016 12 31 57754"), "line 7",
     "is not that of MJD 57754, 2017-1-1"},
    {"CelestrakMjdHuge", with(kCelestrak, " 57753 ", " 99999999999 "), "line 7", "MJD"},
    {"CelestrakCountWrong", with(kCelestrak, "NUM_OBSERVED_POINTS 4", "NUM_OBSERVED_POINTS 5"),
     "line 10", "has 4 rows; announced were 5"},
    {"CelestrakRowOutside", with(kCelestrak, "BEGIN PREDICTED\n", ""), "line 13",
     "neither a row nor a keyword"},
    {"CelestrakBinary", with(kCelestrak, "0.299000", std::string("\0\1\2", 3)), "line 7",
     "byte 0x00 at column 29"},
    {"CelestrakEmpty", "# nothing\n", "line 1", "no row"},
    {"FinalsEmpty", "", "line 0", "no row"},
    {"FinalsCutInARow", kFinals.substr(0, 250), "line 2", "cut short"},
    {"FinalsFieldMissing", with(kFinals, " 0.299000", "         "), "line 2", "y of the pole"},
    {"FinalsShifted", with(kFinals, "161231 57753.00 I  0.102000", "161231 57753.00  I  0.102000"),
     "line 2", "flag of the pole"},
    {"FinalsNotANumber", with(kFinals, "-0.4009100", "-0.4O09100"), "line 2", "UT1-UTC"},
    {"FinalsNan", with(kFinals, "  0.9000", "     nan"), "line 2", "length of day"},
    {"FinalsOneOffset", with(kFinals, "I     0.100", "I          "), "line 1", "one of dX and dY"},
    {"FinalsDayTwice", with(kFinals, "161231 57753", "161230 57752"), "line 2", "one day apart"},
    {"FinalsDateNotOfMjd", with(kFinals, "161231 57753", "161130 57753"), "line 2",
     "not that of MJD"},
    {"FinalsDataAfterTheEnd",
     kFinals + with(kFinals.substr(0, kFinals.find('\n') + 1), "161230 57752", "17 1 4 57757"),
     "line 6", "follows rows without"},
    {"FinalsBinary", std::string("\177ELF\0\0\0\n", 8), "line 1", "byte 0x7f"},
};

INSTANTIATE_TEST_SUITE_P(Defects, EopDefectTest, testing::ValuesIn(kDefects),
                         [](const auto& defect) { return std::string(defect.param.name); });

TEST(EarthOrientationTableTest, FewerThanFourRowsAreRefused) {
  const std::string three = kFinals.substr(0, kFinals.find("17 1 2"));
  EXPECT_THAT(refusal(three), HasSubstr("3 rows since 1980; at least 4"));
}

TEST(EarthOrientationTableTest, FilesThatCannotBeReadAreNamed) {
  try {
    EarthOrientationTable::load("/nowhere/eop.txt");
    ADD_FAILURE();
  } catch (const std::invalid_argument& error) {
    EXPECT_THAT(error.what(), HasSubstr("cannot read '/nowhere/eop.txt'"));
  }
  const std::string path = testing::TempDir() + "orrery_eop.txt.gz";
  std::ofstream(path, std::ios::binary) << "\x1f\x8b\x08 packed";
  try {
    EarthOrientationTable::load(path);
    ADD_FAILURE();
  } catch (const std::invalid_argument& error) {
    EXPECT_THAT(error.what(), HasSubstr("compressed"));
  }
  std::ofstream(path, std::ios::binary) << kCelestrak;
  EXPECT_EQ(EarthOrientationTable::load(path).first(), day(0));
  std::remove(path.c_str());
}

const std::string kLeapSeconds =
    " 1968 FEB  1 =JD 2439887.5  TAI-UTC=   4.2131700 S + (MJD - 39126.) X 0.002592 S\n"
    " 1972 JAN  1 =JD 2441317.5  TAI-UTC=  10.0       S + (MJD - 41317.) X 0.0      S\n"
    " 2017 JAN  1 =JD 2457754.5  TAI-UTC=  37.0       S + (MJD - 41317.) X 0.0S\n";

// MJD 41316.5: 4.21317 + (41316.5 - 39126) * 0.002592 = 9.890946 s.
TEST(LeapSecondTableTest, StepsAndDriftAreRead) {
  const LeapSecondTable table = LeapSecondTable::parse(kLeapSeconds, "made_up.txt");
  EXPECT_EQ(table.steps_mjd(), (std::vector<int>{39887, 41317, 57754}));
  EXPECT_NEAR(table.tai_minus_utc_s(41316.5), 9.890946, 1e-12);
  EXPECT_EQ(table.tai_minus_utc_s(41317), 10);
  EXPECT_EQ(table.tai_minus_utc_s(57753.999), 10);
  EXPECT_EQ(table.tai_minus_utc_s(57754), 37);
  EXPECT_THROW(table.tai_minus_utc_s(39886), std::out_of_range);
  EXPECT_THROW(table.tai_minus_utc_s(std::nan("")), std::out_of_range);
}

TEST(LeapSecondTableTest, DefectsAreRefusedWithTheirLine) {
  const auto refused = [](const std::string& text, const char* line, const char* what) {
    try {
      LeapSecondTable::parse(text, "made_up.txt");
      ADD_FAILURE() << text;
    } catch (const std::invalid_argument& error) {
      EXPECT_THAT(error.what(),
                  AllOf(HasSubstr(std::string("made_up.txt, ") + line), HasSubstr(what)));
    }
  };
  refused(with(kLeapSeconds, "2441317.5", "2441318.5"), "line 2", "Julian date");
  refused(with(kLeapSeconds, "1972 JAN", "1972 JNA"), "line 2", "month");
  refused(with(kLeapSeconds, "1972 JAN  1", "1972 FEB 30"), "line 2", "day 30");
  refused(with(kLeapSeconds, "  10.0  ", "  1O.0  "), "line 2", "'1O.0'");
  refused(with(kLeapSeconds, "TAI-UTC=", "TAI-UT1="), "line 1", "not a row");
  refused(kLeapSeconds + kLeapSeconds, "line 4", "not after");
  refused(kLeapSeconds.substr(0, 120), "line 2", "not a row");
  refused("", "line 0", "no row");
}

}  // namespace
}  // namespace orrery
