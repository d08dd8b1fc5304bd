#include <orrery/models/data/embedded_tables.hpp>
#include <orrery/models/orbit/gravity_field.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <fstream>
#include <stdexcept>
#include <string>

namespace orrery {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::ThrowsMessage;

constexpr const char* kHeader =
    "earth_gravity_constant 3.986004415D+14\nradius 6378136.3\nmax_degree 2\nend_of_head\n";

std::string field(const std::string& coefficients) {
  return kHeader + coefficients;
}

GravityField parse(const std::string& text) {
  return GravityField::parse(text, "test.gfc");
}

void expect_refused(const std::string& text, const char* line, const char* reason) {
  EXPECT_THAT([&] { parse(text); }, ThrowsMessage<std::invalid_argument>(AllOf(
                                        HasSubstr("test.gfc"), HasSubstr(line), HasSubstr(reason))))
      << text;
}

// The figures that the model's publishers print in the header and the first lines of their file.
TEST(GravityFieldTest, CompiledInModelIsGgm05s) {
  const GravityField ggm05s = GravityField::ggm05s();
  EXPECT_EQ(ggm05s.name(), "GGM05S");
  EXPECT_EQ(ggm05s.tide_system(), "zero_tide");
  EXPECT_EQ(ggm05s.degree(), 60);
  EXPECT_EQ(ggm05s.mu_m3ps2(), 3.986004415e14);
  EXPECT_EQ(ggm05s.radius_m(), 6378136.3);
  EXPECT_EQ(ggm05s.C(0, 0), 1);
  EXPECT_EQ(ggm05s.C(1, 1), 0);
  EXPECT_EQ(ggm05s.C(2, 0), -4.841694573200e-4);
  EXPECT_EQ(ggm05s.C(2, 2), 2.439374598584e-6);
  EXPECT_EQ(ggm05s.S(2, 2), -1.400287554684e-6);
  EXPECT_EQ(ggm05s.C(60, 60), 3.767212823263e-9);
}

TEST(GravityFieldTest, AcceptsFortranExponentsAnyOrderAndStandardDeviations) {
  const GravityField f = parse(
      field("gfc 2 2 2.4D-06 -1.4d-06 1.0D-12 1.0D-12\r\ngfc 0 0 1.0 0.0\n\ngfc\t2 0 -4.8e-4 0\n"
            "gfc 2 1 +1e-10 -2E-10\n"));
  EXPECT_EQ(f.C(2, 2), 2.4e-6);
  EXPECT_EQ(f.S(2, 2), -1.4e-6);
  EXPECT_EQ(f.C(2, 1), 1e-10);
  EXPECT_EQ(f.S(2, 1), -2e-10);
}

TEST(GravityFieldTest, CoefficientsOutsideTheTriangleAreRefused) {
  const GravityField f = GravityField::ggm05s();
  EXPECT_THROW(f.C(61, 0), std::out_of_range);
  EXPECT_THROW(f.C(2, 3), std::out_of_range);
  EXPECT_THROW(f.S(2, -1), std::out_of_range);
}

// Every cut of the real file, at every one of its bytes near the end and at line ends throughout,
// is seen.
TEST(GravityFieldTest, FileCutShortAnywhereIsRefused) {
  const std::string whole(embedded::ggm05s_d60());
  for (std::size_t size = whole.size() - 50; size < whole.size(); ++size) {
    EXPECT_THAT([&] { parse(whole.substr(0, size)); },
                ThrowsMessage<std::invalid_argument>(HasSubstr("cut short")));
  }
  int line = 0;
  for (std::size_t end = whole.find('\n'); end + 1 < whole.size();
       end = whole.find('\n', end + 1)) {
    if (++line % 19 != 0) continue;
    EXPECT_THAT([&] { parse(whole.substr(0, end + 1)); },
                ThrowsMessage<std::invalid_argument>(HasSubstr("cut short")));
  }
}

TEST(GravityFieldTest, CutFileNamesFileLineAndWhatIsMissing) {
  expect_refused(field("gfc 2 0 -4.8e-4 0\ngfc 2 1 0 0\n"), "line 6",
                 "cut short: the file ends here after n = 2, m = 1; complete to degree 2");
}

TEST(GravityFieldTest, MalformedContentNamesTheLine) {
  const std::string rest = "gfc 2 1 0 0\ngfc 2 2 0 0\n";
  expect_refused(field("gfc 2 0 -4.8e-4\n" + rest), "line 5", "malformed");
  expect_refused(field("gfc 2 0 -4.8x 0\n" + rest), "line 5", "malformed");
  expect_refused(field("gfc 2 0 nan 0\n" + rest), "line 5", "finite");
  expect_refused(field("gfc 2 0 inf 0\n" + rest), "line 5", "finite");
  expect_refused(field("gfc 2 0 -4.8e-4 1e999\n" + rest), "line 5", "finite");
  expect_refused(field("gfc 2 0 -4.8e4 0\n" + rest), "line 5", "-1 to 1");
  expect_refused(field("gfc 2 0 -4.8e-4 -1e300\n" + rest), "line 5", "-1 to 1");
  expect_refused(field("gfc 99999999999 0 0 0\n" + rest), "line 5", "malformed");
  expect_refused(field("gfc -1 0 0 0\n" + rest), "line 5", "no such coefficient");
  expect_refused(field("gfc 2 0 -4.8e-4 0\n" + rest + "gfc 2 0 " + std::string("\0\1", 2) + " 0\n"),
                 "line 8", "not text");
  expect_refused(field("gfc 2.0 0 -4.8e-4 0\n" + rest), "line 5", "malformed");
  expect_refused(field("gfc 2 0 -4.8e-4 0\ngfc 2 1 0 0\ngfc 2 1 0 0\n"), "line 7", "given twice");
  expect_refused(field("gfc 3 0 0 0\n" + rest), "line 5", "no such coefficient");
  expect_refused(field("gfc 2 3 0 0\n" + rest), "line 5", "no such coefficient");
  expect_refused(field("gfct 2 0 -4.8e-4 0\n" + rest), "line 5", "not a line of a static field");
  expect_refused(field("gfc 0 0 1.1 0\n" + rest), "line 5", "degree 0");
  expect_refused(field("gfc 1 0 1e-9 0\n" + rest), "line 5", "degree 1");
  expect_refused(field(rest), "line 6", "n = 2, m = 0 is missing");
}

TEST(GravityFieldTest, HeaderMustSayWhatTheCoefficientsMean) {
  expect_refused("radius 1\nmax_degree 2\nend_of_head\n", "line 3", "earth_gravity_constant");
  expect_refused("earth_gravity_constant 1\nmax_degree 2\nend_of_head\n", "line 3", "radius");
  expect_refused("earth_gravity_constant 1\nradius 1\nend_of_head\n", "line 3", "max_degree");
  expect_refused("earth_gravity_constant 1\nradius -1\n", "line 2", "positive");
  expect_refused("radius nan\n", "line 1", "positive");
  expect_refused("radius 1e300\n", "line 1", "positive number up to");
  expect_refused("earth_gravity_constant 1e23\n", "line 1", "positive number up to");
  expect_refused("earth_gravity_constant 1\nradius 1\nmax_degree 2000000000\nend_of_head\n",
                 "line 4", "accepted: 2 to 360");
  expect_refused("earth_gravity_constant 1\nradius 1\nmax_degree 1e9\nend_of_head\n", "line 4",
                 "max_degree");
  expect_refused(std::string("\x7f"
                             "ELF\2\1\0\0\n\0\0\n",
                             12),
                 "line 1", "not text");
  expect_refused("norm unnormalized\n", "line 1", "fully_normalized");
  expect_refused("radius 1\n", "line 1", "end_of_head");
  expect_refused("", "line 0", "end_of_head");
}

TEST(GravityFieldTest, ReadsAsFarAsAsked) {
  const std::string whole(embedded::ggm05s_d60());
  EXPECT_EQ(GravityField::parse(whole, "ggm05s", 20).degree(), 20);
  EXPECT_THROW(GravityField::parse(whole, "ggm05s", 61), std::invalid_argument);
  EXPECT_THROW(GravityField::parse(whole, "ggm05s", 1), std::invalid_argument);
}

TEST(GravityFieldTest, LoadsFilesAndNamesThoseItCannotRead) {
  const std::string path = testing::TempDir() + "orrery_gravity_field_test.gfc";
  std::ofstream(path) << field("gfc 2 0 -4.8e-4 0\ngfc 2 1 0 0\ngfc 2 2 0 0\n");
  EXPECT_EQ(GravityField::load(path).C(2, 0), -4.8e-4);
  std::remove(path.c_str());
  EXPECT_THAT([&] { GravityField::load(path); }, ThrowsMessage<std::invalid_argument>(AllOf(
                                                     HasSubstr("cannot read"), HasSubstr(path))));
}

}  // namespace
}  // namespace orrery
