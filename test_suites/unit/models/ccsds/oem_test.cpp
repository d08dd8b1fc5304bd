#include <orrery/models/ccsds/oem.hpp>

#include <cmath>

#include "refusal.hpp"

namespace orrery {
namespace {

// Made up. Everything that an OEM can have, written as write_oem writes it.
const std::string kFull = R"(CCSDS_OEM_VERS = 3.0
COMMENT of the header
CREATION_DATE = 2025-03-19T12:00:00
ORIGINATOR = ORRERY
MESSAGE_ID = OEM 1

META_START
COMMENT of the metadata
OBJECT_NAME = DSC
OBJECT_ID = 2025-001A
CENTER_NAME = EARTH
REF_FRAME = EME2000
REF_FRAME_EPOCH = 2000-01-01T11:58:55.816
TIME_SYSTEM = UTC
START_TIME = 2025-03-20T00:00:00
USEABLE_START_TIME = 2025-03-20T00:00:30
USEABLE_STOP_TIME = 2025-03-20T00:01:30
STOP_TIME = 2025-03-20T00:02:00
INTERPOLATION = HERMITE
INTERPOLATION_DEGREE = 7
META_STOP
COMMENT of the data
2025-03-20T00:00:00 6928.137 0 -1e-300 0.1 -7.585 0.30000000000000004
2025-03-20T00:01:00.000000001 6900 1 2 3 4 5 1e-05 -2e-05 3e-05
COVARIANCE_START
COMMENT of the covariance
EPOCH = 2025-03-20T00:00:00
COV_REF_FRAME = RTN
1
2 3
4 5 6
7 8 9 10
11 12 13 14 15
16 17 18 19 20 21
EPOCH = 2025-03-20T00:01:00
1
2 3
4 5 6
7 8 9 10
11 12 13 14 15
16 17 18 19 20 21.5
COVARIANCE_STOP

META_START
OBJECT_NAME = DSC
OBJECT_ID = 2025-001A
CENTER_NAME = EARTH
REF_FRAME = ITRF2014
TIME_SYSTEM = UTC
START_TIME = 2025-03-20T00:02:00
STOP_TIME = 2025-03-20T00:03:00
META_STOP
2025-03-20T00:02:00 1 2 3 4 5 6
)";

const std::string kSmall = R"(CCSDS_OEM_VERS = 1.0
CREATION_DATE = 2025-03-19T12:00:00
ORIGINATOR = ORRERY
META_START
OBJECT_NAME = OSC
OBJECT_ID = 2025-001B
CENTER_NAME = Earth
REF_FRAME = EME2000
TIME_SYSTEM = GPS
START_TIME = 2025-079T00:00:00
STOP_TIME = 2025-079T00:02:00
META_STOP
2025-079T00:00:00   6928.137 0 0   0 0 7.5
2025-079T00:01:00	6900.0	0	450.0	-0.5	0	7.4
2025-079T00:02:00  +6.8E+003 0 900 -1.0 0 7.3)";

TEST(OemTest, EveryFieldIsRead) {
  const Oem oem = parse_oem(kFull, "made_up.txt");
  EXPECT_EQ(oem.header.message_id, "OEM 1");
  ASSERT_EQ(oem.segments.size(), 2u);
  const OemSegment& s = oem.segments[0];
  EXPECT_EQ(s.metadata.comments, std::vector<std::string>{"of the metadata"});
  EXPECT_EQ(s.metadata.object_name, "DSC");
  EXPECT_EQ(s.metadata.object_id, "2025-001A");
  EXPECT_EQ(s.metadata.center_name, "EARTH");
  EXPECT_EQ(s.metadata.ref_frame, "EME2000");
  EXPECT_EQ(s.metadata.time_system, TimeSystem::kUTC);
  EXPECT_EQ(to_text(s.metadata.start_time), "2025-03-20T00:00:00");
  EXPECT_EQ(to_text(s.metadata.useable_start_time.value()), "2025-03-20T00:00:30");
  EXPECT_EQ(to_text(s.metadata.useable_stop_time.value()), "2025-03-20T00:01:30");
  EXPECT_EQ(to_text(s.metadata.stop_time), "2025-03-20T00:02:00");
  EXPECT_EQ(s.metadata.interpolation, InterpolationMethod::kHermite);
  EXPECT_EQ(s.metadata.interpolation_degree, 7);
  EXPECT_EQ(s.comments, std::vector<std::string>{"of the data"});
  ASSERT_EQ(s.states.size(), 2u);
  EXPECT_EQ(s.states[0].r_km, (Vec3{6928.137, 0, -1e-300}));
  EXPECT_EQ(s.states[0].v_kmps, (Vec3{0.1, -7.585, 0.30000000000000004}));
  EXPECT_EQ(s.states[0].a_kmps2, std::nullopt);
  EXPECT_EQ(to_text(s.states[1].epoch), "2025-03-20T00:01:00.000000001");
  EXPECT_EQ(s.states[1].a_kmps2, (Vec3{1e-5, -2e-5, 3e-5}));
  EXPECT_EQ(s.covariance_comments, std::vector<std::string>{"of the covariance"});
  ASSERT_EQ(s.covariances.size(), 2u);
  EXPECT_EQ(s.covariances[0].ref_frame, "RTN");
  for (std::size_t i = 0; i < 21; ++i)
    EXPECT_EQ(s.covariances[0].lower_triangle[i], static_cast<double>(i + 1));
  EXPECT_EQ(s.covariances[1].ref_frame, std::nullopt);
  EXPECT_EQ(s.covariances[1].lower_triangle[20], 21.5);
  EXPECT_EQ(oem.segments[1].metadata.ref_frame, "ITRF2014");
  EXPECT_FALSE(is_geocentric_eme2000(oem.segments[1].metadata));
}

