// The Earth's orientation with UT1, polar motion and nutation offsets, against ERFA's own matrices.
#include <orrery/models/frames/earth_orientation.hpp>
#include <orrery/models/frames/time_scales.hpp>

#include <erfa.h>
#include <erfam.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <stdexcept>
#include <string>
#include <vector>

#include "reference_file.hpp"

namespace orrery {
namespace {

double largest_difference(const Mat3& a, const Mat3& b) {
  double largest = 0;
  for (const Vec3& d : {a.row_x - b.row_x, a.row_y - b.row_y, a.row_z - b.row_z})
    for (int i = 0; i < 3; ++i) largest = std::max(largest, std::abs(d[i]));
  return largest;
}

// Rows as large as any since 1980, changing from day to day as fast; 2016-12-28 to 2017-01-08,
// across a leap second.
EarthOrientationTable made_up_table() {
  std::string text = "VERSION 1.1\nNUM_OBSERVED_POINTS 12\nBEGIN OBSERVED\n";
  char line[160];
  for (int d = 0; d < 12; ++d) {
    const bool december = d < 4;
    const double ut1_minus_tai = -36.4 - 0.002 * d + 3e-4 * std::sin(1.3 * d);
    std::snprintf(line, sizeof line,
                  "%d %02d %02d %d %9.6f %9.6f %10.7f %10.7f %9.6f %9.6f %9.6f %9.6f  %d\n",
                  december ? 2016 : 2017, december ? 12 : 1, december ? 28 + d : d - 3, 57750 + d,
                  0.3 * std::cos(0.8 * d), 0.5 * std::sin(0.7 * d),
                  ut1_minus_tai + (december ? 36 : 37), 0.001, -0.12 + 0.004 * std::sin(1.1 * d),
                  -0.012 + 0.003 * std::cos(1.7 * d), 0.0, 0.0, december ? 36 : 37);
    text += line;
  }
  return EarthOrientationTable::parse(text + "END OBSERVED\n", "made_up.txt");
}

// SOFA, "Tools for Earth Attitude" (2007), section 5.1: 2007-04-05 12:00 UTC by the IAU
// 1976/1980/1982/1994 models with the IERS's values of that day; the celestial-to-terrestrial
// matrix as printed there. Observed: 3.8e-13 about the pole, 5 ns of UT1, by which the printed one
// also differs from today's ERFA called as the cookbook calls it; all else to the last digit
// printed.
TEST(EarthOrientationEopTest, MatrixIsTheOneOfSofasCookbook) {
  const SimTime t = gps_midnight(2007, 4, 5) + 12h + 14s;
  const EarthOrientationParameters eop{.ut1_minus_utc_s = -0.072073685,
                                       .x_pole_rad = 0.0349282 * ERFA_DAS2R,
                                       .y_pole_rad = 0.4833163 * ERFA_DAS2R,
                                       .dpsi_rad = -55.0655e-3 * ERFA_DAS2R,
                                       .deps_rad = -6.3580e-3 * ERFA_DAS2R};
  const Mat3 printed{{+0.973104317712772, +0.230363826174782, -0.000703163477127},
                     {-0.230363800391868, +0.973104570648022, +0.000118545116892},
                     {+0.000711560100206, +0.000046626645796, +0.999999745754058}};
  const double difference = largest_difference(EarthOrientation::exact_R_EI(t, eop), printed);
  RecordProperty("difference", std::to_string(difference * 1e15) + "e-15");
  EXPECT_LT(difference, 5e-13);
}

// UT1 and the pole to rounding (3e-14 rad of GMST, 1e-13 in all as without a table); offsets of
// the nutation of 0.12" = 6e-7 rad by small angles of first order: their squares, 2e-13.
void expect_near_exact(const EarthOrientationTable& table, SimTime first, Duration step, int count,
                       double tolerance) {
  const EarthOrientation earth(table);
  double largest = 0;
  for (int k = 0; k < count; ++k) {
    const SimTime t = first + k * step;
    largest = std::max(
        largest, largest_difference(earth.R_EI(t), EarthOrientation::exact_R_EI(t, table.at(t))));
  }
  testing::Test::RecordProperty("largest_error_rad", std::to_string(largest * 1e15) + "e-15");
  EXPECT_LT(largest, tolerance);
}

TEST(EarthOrientationEopTest, InterpolationStaysWithinItsBound) {
  const EarthOrientationTable table = made_up_table();
  const int count = 4000;
  expect_near_exact(table, table.first(), (table.last() - table.first()) / count, count + 1, 5e-13);
}

TEST(EarthOrientationEopTest, RealFilesGiveErfasMatrices) {
  const auto celestrak = reference_text("eop/EOP-All-v1.1_2025-01-10.txt.gz");
  const auto finals = reference_text("eop/finals.all.iau2000.txt.gz");
  if (!celestrak || !finals) GTEST_SKIP() << "no eop/ below " << ORRERY_REFERENCE_DATA;
  expect_near_exact(EarthOrientationTable::parse(*celestrak, "EOP-All"), gps_midnight(1995, 5, 5),
                    41h + 17s, 2000, 5e-13);
  // dX, dY become dPsi, dEps at four instants a day, and a cubic between them.
  expect_near_exact(EarthOrientationTable::parse(*finals, "finals2000A"), gps_midnight(2005, 5, 5),
                    55h + 17s, 300, 5e-13);
}

TEST(EarthOrientationEopTest, RowsAndLeapSecondsLeaveNoJump) {
  const EarthOrientationTable table = made_up_table();
  const EarthOrientation earth(table);
  // 0h UTC of every day, among them the one after the leap second; 1 ns turns the Earth by 7e-14.
  for (SimTime t = table.first(); t < table.last(); t = table.rows_around(t).to) {
    if (t == table.first()) continue;
    EXPECT_LT(largest_difference(earth.R_EI(t), earth.R_EI(t - 1ns)), 5e-13) << to_string(t);
  }
}

TEST(EarthOrientationEopTest, ResultDoesNotDependOnWhatWasAskedBefore) {
  const EarthOrientationTable table = made_up_table();
  const EarthOrientation forwards(table), backwards(table);
  const int count = 600;
  const auto at = [&](int k) {
    return table.first() + k * ((table.last() - table.first()) / count);
  };
  std::vector<EarthAttitude> first(count + 1);
  for (int k = 0; k <= count; ++k) first[k] = forwards.at(at(k));
  for (int k = count; k >= 0; --k) {
    EXPECT_EQ(backwards.R_EI(at(k)), first[k].R_EI);
    EXPECT_EQ(backwards.at(at(k)).omega_EI_ECEF, first[k].omega_EI_ECEF);
  }
}

// By ERFA's matrices 20 s apart. Rounding of GMST: 3e-14 rad in each, 4e-15 rad/s; the offsets of
// the nutation change by 0.004" a day, 3e-13 rad/s, the pole by 0.3", 2e-11 rad/s.
TEST(EarthOrientationEopTest, AngularVelocityIsTheDerivativeOfTheMatrix) {
  const EarthOrientationTable table = made_up_table();
  const EarthOrientation earth(table);
  // Never within a minute of a row, where the slopes jump.
  for (SimTime t = table.first() + 1h + 1min; t < table.last() - 1h; t += 7h) {
    const Mat3 step = EarthOrientation::exact_R_EI(t + 10s, table.at(t + 10s)) *
                      transpose(EarthOrientation::exact_R_EI(t - 10s, table.at(t - 10s)));
    const double sine = (step.row_x.y - step.row_y.x) / 2;
    const Vec3 omega = earth.at(t).omega_EI_ECEF;
    EXPECT_NEAR(omega.z, std::asin(sine) / 20, 5e-15) << to_string(t);
    EXPECT_NEAR(omega.x, (step.row_y.z - step.row_z.y) / 40, 2e-15) << to_string(t);
    EXPECT_NEAR(omega.y, (step.row_z.x - step.row_x.z) / 40, 2e-15) << to_string(t);
  }
}

// A day of excess length turns the Earth less: -1 ms of UT1 is 7.3e-8 rad, 0.47 m at the equator.
TEST(EarthOrientationEopTest, LateUt1TurnsTheEarthLess) {
  const EarthOrientationTable table = made_up_table();
  const SimTime t = gps_midnight(2017, 1, 3) + 5h;
  const Mat3 with = EarthOrientation(table).R_EI(t), without = EarthOrientation().R_EI(t);
  const Mat3 turn = with * transpose(without);
  const EarthOrientationParameters p = table.at(t);
  EXPECT_NEAR(turn.row_x.y, 7.2921150e-5 * p.ut1_minus_utc_s, 1e-10);
  // And the pole of ITRF stands x towards Greenwich, y towards 90 deg west of the celestial one.
  EXPECT_NEAR(turn.row_x.z, p.x_pole_rad, 1e-6);
  EXPECT_NEAR(turn.row_y.z, -p.y_pole_rad, 1e-6);
}

TEST(EarthOrientationEopTest, InstantOutsideTheTableIsRefused) {
  const EarthOrientationTable table = made_up_table();
  const EarthOrientation earth(table);
  EXPECT_NO_THROW(earth.at(table.first()));
  EXPECT_NO_THROW(earth.at(table.last()));
  for (const SimTime t : {table.first() - 1ns, table.last() + 1ns, SimTime(days(5))}) {
    EXPECT_THAT([&] { earth.at(t); },
                testing::ThrowsMessage<std::out_of_range>(testing::AllOf(
                    testing::HasSubstr("made_up.txt"), testing::HasSubstr(to_string(t)),
                    testing::HasSubstr(to_string(table.first())),
                    testing::HasSubstr(to_string(table.last())))));
  }
}

}  // namespace
}  // namespace orrery
