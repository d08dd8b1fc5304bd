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

// Closed form with WGS 84's defining constants: (N + h) cos, ((1 - e^2) N + h) sin; and back again.
// From the bottom of the sea to geostationary heights. Rounding: 1e-15 of the radius, 1e-7 m. The
// one Halley step of eraGc2gd leaves 1.2e-13 rad at 550 km and 2.7e-11 rad (0.7 mm) at 20000 km.
TEST(GeodeticTest, PlacesAreThoseOfTheClosedFormAllOverTheEarth) {
  const double a = 6378137, f = 1 / 298.257223563, e2 = f * (2 - f);
  for (const double height : {-11e3, 0.0, 550e3, 2e7, 36e6}) {
    const double tolerance_rad = height < 1e6 ? 1e-12 : 5e-11;
    for (double latitude = -1.55; latitude < 1.56; latitude += 0.1) {
      for (double longitude = -3.1; longitude < 3.14; longitude += 0.8) {
        const double s = std::sin(latitude), N = a / std::sqrt(1 - e2 * s * s);
        const double in_plane = (N + height) * std::cos(latitude);
        const Vec3 r{in_plane * std::cos(longitude), in_plane * std::sin(longitude),
                     ((1 - e2) * N + height) * s};
        EXPECT_LT(norm(to_ECEF({latitude, longitude, height}) - r), 1e-7);
        const Geodetic place = to_geodetic(r);
        EXPECT_NEAR(place.latitude_rad, latitude, tolerance_rad);
        EXPECT_NEAR(place.longitude_rad, longitude, 1e-14);
        EXPECT_NEAR(place.height_m, height, 1e-6);
      }
    }
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
