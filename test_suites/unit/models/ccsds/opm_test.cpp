#include <orrery/models/ccsds/opm.hpp>

#include <cmath>
#include <cstdio>
#include <fstream>

#include "refusal.hpp"

namespace orrery {
namespace {

// Made up. Everything that an OPM can have, written as write_opm writes it.
const std::string kFull = R"(CCSDS_OPM_VERS = 2.0
COMMENT of the header
CLASSIFICATION = public
CREATION_DATE = 2025-03-19T12:00:00
ORIGINATOR = ORRERY
MESSAGE_ID = OPM 1
COMMENT of the metadata
COMMENT
OBJECT_NAME = DSC ONE
OBJECT_ID = 2025-001A
CENTER_NAME = EARTH
REF_FRAME = EME2000
REF_FRAME_EPOCH = 2000-01-01T11:58:55.816
TIME_SYSTEM = UTC
COMMENT of the state
EPOCH = 2025-03-20T00:00:00.000000001
X = 6928.137
Y = 0
Z = -1e-300
X_DOT = 0.1
Y_DOT = -7.585
Z_DOT = 0.30000000000000004
COMMENT of the elements
SEMI_MAJOR_AXIS = 6928.137
ECCENTRICITY = 0.001
INCLINATION = 97.59
RA_OF_ASC_NODE = 314.5
ARG_OF_PERICENTER = 90
MEAN_ANOMALY = 270
GM = 398600.4415
COMMENT of the spacecraft
MASS = 11
SOLAR_RAD_AREA = 0.06
SOLAR_RAD_COEFF = 1.8
DRAG_AREA = 0.06
DRAG_COEFF = 2.2
COMMENT of the covariance
COV_REF_FRAME = RTN
CX_X = 1
CY_X = 2
CY_Y = 3
CZ_X = 4
CZ_Y = 5
CZ_Z = 6
CX_DOT_X = 7
CX_DOT_Y = 8
CX_DOT_Z = 9
CX_DOT_X_DOT = 10
CY_DOT_X = 11
CY_DOT_Y = 12
CY_DOT_Z = 13
CY_DOT_X_DOT = 14
CY_DOT_Y_DOT = 15
CZ_DOT_X = 16
CZ_DOT_Y = 17
CZ_DOT_Z = 18
CZ_DOT_X_DOT = 19
CZ_DOT_Y_DOT = 20
CZ_DOT_Z_DOT = 21
COMMENT of the first maneuver
MAN_EPOCH_IGNITION = 2025-03-20T01:00:00
MAN_DURATION = 132.6
MAN_DELTA_MASS = -0.01
MAN_REF_FRAME = EME2000
MAN_DV_1 = 1e-05
MAN_DV_2 = -2e-05
MAN_DV_3 = 3e-05
MAN_EPOCH_IGNITION = 2025-03-20T02:00:00
MAN_REF_FRAME = TNW
MAN_DV_1 = 0.001
MAN_DV_2 = 0
MAN_DV_3 = 0
USER_DEFINED_EARTH_MODEL = WGS-84
)";

const std::string kSmall = R"(CCSDS_OPM_VERS = 3.0
CREATION_DATE = 2025-03-19T12:00:00
ORIGINATOR = ORRERY
OBJECT_NAME = OSC
OBJECT_ID = 2025-001B
CENTER_NAME = Earth
REF_FRAME = J2000
TIME_SYSTEM = GPS

EPOCH = 2025-079T00:00:00
X     = 6928.137  [km]
Y     = 0.0       [km]
Z     = 0         [km]
X_DOT = 0         [km/s]
Y_DOT = +1.0E0    [km/s]
Z_DOT = 7.5       [km/s]
)";

