#include "support/orbit/earth_rotation.hpp"

#include <erfa.h>
#include <gtest/gtest.h>

#include "flight_test_support.hpp"

namespace flight_support {
namespace {

constexpr double kArcsec_rad = kPi / 648000.0;

struct ErfaTime {
  double jd, tt, ut1;  // days; tt and ut1 are to be added to jd
};
ErfaTime erfa_time(std::int64_t epoch_ns, const EarthTime& earth_time) {
  const double gps_day = static_cast<double>(epoch_ns / (86400 * kSecond_ns));
  const double second = seconds(epoch_ns % (86400 * kSecond_ns));
  const double utc = second - earth_time.leap_seconds;
  return {2444244.5 + gps_day, (second + 51.184) / 86400.0,
          (utc + earth_time.ut1_minus_utc_s) / 86400.0};
}

// R_EI by ERFA: N P of IAU 1976/1980 and GAST 1982/94.
void erfa_eci_to_ecef(std::int64_t epoch_ns, const EarthTime& earth_time, double (&R_EI)[3][3]) {
  const ErfaTime t = erfa_time(epoch_ns, earth_time);
  eraPnm80(t.jd, t.tt, R_EI);
  eraRz(eraGst94(t.jd, t.ut1), R_EI);
}

// R_EI of today's models, IAU 2006/2000A, ICRS for EME2000.
void erfa_icrs_to_ecef(std::int64_t epoch_ns, const EarthTime& earth_time, double (&R_EI)[3][3]) {
  const ErfaTime t = erfa_time(epoch_ns, earth_time);
  eraC2t06a(t.jd, t.tt, t.jd, t.ut1, 0.0, 0.0, R_EI);
}

// Angle of the rotation from one to the other.
double angle_between_rad(const flight_support::Mat3& R_IE, const double (&R_EI)[3][3]) {
  double largest2 = 0.0;
  for (int r = 0; r < 3; ++r) {
    double off2 = 0.0;
    for (int c = 0; c < 3; ++c) off2 += std::pow(R_IE(c, r) - R_EI[r][c], 2);
    largest2 = std::fmax(largest2, off2);
  }
  return std::sqrt(largest2);
}

// Worst angle from 2016 to 2030; the steps of 9.7 days meet every phase of day and month. UT1 - UTC
// is taken for what it never was, but would have to be right.
template <class Reference>
double worst_from_2016_to_2030_rad(const Reference& reference) {
  const std::int64_t day_ns = 86400 * kSecond_ns;
  const std::int64_t begin_ns = (57388 - 44244) * day_ns;  // MJD, of 2016-01-01 and the GPS epoch
  double worst_rad = 0.0;
  for (int k = 0; k < 564; ++k) {
    const std::int64_t t_ns = begin_ns + k * (838079 * kSecond_ns + 123456789);
    const EarthTime earth_time{.leap_seconds = t_ns < begin_ns + 366 * day_ns ? 17 : 18,
                               .ut1_minus_utc_s = 0.5 * std::sin(0.01 * k)};
    double R_EI[3][3];
    reference(t_ns, earth_time, R_EI);
    worst_rad = std::fmax(worst_rad, angle_between_rad(ecef_to_eci(t_ns, earth_time), R_EI));
  }
  return worst_rad;
}

// The issue asks for 5 arcsec. The 93 nutation terms left out add up to 0.08 arcsec at worst (sum
// of their amplitudes 0.1"), the complementary terms of the equation of the equinoxes are 0.003":
// 0.1 arcsec holds. Observed 0.018 arcsec.
TEST(EarthRotationTest, AgreesWithErfaFrom2016To2030) {
  const double worst_rad = worst_from_2016_to_2030_rad(erfa_eci_to_ecef);
  RecordProperty("worst_arcsec", std::to_string(worst_rad / kArcsec_rad));
  EXPECT_LT(worst_rad, 0.1 * kArcsec_rad) << worst_rad / kArcsec_rad << " arcsec";
}

// With what IAU 1976/1980 is off by now (celestial pole offsets up to 0.12") and the frame bias
// (0.02") left out, which today's models contain. Observed 0.068 arcsec.
TEST(EarthRotationTest, AgreesWithTodaysModelsFrom2016To2030) {
  const double worst_rad = worst_from_2016_to_2030_rad(erfa_icrs_to_ecef);
  RecordProperty("worst_arcsec", std::to_string(worst_rad / kArcsec_rad));
  EXPECT_LT(worst_rad, 0.2 * kArcsec_rad) << worst_rad / kArcsec_rad << " arcsec";
}

TEST(EarthRotationTest, TheMatrixIsARotation) {
  const flight_support::Mat3 R = ecef_to_eci(flight_test::kEpoch_ns, EarthTime());
  const flight_support::Mat3 one = R * transpose(R);
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(one(r, c), r == c ? 1.0 : 0.0, 1e-15);
  }
}

// A second of UT1 is 15.04 arcsec of rotation.
TEST(EarthRotationTest, Ut1AndLeapSecondsTurnTheEarth) {
  const EarthTime late{.leap_seconds = 18, .ut1_minus_utc_s = 0.5};
  const EarthTime leap{.leap_seconds = 19, .ut1_minus_utc_s = 0.0};
  const flight_support::Vec3 x = flight_support::vec3(7e6, 0, 0);
  const flight_support::Vec3 before = ecef_to_eci(flight_test::kEpoch_ns, EarthTime()) * x;
  const auto moved_m = [&](const EarthTime& time) {
    return norm(ecef_to_eci(flight_test::kEpoch_ns, time) * x - before);
  };
  // 7e6 m * 7.2921e-5 rad/s = 510.45 m per second; the chord is shorter by 1e-9.
  EXPECT_NEAR(moved_m(late), 255.22, 0.01);
  EXPECT_NEAR(moved_m(leap), 510.45, 0.01);
}

// The velocity is the derivative of the position: central differences over 2 s of a point that
// moves in ECEF at constant velocity. Error of the difference h^2/6 * |d3r/dt3| < 1e-5 m/s.
TEST(EarthRotationTest, VelocityIsTheDerivativeOfPosition) {
  const flight_support::Vec3 r = flight_support::vec3(4.0e6, -3.2e6, 4.6e6);
  const flight_support::Vec3 v = flight_support::vec3(1000, -5000, 3000);
  const auto at = [&](int s) {
    return eci_from_ecef(flight_test::kEpoch_ns + s * kSecond_ns, r + static_cast<double>(s) * v, v,
                         EarthTime());
  };
  const flight_support::Vec3 difference = 0.5 * (at(1).r_ECI - at(-1).r_ECI);
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(at(0).v_ECI[k], difference[k], 1e-4);
}

}  // namespace
}  // namespace flight_support
