#include <orrery/models/frames/earth_orientation.hpp>
#include <orrery/models/frames/time_scales.hpp>
#include <orrery/models/orbit/sun_moon.hpp>

#include <erfa.h>
#include <erfam.h>
#include <gtest/gtest.h>

#include <cmath>

namespace orrery {
namespace {

double angle_between_rad(const Vec3& a, const Vec3& b) {
  return std::atan2(norm(cross(a, b)), dot(a, b));
}

// Computed independently from the same series, printed to seven digits.
TEST(SunMoonTest, SeriesGiveTheCheckValues) {
  const double T = (2460677.5 - 2451545.0) / 36525;
  const Vec3 sun = sun_position_ECI(T), moon = moon_position_ECI(T);
  EXPECT_LT(norm(sun - Vec3{2.909894e10, -1.322945e11, -5.735668e10}), 1e5);
  EXPECT_LT(norm(moon - Vec3{2.277137e8, -2.655760e8, -1.440947e8}), 1e2);
}

// Gate for forces: 0.12 deg against eraEpv00 and eraMoon98.
TEST(SunMoonTest, SeriesStayNearTheEphemerides) {
  for (int k = 0; k < 200; ++k) {
    const SimTime t(days(13200) + k * 625h);
    const JulianDate tt = gps_to_tt(t);
    double earth[2][3], barycentric[2][3], moon[2][3];
    eraEpv00(tt.day, tt.fraction, earth, barycentric);
    eraMoon98(tt.day, tt.fraction, moon);
    const Vec3 sun_au{-earth[0][0], -earth[0][1], -earth[0][2]};
    const Vec3 moon_au{moon[0][0], moon[0][1], moon[0][2]};
    EXPECT_LT(angle_between_rad(sun_position_ECI(t), sun_au) * ERFA_DR2D, 0.12);
    EXPECT_LT(angle_between_rad(moon_position_ECI(t), moon_au) * ERFA_DR2D, 0.12);
    EXPECT_NEAR(norm(sun_position_ECI(t)) / (norm(sun_au) * ERFA_DAU), 1, 2e-4);
    EXPECT_NEAR(norm(moon_position_ECI(t)) / (norm(moon_au) * ERFA_DAU), 1, 3e-3);
  }
}

// The equinox of 2025-03-20 is published as 09:01 UTC, when the apparent right ascension in the
// equator and equinox of date passes zero. The Sun moves 2.3" in a minute; so the table's rounding
// allows 1.2".
TEST(SunMoonTest, ApparentSunPassesTheEquinoxOnTime) {
  const SimTime equinox(days(16510) + 9h + 1min + 30s + 18s);
  const JulianDate tt = gps_to_tt(equinox);
  double NP[3][3];
  eraPnm80(tt.day, tt.fraction, NP);
  const Vec3 s = apparent_sun_direction_ECI(equinox);
  const double x = NP[0][0] * s.x + NP[0][1] * s.y + NP[0][2] * s.z;
  const double y = NP[1][0] * s.x + NP[1][1] * s.y + NP[1][2] * s.z;
  EXPECT_NEAR(std::atan2(y, x) * ERFA_DR2AS, 0, 1.2 + 0.2);  // 0.2": frame bias and rounding
}

TEST(SunMoonTest, ApparentSunIsBehindTheGeometricOneByAberration) {
  const SimTime t(days(16510));
  const JulianDate tt = gps_to_tt(t);
  double earth[2][3], barycentric[2][3];
  eraEpv00(tt.day, tt.fraction, earth, barycentric);
  const Vec3 geometric{-earth[0][0], -earth[0][1], -earth[0][2]};
  // Constant of aberration 20.4955" (IAU), 1.7 % more or less with the Earth's speed.
  EXPECT_NEAR(angle_between_rad(apparent_sun_direction_ECI(t), geometric) * ERFA_DR2AS, 20.4955,
              0.35);
}

}  // namespace
}  // namespace orrery