TEST(OpmTest, EveryFieldIsRead) {
  const Opm opm = parse_opm(kFull, "made_up.txt");
  EXPECT_EQ(opm.header.version, "2.0");
  EXPECT_EQ(opm.header.comments, std::vector<std::string>{"of the header"});
  EXPECT_EQ(opm.header.classification, "public");
  EXPECT_EQ(to_text(opm.header.creation_date), "2025-03-19T12:00:00");
  EXPECT_EQ(opm.header.originator, "ORRERY");
  EXPECT_EQ(opm.header.message_id, "OPM 1");
  EXPECT_EQ(opm.metadata.comments, (std::vector<std::string>{"of the metadata", ""}));
  EXPECT_EQ(opm.metadata.object_name, "DSC ONE");
  EXPECT_EQ(opm.metadata.object_id, "2025-001A");
  EXPECT_EQ(opm.metadata.center_name, "EARTH");
  EXPECT_EQ(opm.metadata.ref_frame, "EME2000");
  EXPECT_EQ(to_text(opm.metadata.ref_frame_epoch.value()), "2000-01-01T11:58:55.816");
  EXPECT_EQ(opm.metadata.time_system, TimeSystem::kUTC);
  EXPECT_EQ(opm.state.r_km, (Vec3{6928.137, 0, -1e-300}));
  EXPECT_EQ(opm.state.v_kmps, (Vec3{0.1, -7.585, 0.30000000000000004}));
  ASSERT_TRUE(opm.keplerian);
  EXPECT_EQ(opm.keplerian->a_km, 6928.137);
  EXPECT_EQ(opm.keplerian->e, 0.001);
  EXPECT_EQ(opm.keplerian->i_deg, 97.59);
  EXPECT_EQ(opm.keplerian->raan_deg, 314.5);
  EXPECT_EQ(opm.keplerian->argument_of_pericentre_deg, 90);
  EXPECT_EQ(opm.keplerian->anomaly_deg, 270);
  EXPECT_FALSE(opm.keplerian->anomaly_is_true);
  EXPECT_EQ(opm.keplerian->gm_km3ps2, 398600.4415);
  ASSERT_TRUE(opm.spacecraft);
  EXPECT_EQ(opm.spacecraft->mass_kg, 11);
  EXPECT_EQ(opm.spacecraft->solar_radiation_area_m2, 0.06);
  EXPECT_EQ(opm.spacecraft->solar_radiation_coefficient, 1.8);
  EXPECT_EQ(opm.spacecraft->drag_area_m2, 0.06);
  EXPECT_EQ(opm.spacecraft->drag_coefficient, 2.2);
  ASSERT_TRUE(opm.covariance);
  EXPECT_EQ(opm.covariance->ref_frame, "RTN");
  for (std::size_t i = 0; i < 21; ++i)
    EXPECT_EQ(opm.covariance->lower_triangle[i], static_cast<double>(i + 1));
  ASSERT_EQ(opm.maneuvers.size(), 2u);
  EXPECT_EQ(opm.maneuvers[0].duration_s, 132.6);
  EXPECT_EQ(opm.maneuvers[0].delta_mass_kg, -0.01);
  EXPECT_EQ(opm.maneuvers[0].ref_frame, "EME2000");
  EXPECT_EQ(opm.maneuvers[0].dv_kmps, (Vec3{1e-5, -2e-5, 3e-5}));
  EXPECT_EQ(to_text(opm.maneuvers[1].ignition), "2025-03-20T02:00:00");
  EXPECT_EQ(opm.maneuvers[1].duration_s, std::nullopt);
  ASSERT_EQ(opm.user_defined.size(), 1u);
  EXPECT_EQ(opm.user_defined[0], (std::pair<std::string, std::string>{"EARTH_MODEL", "WGS-84"}));
}

TEST(OpmTest, WritingGivesTheSameBytes) {
  EXPECT_EQ(write_opm(parse_opm(kFull, "made_up.txt")), kFull);
}

TEST(OpmTest, WhatIsWrittenReadsBackEqual) {
  const Opm small = parse_opm(kSmall, "made_up.txt");
  EXPECT_EQ(parse_opm(write_opm(small), "written"), small);
}

TEST(OpmTest, LineEndsOfOtherSystemsAndAMissingLastOneAreAccepted) {
  std::string crlf;
  for (const char c : kSmall) crlf += c == '\n' ? std::string("\r\n") : std::string(1, c);
  crlf.resize(crlf.size() - 2);
  EXPECT_EQ(parse_opm(crlf, "made_up.txt"), parse_opm(kSmall, "made_up.txt"));
}

// Kilometres times 1000, rounded once; day 79 of 2025 is 20 March.
TEST(OpmTest, StateIsInMetresAndGpsTime) {
  const OrbitState small = state_of(parse_opm(kSmall, "made_up.txt"));
  EXPECT_EQ(small.t, gps_midnight(2025, 3, 20));
  EXPECT_EQ(small.r_ECI, (Vec3{6928137, 0, 0}));
  EXPECT_EQ(small.v_ECI, (Vec3{0, 1000, 7500}));
  EXPECT_EQ(small.mass_kg, 0);
  const OrbitState full = state_of(parse_opm(kFull, "made_up.txt"));
  EXPECT_EQ(full.t, gps_midnight(2025, 3, 20) + 18s + 1ns);
  EXPECT_EQ(full.mass_kg, 11);
}

