#include <orrery/models/frames/earth_orientation.hpp>
#include <orrery/models/frames/time_scales.hpp>

#include <erfa.h>
#include <erfam.h>
#include <gtest/gtest.h>

#include <cmath>
#include <thread>

namespace orrery {
namespace {

// 2025-01-02 00:00:00 UTC: 16433 days and 18 leap seconds after the GPS epoch.
constexpr SimTime kSecondOfJanuary = SimTime(days(16433) + 18s);

double largest_difference(const Mat3& a, const Mat3& b) {
  double largest = 0;
  for (const Vec3& d : {a.row_x - b.row_x, a.row_y - b.row_y, a.row_z - b.row_z})
    for (int i = 0; i < 3; ++i) largest = std::max(largest, std::abs(d[i]));
  return largest;
}

Mat3 to_mat3(const double (&m)[3][3]) {
  return {{m[0][0], m[0][1], m[0][2]}, {m[1][0], m[1][1], m[1][2]}, {m[2][0], m[2][1], m[2][2]}};
}

// Printed to 15 decimals by an independent computation with ERFA from Python; GAST 1.778233890 rad.
// It took eraGst94 at UT1, which evaluates the equation of the equinoxes at UT1 where TT is meant,
// 69 s apart: the nutation moves by up to 4e-10 rad in that time. With eraGst94 we get what was
// printed, rounded to 5e-16, and so know the 3.5e-10 rad that remain for what they are.
TEST(EarthOrientationTest, MatrixAgreesWithThePrintedOneButForTheTimeOfItsEquinox) {
  const Mat3 printed{{-0.200476238811310, 0.979698459849718, 0.000453255072223},
                     {-0.979695550240405, -0.200476748192426, 0.002387943328619},
                     {0.002430331504237, 0.000034673919635, 0.999997046138887}};
  const JulianDate tt = gps_to_tt(kSecondOfJanuary), utc = gps_to_utc(kSecondOfJanuary);
  double m[3][3];
  eraPnm80(tt.day, tt.fraction, m);
  eraRz(eraGst94(utc.day, utc.fraction), m);
  EXPECT_LT(largest_difference(to_mat3(m), printed), 2e-15);
  const double difference = largest_difference(EarthOrientation().R_EI(kSecondOfJanuary), printed);
  RecordProperty("difference", std::to_string(difference * 1e12) + "e-12");
  EXPECT_LT(difference, 5e-10);
}

// ERFA assembled here without our time scales: the IAU 1976/1980/1982/94 chain as its manual writes
// it.
TEST(EarthOrientationTest, MatrixIsErfasChain) {
  double utc1 = 0, utc2 = 0, tai1 = 0, tai2 = 0, tt1 = 0, tt2 = 0, m[3][3];
  ASSERT_EQ(eraDtf2d("UTC", 2025, 1, 2, 0, 0, 0.0, &utc1, &utc2), 0);
  ASSERT_EQ(eraUtctai(utc1, utc2, &tai1, &tai2), 0);
  ASSERT_EQ(eraTaitt(tai1, tai2, &tt1, &tt2), 0);
  eraPnm80(tt1, tt2, m);
  eraRz(eraGmst82(utc1, utc2) + eraEqeq94(tt1, tt2), m);
  EXPECT_LT(largest_difference(EarthOrientation::exact_R_EI(kSecondOfJanuary), to_mat3(m)), 2e-15);
}

// 7e-15 rad of interpolation, and rounding: eraGmst82 carries 2e6 s, 3e-14 rad a time, which the
// cubic through four of them enlarges to at most 1.6 times that, against another one. Observed
// 1.0e-13. Sampled at instants that never fall on a knot, over 400 days in three decades.
TEST(EarthOrientationTest, InterpolationStaysWithinItsBound) {
  const EarthOrientation earth;
  double largest = 0;
  for (const Duration start : {days(9000), days(16500), days(20000)}) {
    for (int k = 0; k < 4000; ++k) {
      const SimTime t(start + k * (2h + 24min + 7s + 13ns));
      largest =
          std::max(largest, largest_difference(earth.R_EI(t), EarthOrientation::exact_R_EI(t)));
    }
  }
  RecordProperty("largest_error_rad", std::to_string(largest * 1e15) + "e-15");
  EXPECT_LT(largest, 2e-13);
}

TEST(EarthOrientationTest, MatrixStaysOrthonormal) {
  const EarthOrientation earth;
  for (int k = 0; k < 1000; ++k) {
    const Mat3 R = earth.R_EI(SimTime(days(16500) + k * (37min + 1s)));
    EXPECT_LT(largest_difference(R * transpose(R), Mat3{}), 1e-12);
  }
}

TEST(EarthOrientationTest, ResultDoesNotDependOnWhatWasAskedBefore) {
  const EarthOrientation forwards, backwards;
  constexpr int kSamples = 500;
  const auto at = [](int k) { return SimTime(days(16500) + k * 47min); };
  std::vector<Mat3> first(kSamples);
  for (int k = 0; k < kSamples; ++k) first[k] = forwards.R_EI(at(k));
  for (int k = kSamples - 1; k >= 0; --k) EXPECT_EQ(backwards.R_EI(at(k)), first[k]);
}

TEST(EarthOrientationTest, ThreadsGetTheSameBits) {
  const EarthOrientation shared;
  const auto sum = [&](int offset) {
    double total = 0;
    for (int k = 0; k < 2000; ++k)
      total += shared.R_EI(SimTime(days(16500) + (k + offset) * 31min)).row_x.x;
    return total;
  };
  const double alone = sum(0);
  double a = 0, b = 0, other = 0;
  std::thread thread_a([&] { a = sum(0); }), thread_b([&] { b = sum(0); }),
      thread_c([&] { other = sum(77); });
  thread_a.join(), thread_b.join(), thread_c.join();
  EXPECT_EQ(a, alone);
  EXPECT_EQ(b, alone);
  EXPECT_NE(other, alone);
}

// omega from ERFA's matrices 20 s apart, by the angle between them. eraGmst82 counts 2e6 s in a
// double: 3e-14 rad of rounding in each matrix, 4e-15 rad/s here; observed 2.3e-15.
TEST(EarthOrientationTest, AngularVelocityIsTheDerivativeOfTheMatrix) {
  const EarthOrientation earth;
  for (int k = 0; k < 20; ++k) {
    const SimTime t = kSecondOfJanuary + k * 7h;
    const Mat3 before = EarthOrientation::exact_R_EI(t - 10s),
               after = EarthOrientation::exact_R_EI(t + 10s);
    const Mat3 step = after * transpose(before);
    const double angle = std::asin((step.row_x.y - step.row_y.x) / 2);
    const Vec3 omega = earth.at(t).omega_EI_ECEF;
    EXPECT_NEAR(omega.z, angle / 20, 4e-15);
    // Transverse: precession and nutation, some 1e-12 rad/s. With its angle half a step early and
    // late, the difference of the matrices shows it along the middle axes.
    const double wx = (step.row_y.z - step.row_z.y) / 40, wy = (step.row_z.x - step.row_x.z) / 40;
    EXPECT_NEAR(omega.x, wx, 1e-15);
    EXPECT_NEAR(omega.y, wy, 1e-15);
    EXPECT_NEAR(omega.z, 7.292115146706979e-5, 1e-11) << "IERS value of the Earth's rotation rate";
  }
}

// At the leap second of 2016-12-31 UT1 = UTC falls back by a second: 15" in the angle, nothing
// else.
TEST(EarthOrientationTest, LeapSecondTurnsTheEarthBackByOneSecond) {
  const SimTime midnight(days(13510) + 18s);
  const EarthOrientation earth;
  const Mat3 step = earth.R_EI(midnight) * transpose(earth.R_EI(midnight - 1ns));
  EXPECT_NEAR(std::asin(step.row_x.y), -7.292115e-5, 1e-10);
  for (const Duration d :
       {Duration(-1h), Duration(-1s), Duration(-1ms), Duration(1ms), Duration(1s)}) {
    EXPECT_LT(
        largest_difference(earth.R_EI(midnight + d), EarthOrientation::exact_R_EI(midnight + d)),
        2e-13);
  }
}

// Independent theory: IAU 2006/2000A of ERFA with UT1 = UTC. The 1976/80 chain without observed
// corrections differs by some tens of mas: 37 mas, 1.25 m at 6.9e6 m, was computed for this epoch.
TEST(EarthOrientationTest, DiffersFromIau2000ByTheOmittedCorrections) {
  const JulianDate tt = gps_to_tt(kSecondOfJanuary), utc = gps_to_utc(kSecondOfJanuary);
  double c2t[3][3];
  eraC2t06a(tt.day, tt.fraction, utc.day, utc.fraction, 0, 0, c2t);
  const Vec3 r{4.0e6, -3.2e6, 4.6e6};
  const double difference =
      norm((EarthOrientation().R_EI(kSecondOfJanuary) * r) - to_mat3(c2t) * r);
  EXPECT_GT(difference, 0.2);
  EXPECT_LT(difference, 1.5);
}

}  // namespace
}  // namespace orrery