TEST(OemTest, WritingGivesTheSameBytes) {
  EXPECT_EQ(write_oem(parse_oem(kFull, "made_up.txt")), kFull);
}

TEST(OemTest, WhatIsWrittenReadsBackEqual) {
  const Oem small = parse_oem(kSmall, "made_up.txt");
  ASSERT_EQ(small.segments[0].states.size(), 3u);
  EXPECT_EQ(small.segments[0].states[2].r_km, (Vec3{6800, 0, 900}));
  EXPECT_EQ(parse_oem(write_oem(small), "written"), small);
}

TEST(OemTest, LineRepeatedExactlyCountsOnce) {
  const std::string line = "2025-079T00:00:00   6928.137 0 0   0 0 7.5\n";
  EXPECT_EQ(parse_oem(with(kSmall, line, line + line), "made_up.txt"),
            parse_oem(kSmall, "made_up.txt"));
}

TEST(OemTest, CommentsAmongTheDataAreKept) {
  const Oem oem = parse_oem(
      with(kSmall, "2025-079T00:01", "COMMENT half way\n2025-079T00:01") + "\nCOMMENT the end",
      "made_up.txt");
  EXPECT_EQ(oem.segments[0].comments, (std::vector<std::string>{"half way", "the end"}));
}

TEST(OemTest, WriterRefusesWhatCannotBeReadBack) {
  const auto refused = [](auto spoil, const char* what) {
    Oem oem = parse_oem(kFull, "made_up.txt");
    spoil(oem);
    try {
      write_oem(oem);
      ADD_FAILURE() << what;
    } catch (const std::invalid_argument& error) {
      EXPECT_THAT(error.what(),
                  testing::AllOf(testing::HasSubstr("write_oem"), testing::HasSubstr(what)));
    }
  };
  refused([](Oem& oem) { oem.segments.clear(); }, "META_START");
  refused([](Oem& oem) { oem.segments[1].states.clear(); }, "without ephemeris data");
  refused([](Oem& oem) { oem.segments[0].states[1].v_kmps.y = std::nan(""); }, "nan");
  refused([](Oem& oem) { oem.segments[0].covariances[0].lower_triangle[3] = INFINITY; }, "inf");
  refused([](Oem& oem) { std::swap(oem.segments[0].states[0], oem.segments[0].states[1]); },
          "does not follow");
  refused([](Oem& oem) { oem.segments[1].metadata.time_system = TimeSystem::kTAI; }, "TIME_SYSTEM");
  refused([](Oem& oem) { oem.segments[0].metadata.interpolation_degree = 0; },
          "INTERPOLATION_DEGREE");
}

class OemDefectTest : public testing::TestWithParam<Defect> {};

TEST_P(OemDefectTest, IsRefusedWithSourceAndLine) {
  expect_refused(parse_oem, GetParam());
}