TEST(OpmTest, StateInAnotherFrameIsLeftToTheCaller) {
  for (const auto& [old_part, new_part] :
       {std::pair{"REF_FRAME = J2000", "REF_FRAME = ITRF2014"}, {"= Earth", "= MOON"}}) {
    const Opm opm = parse_opm(with(kSmall, old_part, new_part), "made_up.txt");
    EXPECT_FALSE(is_geocentric_eme2000(opm.metadata));
    EXPECT_THROW(state_of(opm), std::invalid_argument);
  }
}

TEST(OpmTest, WriterRefusesWhatCannotBeReadBack) {
  const auto refused = [](auto spoil, const char* what) {
    Opm opm = parse_opm(kFull, "made_up.txt");
    spoil(opm);
    try {
      write_opm(opm);
      ADD_FAILURE() << what;
    } catch (const std::invalid_argument& error) {
      EXPECT_THAT(error.what(),
                  testing::AllOf(testing::HasSubstr("write_opm"), testing::HasSubstr(what)));
    }
  };
  refused([](Opm& opm) { opm.state.r_km.x = std::nan(""); }, "X is nan");
  refused([](Opm& opm) { opm.keplerian->gm_km3ps2 = INFINITY; }, "GM is inf");
  refused([](Opm& opm) { opm.metadata.object_name = "A\nCOMMENT B"; }, "OBJECT_NAME");
  refused([](Opm& opm) { opm.metadata.object_name = ""; }, "OBJECT_NAME");
  refused([](Opm& opm) { opm.metadata.object_id = "two words"; }, "OBJECT_ID");
  refused([](Opm& opm) { opm.metadata.ref_frame = "MY_FRAME"; }, "REF_FRAME");
  refused([](Opm& opm) { opm.header.comments = {"a\nb"}; }, "COMMENT");
  refused([](Opm& opm) { opm.spacecraft->mass_kg = -1; }, "MASS");
  refused([](Opm& opm) { opm.user_defined[0].first = "lower case"; }, "not a keyword");
}

TEST(OpmTest, FilesAreLoadedOrNamed) {
  const std::string path = testing::TempDir() + "orrery_opm.txt";
  std::ofstream(path, std::ios::binary) << kFull;
  EXPECT_EQ(load_opm(path), parse_opm(kFull, "made_up.txt"));
  std::remove(path.c_str());
  EXPECT_THROW(load_opm(path), std::invalid_argument);
}

// A cut at a line end is found as long as the state is not complete; after it blocks are optional,
// but none may be half there.
TEST(OpmTest, CutBetweenLinesIsFoundWithinABlock) {
  int whole = 0;
  for (std::size_t end = kFull.find('\n') + 1; end < kFull.size();
       end = kFull.find('\n', end) + 1) {
    try {
      parse_opm(kFull.substr(0, end), "made_up.txt");
      ++whole;
    } catch (const std::invalid_argument& error) {
      EXPECT_THAT(error.what(), testing::HasSubstr("cut short"));
    }
  }
  // After: the state; its next comment; the elements and theirs; 5 spacecraft parameters and the
  // comment; the covariance and its; the first maneuver; the second.
  EXPECT_EQ(whole, 2 + 2 + 6 + 2 + 1 + 1);
}

class OpmDefectTest : public testing::TestWithParam<Defect> {};

TEST_P(OpmDefectTest, IsRefusedWithSourceAndLine) {
  expect_refused(parse_opm, GetParam());
}

