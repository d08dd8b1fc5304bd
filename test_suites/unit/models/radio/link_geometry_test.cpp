#include <orrery/models/orbit/earth.hpp>
#include <orrery/models/radio/link_geometry.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>

namespace orrery {
namespace {

constexpr double kOrbit_m = kRadiusEarth_m + 550e3;

// On one circle of radius r, an angle apart: the chord's middle is r cos(angle/2) from the centre.
LinkGeometry on_a_circle(double angle_rad) {
  return {.r_from_ECI = {kOrbit_m, 0, 0},
          .r_to_ECI = {kOrbit_m * std::cos(angle_rad), kOrbit_m * std::sin(angle_rad), 0}};
}

TEST(LinkGeometryTest, GrazingAltitudeIsThatOfTheChordsMiddle) {
  for (const double angle_rad : {0.1, 0.5, 0.9, 1.5}) {
    const LinkGeometry ends = on_a_circle(angle_rad);
    EXPECT_NEAR(grazing_altitude_m(ends.r_from_ECI, ends.r_to_ECI),
                kOrbit_m * std::cos(angle_rad / 2) - kRadiusEarth_m, 1e-8);
  }
}

TEST(LinkGeometryTest, ThePointNearestToTheEarthMayBeAnEnd) {
  const Vec3 low = {kOrbit_m, 0, 0};
  EXPECT_NEAR(grazing_altitude_m(low, {2 * kOrbit_m, 1e3, 0}), 550e3, 1e-8);
  EXPECT_NEAR(grazing_altitude_m({2 * kOrbit_m, 1e3, 0}, low), 550e3, 1e-8);
  EXPECT_NEAR(grazing_altitude_m(low, low), 550e3, 1e-8);
}

// The line of sight touches the shell at cos(angle/2) = (R + h)/r.
TEST(LinkGeometryTest, TheEarthOccludesFromTheTangentOn) {
  const double tangent_rad = 2 * std::acos((kRadiusEarth_m + 100e3) / kOrbit_m);
  const LinkVisibility limits{.earth_occludes = true};
  EXPECT_EQ(obstacle(on_a_circle(tangent_rad - 1e-9), limits), LinkObstacle::kNone);
  EXPECT_EQ(obstacle(on_a_circle(tangent_rad + 1e-9), limits), LinkObstacle::kEarth);
  EXPECT_EQ(obstacle(on_a_circle(3.0), {}), LinkObstacle::kNone) << "unless it is not asked for";
}

TEST(LinkGeometryTest, RangeIsThatBetweenTheEnds) {
  const double range_m = 2 * kOrbit_m * std::sin(0.05);
  EXPECT_EQ(obstacle(on_a_circle(0.1), {.max_range_m = range_m + 1e-6}), LinkObstacle::kNone);
  EXPECT_EQ(obstacle(on_a_circle(0.1), {.max_range_m = range_m - 1e-6}), LinkObstacle::kRange);
}

// Bodies along ECI, the receiver 1 km away in the x-y plane, off the sender's boresight by 20 deg.
TEST(LinkGeometryTest, BothAntennasMustHaveTheOtherEndInTheirBeam) {
  constexpr double kDeg = 3.14159265358979323846 / 180;
  LinkGeometry ends{.r_from_ECI = {kOrbit_m, 0, 0}, .r_to_ECI = {kOrbit_m, 0, 0}};
  ends.r_to_ECI += Vec3{1e3 * std::cos(20 * kDeg), 1e3 * std::sin(20 * kDeg), 0};
  LinkVisibility limits{.beam_half_angle_rad = 20.001 * kDeg,
                        .boresight_from_B = {2, 0, 0},  // need not be of unit length
                        .boresight_to_B = {-1, 0, 0}};
  EXPECT_EQ(obstacle(ends, limits), LinkObstacle::kNone);
  limits.beam_half_angle_rad = 19.999 * kDeg;
  EXPECT_EQ(obstacle(ends, limits), LinkObstacle::kBeam);
  limits.beam_half_angle_rad = 30 * kDeg;
  limits.boresight_to_B = {1, 0, 0};  // looks away
  EXPECT_EQ(obstacle(ends, limits), LinkObstacle::kBeam);
  // Turned half around its z axis it looks back.
  ends.R_BI_to = {{-1, 0, 0}, {0, -1, 0}, {0, 0, 1}};
  EXPECT_EQ(obstacle(ends, limits), LinkObstacle::kNone);
}

TEST(LinkGeometryTest, LimitsOutOfRangeAreRefused) {
  const auto refused = [](const LinkVisibility& limits, const char* text) {
    EXPECT_THAT([&] { check(limits); },
                testing::ThrowsMessage<std::invalid_argument>(testing::HasSubstr(text)));
  };
  refused({.max_range_m = -1}, "max_range_m = -1; accepted: 0 (no limit) or more");
  refused({.max_range_m = std::numeric_limits<double>::quiet_NaN()}, "max_range_m = nan");
  refused({.grazing_altitude_m = 2e6}, "grazing_altitude_m = 2e+06");
  refused({.beam_half_angle_rad = 3.2}, "beam_half_angle_rad = 3.2");
  refused({.boresight_to_B = {0, 0, 0}}, "length of a boresight = 0");
}

}  // namespace
}  // namespace orrery