const Defect kDefects[] = {
    {"Empty", "\n\n", 2, "empty"},
    {"HeaderAlone", kSmall.substr(0, kSmall.find("META_START")), 3, "META_START is missing"},
    {"CutInMetadata", kSmall.substr(0, kSmall.find("STOP_TIME")), 10, "cut short"},
    {"CutBeforeData", kSmall.substr(0, kSmall.find("2025-079T00:00:00  ")), 12,
     "without ephemeris data"},
    {"CutInALine", kSmall.substr(0, kSmall.find("450")), 14, "columns; accepted: 7"},
    {"CutInACovariance", kFull.substr(0, kFull.find("7 8 9 10\n")), line_of(kFull, "4 5 6"),
     "cut short"},
    {"CutBeforeCovarianceStop", kFull.substr(0, kFull.find("EPOCH = 2025-03-20T00:01:00")),
     line_of(kFull, "16 17"), "COVARIANCE_STOP is missing"},
    {"MetaStartMissing", with(kSmall, "META_START\n", ""), 4, "accepted: META_START"},
    {"MetaStartWithValue", with(kSmall, "META_START", "META_START = 1"), 4,
     "META_START takes no value"},
    {"MetaStopMissing", with(kSmall, "META_STOP\n", ""), 12, "not a keyword of an OEM's metadata"},
    {"MetadataMissing", with(kSmall, "STOP_TIME = 2025-079T00:02:00\n", ""), 11,
     "without STOP_TIME"},
    {"MetadataTwice", with(kSmall, "STOP_TIME", "START_TIME"), 11, "START_TIME is given twice"},
    {"MetadataUnknown", with(kSmall, "TIME_SYSTEM = GPS", "TIME_SISTEM = GPS"), 9, "TIME_SISTEM"},
    {"TimesOutOfOrder", with(kSmall, "STOP_TIME = 2025-079", "STOP_TIME = 2025-078"), 12,
     "out of order"},
    {"UseableBeforeStart",
     with(kFull, "USEABLE_START_TIME = 2025-03-20", "USEABLE_START_TIME = 2025-03-19"), 21,
     "out of order"},
    {"Interpolation", with(kFull, "HERMITE", "SPLINE"), 19, "INTERPOLATION is 'SPLINE'"},
    {"InterpolationDegree", with(kFull, "DEGREE = 7", "DEGREE = 7.5"), 20, "'7.5'"},
    {"InterpolationDegreeHuge", with(kFull, "DEGREE = 7", "DEGREE = 99999999999"), 20, "1 to 100"},
    {"TimeSystemChanges", with(kFull, "ITRF2014\nTIME_SYSTEM = UTC", "ITRF2014\nTIME_SYSTEM = TAI"),
     line_of(kFull, "REF_FRAME = ITRF2014") + 1,
     "TIME_SYSTEM is TAI, that of the first segment UTC"},
    {"EightColumns", with(kSmall, "0 0 7.5", "0 0 7.5 0.001"), 13, "8 columns"},
    {"NotANumber", with(kSmall, "6928.137", "6928.137x"), 13, "x: '6928.137x'"},
    {"Nan", with(kSmall, "0 0 7.5", "0 0 NaN"), 13, "z_dot: 'NaN'"},
    {"NotAnEpoch", with(kSmall, "2025-079T00:01:00", "2025-079T00:61:00"), 14, "not an epoch"},
    {"EpochTwice", with(kSmall, "2025-079T00:01:00", "2025-079T00:00:00"), 14, "does not follow"},
    {"EpochBackwards", with(kSmall, "2025-079T00:00:00   6928", "2025-079T00:01:30   6928"), 14,
     "does not follow"},
    {"EpochOutside", with(kSmall, "2025-079T00:02:00  +", "2025-079T00:02:01  +"), 15,
     "outside START_TIME"},
    {"KeywordInData", with(kSmall, "2025-079T00:01", "USER_DEFINED_A = 1\n2025-079T00:01"), 14,
     "USER_DEFINED_A within ephemeris data"},
    {"CovarianceRowShort", with(kFull, "7 8 9 10\n", "7 8 9\n"), line_of(kFull, "7 8 9"),
     "has 3 columns; accepted: 4"},
    {"CovarianceRowLong", with(kFull, "4 5 6\n", "4 5 6 6\n"), line_of(kFull, "4 5 6"),
     "has 4 columns; accepted: 3"},
    {"CovarianceSevenRows", with(kFull, "20 21\n", "20 21\n1 2 3 4 5 6 7\n"),
     line_of(kFull, "16 17") + 1, "seventh row"},
    {"CovarianceFiveRows", with(kFull, "16 17 18 19 20 21\n", ""), line_of(kFull, "16 17"),
     "EPOCH where row 6"},
    {"CovarianceFrame", with(kFull, "COV_REF_FRAME = RTN", "COV_REF_FRAME = XYZ"),
     line_of(kFull, "COV_REF_FRAME"), "COV_REF_FRAME 'XYZ'"},
    {"CovarianceWithoutEpoch", with(kFull, "EPOCH = 2025-03-20T00:00:00\n", ""),
     line_of(kFull, "EPOCH = 2025-03-20T00:00:00"), "accepted: EPOCH"},
    {"DataAfterCovariance", with(kFull, "COVARIANCE_STOP\n", "COVARIANCE_STOP\n1 2 3\n"),
     line_of(kFull, "COVARIANCE_STOP") + 1, "accepted: META_START"},
    {"AnOpm", "CCSDS_OPM_VERS = 2.0\n", 1, "accepted: CCSDS_OEM_VERS"}};

INSTANTIATE_TEST_SUITE_P(Defects, OemDefectTest, testing::ValuesIn(kDefects),
                         [](const auto& defect) { return std::string(defect.param.name); });

}  // namespace
}  // namespace orrery
