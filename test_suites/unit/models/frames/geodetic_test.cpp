#include <orrery/models/frames/geodetic.hpp>

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>

namespace orrery {
namespace {

constexpr double kPi = 3.141592653589793;

// Semi-axes of WGS 84 (NIMA TR8350.2): 6378137 m and 6356752.3142 m.
TEST(GeodeticTest, AxesOfTheEllipsoidHaveHeightZero) {
  EXPECT_NEAR(to_geodetic({6378137, 0, 0}).height_m, 0, 1e-8);
  const Geodetic pole = to_geodetic({0, 0, -6356752.3142});
  EXPECT_NEAR(pole.height_m, 0, 5e-5);  // the published semi-axis has four decimals
  EXPECT_NEAR(pole.latitude_rad, -kPi / 2, 1e-15);
}

// eraGc2gd stops after one Halley step. 1e-12 rad is 7 um; observed 9e-14 rad.
TEST(GeodeticTest, PlaceSurvivesTheDetour) {
  for (const double latitude : {-1.5, -0.3, 0.0, 0.8, 1.57}) {
    const Geodetic place{latitude, 2.5, 550e3};
    const Geodetic back = to_geodetic(to_ECEF(place));
    EXPECT_NEAR(back.latitude_rad, latitude, 1e-12);
    EXPECT_NEAR(back.longitude_rad, 2.5, 1e-14);
    EXPECT_NEAR(back.height_m, 550e3, 1e-6);
  }
}

TEST(GeodeticTest, NonsenseIsRefused) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(to_geodetic({nan, 0, 0}), std::domain_error);
  EXPECT_THROW(to_ECEF({1.6, 0, 0}), std::domain_error);
  EXPECT_THROW(to_ECEF({0, nan, 0}), std::domain_error);
}

}  // namespace
}  // namespace orrery
