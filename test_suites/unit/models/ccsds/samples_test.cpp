// The orbit data messages of Orekit's test suite, where ORRERY_REFERENCE_DATA has them.
#include <orrery/models/ccsds/oem_interpolation.hpp>
#include <orrery/models/ccsds/opm.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>

namespace orrery {
namespace {

const std::filesystem::path kFolder = std::filesystem::path(ORRERY_REFERENCE_DATA) / "ccsds";

std::string text_of(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  EXPECT_TRUE(file) << path;
  return {std::istreambuf_iterator<char>(file), {}};
}

std::vector<std::string> names_in(const char* folder) {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(kFolder / folder))
    names.push_back(entry.path().filename());
  std::sort(names.begin(), names.end());
  return names;
}

template <class Parse>
std::string refusal(Parse parse, const std::string& text, const std::string& name) {
  try {
    parse(text, name);
    return "accepted";
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
}

struct CcsdsSampleTest : testing::Test {
  void SetUp() override {
    if (!std::filesystem::exists(kFolder))
      GTEST_SKIP() << "no ccsds/ below " << ORRERY_REFERENCE_DATA;
  }

  // Every file of the folder is either in `broken` (name, line of the defect, what is said of it),
  // or is read, written and read again to the same message.
  struct Broken {
    int line;
    const char* what;
  };
  template <class Parse, class Write>
  void check(const char* folder, Parse parse, Write write,
             const std::map<std::string, Broken>& broken) {
    std::size_t refused = 0, accepted = 0;
    for (const std::string& name : names_in(folder)) {
      const std::string text = text_of(kFolder / folder / name);
      const auto defect = broken.find(name);
      if (defect != broken.end()) {
        ++refused;
        EXPECT_THAT(refusal(parse, text, name),
                    testing::AllOf(testing::HasSubstr(name + ", line " +
                                                      std::to_string(defect->second.line) + ": "),
                                   testing::HasSubstr(defect->second.what)));
        continue;
      }
      ++accepted;
      try {
        const auto message = parse(text, name);
        const std::string written = write(message);
        EXPECT_TRUE(parse(written, "written") == message) << name;
        EXPECT_EQ(write(parse(written, "written")), written) << name;
      } catch (const std::invalid_argument& error) {
        ADD_FAILURE() << error.what();
      }
    }
    EXPECT_EQ(refused, broken.size());
    RecordProperty("accepted", static_cast<int>(accepted));
    RecordProperty("refused", static_cast<int>(refused));
    EXPECT_GT(accepted, 10u);
  }
};

// Lines found by eye. OEM-Issue839 is conformant.
TEST_F(CcsdsSampleTest, OemsAreReadAndWrittenAndTheBrokenOnesRefusedAtTheirLine) {
  check("oem", parse_oem, write_oem,
        {{"OEM-covariance-number-format-error.txt", {52, "this-is-not-a-number"}},
         {"OEM-ephemeris-number-format-error.txt", {44, "this-is-not-a-number"}},
         {"OEM-inconsistent-time-systems.txt", {33, "TIME_SYSTEM is TCG"}},
         {"OEM-keyword-within-covariance.txt", {91, "USER_DEFINED_TEST_KEY"}},
         {"OEM-keyword-within-ephemeris.txt", {24, "USER_DEFINED_TEST_KEY"}},
         {"OEM-too-few-covariance-columns.txt", {55, "row 5 of the covariance has 4 columns"}},
         {"OEM-too-large-covariance-dimension.txt", {91, "a seventh row"}},
         {"OEM-too-many-covariance-columns.txt", {51, "row 1 of the covariance has 6 columns"}},
         {"OEM-too-small-covariance-dimension.txt", {89, "EPOCH where row 5"}},
         {"OEM-wrong-keyword.txt", {19, "WRONG_KEYWORD"}},
         {"OEMExample3.xml", {1, "XML"}}});
}

// OPM-frame-mapper-gcrf has a covariance in ZZRF, a frame of Orekit's own.
TEST_F(CcsdsSampleTest, OpmsAreReadAndWrittenAndTheBrokenOnesRefusedAtTheirLine) {
  check("opm", parse_opm, write_opm,
        {{"OPM-frame-mapper-gcrf.txt", {42, "COV_REF_FRAME 'ZZRF'"}},
         {"OPM-incompatible-units.txt", {20, "unit of SOLAR_RAD_AREA is '[s]'; accepted: [m**2]"}},
         {"OPM-no-designator.txt", {7, "OBJECT_ID 'redacted for test purposes'"}},
         {"OPM-non-standard-units.txt", {16, "unit of X is '[m]'; accepted: [km]"}},
         {"OPM-number-format-error.txt", {17, "SEMI_MAJOR_AXIS: 'this-is-not-a-number'"}},
         {"OPM-unknown-center.txt", {11, "CENTER_NAME 'UNKNOWN-CENTER'"}},
         {"OPM-unknown-frame-mapper.txt", {12, "REF_FRAME 'ZZRF'"}},
         {"OPM-unknown-frame.txt", {7, "REF_FRAME 'ZZRF'"}},
         {"OPM-wrong-keyword.txt", {11, "WRONG_KEYWORD"}},
         {"OPMExample3.xml", {1, "XML"}},
         {"spurious-metadata.xml", {1, "XML"}}});
}

TEST_F(CcsdsSampleTest, AttitudeMessagesAreNoOrbitMessages) {
  for (const std::string& name : names_in("aem")) {
    const std::string text = text_of(kFolder / "aem" / name);
    const char* const what = name.ends_with(".xml") ? "XML" : "'CCSDS_AEM_VERS'";
    EXPECT_THAT(refusal(parse_oem, text, name),
                testing::AllOf(testing::HasSubstr(", line 1: "), testing::HasSubstr(what)));
    EXPECT_THAT(refusal(parse_opm, text, name),
                testing::AllOf(testing::HasSubstr(", line 1: "), testing::HasSubstr(what)));
  }
}

// Cut anywhere, a message is read or refused; nothing else may come out.
TEST_F(CcsdsSampleTest, MessagesCutAnywhereAreReadOrRefused) {
  const std::string oem = text_of(kFolder / "oem" / "OEMExample1.txt");
  const std::string opm = text_of(kFolder / "opm" / "OPMExample4.txt");
  int read = 0;
  for (std::size_t end = 0; end < oem.size(); end += 3)
    read += refusal(parse_oem, oem.substr(0, end), "cut") == "accepted";
  for (std::size_t end = 0; end < opm.size(); end += 3)
    read += refusal(parse_opm, opm.substr(0, end), "cut") == "accepted";
  EXPECT_GT(read, 0);
}

// The second line of the ISS's ephemeris, published by NASA: 13:00 UTC, 18 s later in GPS time.
TEST_F(CcsdsSampleTest, SpaceStationStartsFromItsEphemeris) {
  const Oem oem = load_oem(kFolder / "oem" / "ISS.resampled.truncated.txt");
  const OrbitState state = state_at(oem, gps_midnight(2022, 1, 17) + 13h + 18s);
  EXPECT_EQ(state.r_ECI,
            (Vec3{1e3 * 5021.218457183220, 1e3 * -2714.921344536780, 1e3 * -3693.631863364480}));
  EXPECT_EQ(state.v_ECI,
            (Vec3{1e3 * 5.15002544728106, 1e3 * 3.64780592200467, 1e3 * 4.33367398742523}));
}

// Lagrange of degree 5 through all six lines, as the file asks for, 137 s after the first,
// evaluated in rational arithmetic (Python's fractions). Tolerance: rounding of 6500 km, 1e-12 km,
// a few times.
TEST_F(CcsdsSampleTest, LagrangePolynomialIsTheFilesOwn) {
  const Oem oem = load_oem(kFolder / "oem" / "oemLowerCaseValue.oem");
  const OrbitState state =
      state_at(oem, gps_midnight(2015, 8, 27) + 17s + 137s);  // GPS - UTC: 17 s
  const Vec3 r_ECI{-554243.16971769661, -6508291.4511080133, 1481615.7326870572};
  const Vec3 v_ECI{7717.0390951207473, -601.01058289262755, 300.72392197883136};
  EXPECT_LT(norm(state.r_ECI - r_ECI), 5e-9);
  EXPECT_LT(norm(state.v_ECI - v_ECI), 5e-12);
}

}  // namespace
}  // namespace orrery
