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

// Gate for forces: 0.12 deg against eraEpv00 and eraMoon98, from 2016 through 2029. Observed: Sun
// 0.100 deg and 8.1e-5 of its distance, Moon 0.077 deg and 1.3e-3. The Sun's error grows by 0.0032
// deg a year: the perihelion's own motion is not in the series.
TEST(SunMoonTest, SeriesStayNearTheEphemerides) {
  double sun_deg = 0, moon_deg = 0, sun_distance = 0, moon_distance = 0;
  for (SimTime t(days(13200)); t < gps_midnight(2030, 1, 1); t += 61h) {
    const JulianDate tt = gps_to_tt(t);
    double earth[2][3], barycentric[2][3], moon[2][3];
    eraEpv00(tt.day, tt.fraction, earth, barycentric);
    eraMoon98(tt.day, tt.fraction, moon);
    const Vec3 sun_au{-earth[0][0], -earth[0][1], -earth[0][2]};
    const Vec3 moon_au{moon[0][0], moon[0][1], moon[0][2]};
    const Vec3 r_sun = sun_position_ECI(t), r_moon = moon_position_ECI(t);
    sun_deg = std::max(sun_deg, angle_between_rad(r_sun, sun_au) * ERFA_DR2D);
    moon_deg = std::max(moon_deg, angle_between_rad(r_moon, moon_au) * ERFA_DR2D);
    sun_distance = std::max(sun_distance, std::abs(norm(r_sun) / (norm(sun_au) * ERFA_DAU) - 1));
    moon_distance =
        std::max(moon_distance, std::abs(norm(r_moon) / (norm(moon_au) * ERFA_DAU) - 1));
  }
  RecordProperty("largest_sun_error_deg", std::to_string(sun_deg));
  RecordProperty("largest_moon_error_deg", std::to_string(moon_deg));
  RecordProperty("largest_sun_distance_error_1e_6", std::to_string(1e6 * sun_distance));
  RecordProperty("largest_moon_distance_error_1e_6", std::to_string(1e6 * moon_distance));
  EXPECT_LT(sun_deg, 0.12);
  EXPECT_LT(moon_deg, 0.12);
  EXPECT_LT(sun_distance, 2e-4);
  EXPECT_LT(moon_distance, 3e-3);
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