const Defect kDefects[] = {
    {"Empty", "", 0, "empty"},
    {"Xml", "<?xml version=\"1.0\"?>\n", 1, "XML"},
    {"AnotherMessage", with(kSmall, "OPM", "OMM"), 1, "'CCSDS_OMM_VERS'; accepted: CCSDS_OPM_VERS"},
    {"Version", with(kSmall, "3.0", "4.0"), 1, "version '4.0'"},
    {"Binary", with(kSmall, "ORRERY", std::string("OR\0ERY", 6)), 3, "byte 0x00 at column 16"},
    {"Utf8", with(kSmall, "[km]", "[k\xc3\xb8]"), 11, "byte 0xc3"},
    {"CreationDateMissing", with(kSmall, "CREATION_DATE = 2025-03-19T12:00:00\n", ""), 2,
     "accepted: CREATION_DATE"},
    {"CreationDateWrong", with(kSmall, "03-19T", "02-29T"), 2, "not an epoch"},
    {"NoValue", with(kSmall, "= ORRERY", "="), 3, "has no value"},
    {"NoEqualsSign", with(kSmall, "ORIGINATOR = ORRERY", "ORIGINATOR"), 3, "has no value"},
    {"LastLineWithoutValue", kFull + "USER_DEFINED_B", line_of(kFull, "USER_DEFINED") + 1,
     "has no value"},
    {"LowerCaseKeyword", with(kSmall, "ORIGINATOR", "Originator"), 3, "not a keyword"},
    {"ObjectIdWithBlanks", with(kSmall, "2025-001B", "to be given"), 5, "OBJECT_ID"},
    {"Centre", with(kSmall, "= Earth", "= VULCAN"), 6, "CENTER_NAME 'VULCAN'"},
    {"Frame", with(kSmall, "J2000", "MINE"), 7, "REF_FRAME 'MINE'"},
    {"LocalFrameForTheState", with(kSmall, "J2000", "RTN"), 7, "REF_FRAME 'RTN'"},
    {"ItrfYear", with(kSmall, "J2000", "ITRF2O14"), 7, "REF_FRAME"},
    {"TimeSystem", with(kSmall, "= GPS", "= GMT"), 8, "TIME_SYSTEM 'GMT'"},
    {"MetadataMissing", with(kSmall, "TIME_SYSTEM = GPS\n", ""), 9, "end without TIME_SYSTEM"},
    {"MetadataTwice", with(kSmall, "TIME_SYSTEM = GPS\n", "OBJECT_NAME = OSC\n"), 8,
     "OBJECT_NAME is given twice"},
    {"UnknownKeyword", with(kSmall, "OBJECT_NAME", "OBJECT_NOME"), 4,
     "OBJECT_NOME is not expected"},
    {"Epoch", with(kSmall, "2025-079T00", "2025-079T25"), 10, "EPOCH: '2025-079T25:00:00'"},
    {"Order", with(with(kSmall, "X  ", "W  "), "Y  ", "X  "), 11,
     "W is not expected here; accepted: X"},
    {"NotANumber", with(kSmall, "6928.137", "6928,137"), 11,
     "X: '6928,137' is not a finite number"},
    {"Nan", with(kSmall, "6928.137", "nan"), 11, "'nan'"},
    {"Infinite", with(kSmall, "6928.137", "-inf"), 11, "'-inf'"},
    {"Overflow", with(kSmall, "6928.137", "1e400"), 11, "'1e400'"},
    {"Hexadecimal", with(kSmall, "6928.137", "0x1b"), 11, "'0x1b'"},
    {"TwoSigns", with(kSmall, "6928.137", "+-1"), 11, "'+-1'"},
    {"Metres", with(kSmall, "[km]", "[m]"), 11, "unit of X is '[m]'; accepted: [km]"},
    {"UnitNotClosed", with(kSmall, "[km]", "[km"), 11, "unit of X"},
    {"UnitForANumber", with(kFull, "ECCENTRICITY = 0.001", "ECCENTRICITY = 0.001 [n/a]"),
     line_of(kFull, "ECCENTRICITY"), "has no unit"},
    {"NegativeMass", with(kFull, "MASS = 11", "MASS = -11"), line_of(kFull, "MASS"),
     "not negative"},
    {"CovarianceTerm", with(kFull, "CZ_DOT_X = 16\n", ""), line_of(kFull, "CZ_DOT_X"),
     "accepted: CZ_DOT_X"},
    {"ManeuverFrame", with(kFull, "= TNW", "= TNV"), line_of(kFull, "= TNW"),
     "MAN_REF_FRAME 'TNV'"},
    {"BlocksOutOfOrder", kFull + "MASS = 11\n", line_of(kFull, "USER_DEFINED") + 1, "MASS"},
    {"StrayData", kSmall + "1 2 3\n", 17, "'1 2 3'"},
    {"StrayWord", kSmall + "META_STOP\n", 17, "META_STOP"}};

INSTANTIATE_TEST_SUITE_P(Defects, OpmDefectTest, testing::ValuesIn(kDefects),
                         [](const auto& defect) { return std::string(defect.param.name); });

}  // namespace
}  // namespace orrery
