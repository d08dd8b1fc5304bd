#include <orrery/models/ephemeris/sp3.hpp>

#include <fstream>

#include "../../../validation/models/frames/reference_file.hpp"
#include "../ccsds/refusal.hpp"

namespace orrery {
namespace {

// Made up, in the columns of the standard's examples. 2017-01-01 is MJD 57754 and day 0 of GPS week
// 1930.
const std::string kHeader =
    "#cV2017  1  1  0  0  0.00000000       2 ORBIT ITRF  FIT ABCD\n"
    "## 1930      0.00000000    60.00000000 57754 0.0000000000000\n"
    "+    2   G01L74  0  0  0  0  0  0  0  0  0  0  0  0  0  0  0\n"
    "+          0  0  0  0  0  0  0  0  0  0  0  0  0  0  0  0  0\n"
    "+          0  0  0  0  0  0  0  0  0  0  0  0  0  0  0  0  0\n"
    "+          0  0  0  0  0  0  0  0  0  0  0  0  0  0  0  0  0\n"
    "+          0  0  0  0  0  0  0  0  0  0  0  0  0  0  0  0  0\n"
    "++         5  0  0  0  0  0  0  0  0  0  0  0  0  0  0  0  0\n"
    "++\n"
    "++         0  0  0  0  0  0  0  0  0  0  0  0  0  0  0  0  0\n"
    "++         0  0  0  0  0  0  0  0  0  0  0  0  0  0  0  0  0\n"
    "++         0  0  0  0  0  0  0  0  0  0  0  0  0  0  0  0  0\n"
    "%c M  cc TAI ccc cccc cccc cccc cccc ccccc ccccc ccccc ccccc\n"
    "%c cc cc ccc ccc cccc cccc cccc cccc ccccc ccccc ccccc ccccc\n"
    "%f  1.2500000  1.025000000  0.00000000000  0.000000000000000\n"
    "%f  0.0000000  0.000000000  0.00000000000  0.000000000000000\n"
    "%i    0    0    0    0      0      0      0      0         0\n"
    "%i    0    0    0    0      0      0      0      0         0\n"
    "/* made up\n"
    "/*\n"
    "/*\n"
    "/*\n";
const std::string kEpochs =
    "*  2017  1  1  0  0  0.00000000\n"
    "PG01  18392.619117   7490.690408 -17846.346485   -269.108429  7  6  8 110 EP  MP\n"
    "EP  55   55   55     222  1234567 -1234567  5999999      -30       21 -1230000\n"
    "VG01   1000.000000 -20000.500000  30000.000000      2.500000\n"
    "PL74   4752.036070  -1837.689740  -5070.496399 999999.999999\n"
    "VL74  40804.410781 -36660.184024  51567.816172 999999.999999\n"
    "*  2017  1  1  0  1  0.00000000\n"
    "PG01      0.000000      0.000000      0.000000 999999.999999\n"
    "VG01      0.000000      0.000000      0.000000 999999.999999\n"
    "PL74   4986.635758  -2055.026013  -4751.488814 999999.999999\n"
    "VL74  37371.549053 -35756.964223  54734.018734 999999.999999\n"
    "EOF\n";
const std::string kText = kHeader + kEpochs;

TEST(Sp3Test, ReadsHeader) {
  const Sp3 sp3 = parse_sp3(kText, "made_up.txt");
  EXPECT_EQ(sp3.start, gps_midnight(2017, 1, 1) - 19s);  // TAI = GPS + 19 s
  EXPECT_EQ(sp3.announced_epochs, 2);
  EXPECT_EQ(sp3.interval, 60s);
  EXPECT_TRUE(sp3.has_velocities);
  EXPECT_EQ(sp3.frame, "ITRF");
  EXPECT_EQ(sp3.agency, "ABCD");
  EXPECT_EQ(sp3.time_system, "TAI");
  EXPECT_THAT(sp3.comments, testing::ElementsAre("made up", "", "", ""));
  EXPECT_THAT(sp3.epochs, testing::ElementsAre(sp3.start, sp3.start + 60s));
}

TEST(Sp3Test, UnitsBecomeSi) {
  const Sp3 sp3 = parse_sp3(kText, "made_up.txt");
  const Sp3Satellite& g01 = sp3.satellite("G01");
  EXPECT_DOUBLE_EQ(g01.accuracy_m.value(), 0.032);  // 2^5 mm
  const Sp3Record& first = g01.records.front();
  EXPECT_DOUBLE_EQ(first.r_ECEF.x, 18392619.117);
  EXPECT_DOUBLE_EQ(first.r_ECEF.z, -17846346.485);
  EXPECT_DOUBLE_EQ(first.v_ECEF.value().y, -2000.05);
  EXPECT_DOUBLE_EQ(first.clock_s.value(), -269.108429e-6);
  EXPECT_DOUBLE_EQ(first.clock_rate.value(), 2.5e-10);
  EXPECT_TRUE(first.clock_event && first.clock_predicted && first.maneuver &&
              first.orbit_predicted);
}

TEST(Sp3Test, WhatIsMarkedMissingIsLeftOut) {
  const Sp3 sp3 = parse_sp3(kText, "made_up.txt");
  EXPECT_EQ(sp3.satellite("G01").records.size(), 1u);
  const Sp3Satellite& l74 = sp3.satellite("L74");
  ASSERT_EQ(l74.records.size(), 2u);
  EXPECT_FALSE(l74.accuracy_m || l74.records[0].clock_s || l74.records[0].clock_rate);
  EXPECT_EQ(l74.records[1].t, sp3.start + 60s);
}

TEST(Sp3Test, WindowsLineEndsAndTimeSystemsAreUnderstood) {
  std::string windows;
  for (const char c : kText) windows += c == '\n' ? std::string("\r\n") : std::string(1, c);
  EXPECT_EQ(parse_sp3(windows, "made_up.txt").satellite("L74").records[1].r_ECEF,
            parse_sp3(kText, "made_up.txt").satellite("L74").records[1].r_ECEF);
  EXPECT_EQ(parse_sp3(with(kText, "TAI", "GPS"), "made_up.txt").start, gps_midnight(2017, 1, 1));
  // A leap second ended on that day: TAI - UTC = 37 s.
  EXPECT_EQ(parse_sp3(with(kText, "TAI", "UTC"), "made_up.txt").start,
            gps_midnight(2017, 1, 1) + 18s);
}

TEST(Sp3Test, ExcerptsAreReadOnRequest) {
  const std::string text = with(kText, "       2 ORBIT", "       9 ORBIT");
  EXPECT_EQ(parse_sp3(text, "made_up.txt", {.excerpt = true}).announced_epochs, 9);
  expect_refused([](auto input, auto source) { return parse_sp3(input, source); },
                 {"fewer", text, line_of(text, "EOF"), "2 epochs; the header announces 9"});
  const std::string shifted = with(text, "*  2017  1  1  0  1", "*  2017  1  1  0  3");
  EXPECT_EQ(parse_sp3(shifted, "made_up.txt", {.excerpt = true}).epochs[1],
            parse_sp3(text, "made_up.txt", {.excerpt = true}).start + 3min);
}

struct Sp3DefectTest : testing::TestWithParam<Defect> {};

TEST_P(Sp3DefectTest, IsRefusedWithLineAndReason) {
  expect_refused([](auto input, auto source) { return parse_sp3(input, source); }, GetParam());
}

Defect replaced(const char* name, const std::string& old_part, const std::string& new_part,
                const char* what) {
  return {name, with(kText, old_part, new_part), line_of(kText, old_part), what};
}

std::string until(const std::string& part) {
  return kText.substr(0, kText.find(part));
}

INSTANTIATE_TEST_SUITE_P(
    Header, Sp3DefectTest,
    testing::Values(
        Defect{"Empty", "", 0, "cut short"}, replaced("VersionA", "#cV", "#aV", "accepted: #c"),
        replaced("NoMode", "#cV", "#cX", "accepted: P, V"),
        replaced("Year", "#cV2017", "#cV1917", "year is '1917'"),
        replaced("NoDate", "2017  1  1  0  0  0.00000000       2",
                 "2017  2 30  0  0  0.00000000       2", "is not a date"),
        replaced("Epochs", "       2 ORBIT", "      -2 ORBIT", "number of epochs is '-2'"),
        replaced("Week", "## 1930", "## 1931", "week and second of week are not the start"),
        replaced("Mjd", "57754", "57755", "Modified Julian Date is not the start"),
        replaced("Interval", "   60.00000000", "    0.00000000", "interval = 0 s"),
        replaced("IntervalNan", "   60.00000000", "           nan", "not a finite number"),
        replaced("TooManySatellites", "+    2", "+   99", "number of satellites is '99'"),
        replaced("TwiceTheSame", "G01L74", "L74L74", "listed twice"),
        replaced("IdWithBlank", "G01L74", "G01L  ", "satellite identifier"),
        replaced("Accuracy", "++         5", "++        -5", "accuracy code is '-5'"),
        replaced("TimeSystem", "TAI", "GLO", "accepted: GPS, TAI, UTC"),
        replaced("LineMissing", "%f  0.0000000  0.000000000  0.00000000000  0.000000000000000\n",
                 "", "begins with '%f'")),
    [](const auto& test) { return std::string(test.param.name); });

INSTANTIATE_TEST_SUITE_P(
    Epochs, Sp3DefectTest,
    testing::Values(
        replaced("NotOnTheGrid", "*  2017  1  1  0  1  0.0", "*  2017  1  1  0  1  1.0",
                 "epoch 2 is 61 s after the start"),
        replaced("Second", "*  2017  1  1  0  1  0.0", "*  2017  1  1  0  1 60.0",
                 "no second of that minute"),
        replaced("UnknownSatellite", "PL74", "PL75", "'PL75'; accepted here: PL74"),
        replaced("VelocityMissing",
                 "VL74  40804.410781 -36660.184024  51567.816172 999999.999999\n", "",
                 "accepted here: VL74"),
        replaced("NotANumber", "-1837.689740", "-1837.68974x", "position [km] is '-1837.68974x'"),
        replaced("NotFinite", " -1837.689740", "          inf", "not a finite number"),
        replaced("Huge", "  -1837.689740", "-91837689.7400", "outside +-999999"),
        replaced("ShortRecord", "-5070.496399 999999.999999", "-5070.496399", "cut short"),
        replaced("Binary", "-1837",
                 std::string("-18\0"
                             "7",
                             5),
                 "is not printable ASCII"),
        Defect{"CutInARecord", until("-5070.49"), line_of(kText, "-5070.49"), "cut short"},
        Defect{"NoEof", until("EOF"), line_of(kText, "EOF") - 1, "cut short"},
        Defect{"NoLineEnd", kText.substr(0, kText.size() - 1), line_of(kText, "EOF"), "cut short"},
        Defect{"Beyond", kText + "PL74\n", line_of(kText, "EOF") + 1, "follows EOF"},
        Defect{"NoEpoch", kHeader + "EOF\n", line_of(kText, "*  2017"), "no epoch"},
        replaced("Strange", "EOF", "*2017", "accepted here: an epoch")),
    [](const auto& test) { return std::string(test.param.name); });

TEST(Sp3Test, UnknownSatelliteIsNamedWithTheKnownOnes) {
  try {
    parse_sp3(kText, "made_up.txt").satellite("G02");
    FAIL() << "accepted";
  } catch (const std::out_of_range& error) {
    EXPECT_THAT(error.what(),
                testing::AllOf(testing::HasSubstr("'G02'"), testing::HasSubstr("G01 L74")));
  }
}

TEST(Sp3Test, FilesThatCannotBeReadAreNamed) {
  try {
    load_sp3("/no/such/file.sp3");
    FAIL() << "accepted";
  } catch (const std::invalid_argument& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("'/no/such/file.sp3'"));
  }
}

// Read off the files by eye.
TEST(Sp3ReferenceTest, SentinelAndIgsFilesComeBackAsPrinted) {
  const auto sentinel_text = reference_text("leo_pod/sentinel3a_2018-12-25_27.sp3.gz");
  const auto igs_text = reference_text("gps/igs15904.sp3");
  if (!sentinel_text || !igs_text) GTEST_SKIP() << "no leo_pod/, gps/ in " << ORRERY_REFERENCE_DATA;
  const Sp3 sentinel = parse_sp3(*sentinel_text, "sentinel", {.excerpt = true});
  EXPECT_EQ(sentinel.epochs.size(), 4320u);
  EXPECT_EQ(sentinel.epochs.front(), gps_midnight(2018, 12, 25) - 19s);
  EXPECT_DOUBLE_EQ(sentinel.satellite("L74").records.back().r_ECEF.x, -3513014.478);
  EXPECT_DOUBLE_EQ(sentinel.satellite("L74").records.back().v_ECEF.value().z, -4624.1112669);
  const Sp3 igs = parse_sp3(*igs_text, "igs");
  EXPECT_EQ(igs.satellites.size(), 32u);
  EXPECT_EQ(igs.epochs.size(), 96u);
  EXPECT_FALSE(igs.satellite("G01").accuracy_m);
  EXPECT_DOUBLE_EQ(igs.satellite("G02").accuracy_m.value(), 0.004);
  EXPECT_DOUBLE_EQ(igs.satellite("G02").records.front().clock_s.value(), 269.108429e-6);
}

}  // namespace
}  // namespace orrery
