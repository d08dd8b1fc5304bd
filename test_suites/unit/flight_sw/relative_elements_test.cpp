#include "support/orbit/relative_elements.hpp"

#include <gtest/gtest.h>

#include "flight_test_support.hpp"

namespace flight_support {
namespace {

using flight_test::reference_chief;
using flight_test::roe;

TEST(RelativeElementsTest, ApplyIsTheInverseAcrossTheWrapOfAngles) {
  for (double u : {0.0, 1e-6, 3.0, kTwoPi - 1e-6}) {
    OrbitElements chief = reference_chief();
    chief.u_rad = u;
    chief.raan_rad = kTwoPi - 1e-6;
    const RelativeElements expected = roe(12, -345, 67, -300, 8, 300);
    const RelativeElements found =
        relative_elements(chief, apply_relative_elements(chief, expected));
    // Round-off of angles of 2 pi: 1e-15 * 7e6 m, a few times.
    for (int k = 0; k < 6; ++k) EXPECT_NEAR(found[k], expected[k], 1e-7) << u;
  }
}

// Column by column against finite differences of the secular motion of two orbits, which is how the
// matrix is defined. Steps of +-10 m; their second order is 10 m * 10/7e6 * n t, 5 mm of 10 m in
// dl.
TEST(RelativeElementsTest, TransitionIsTheDerivativeOfSecularMotion) {
  for (double e : {0.001, 0.02}) {
    OrbitElements chief = reference_chief();
    chief.ex = -0.8 * e, chief.ey = 0.6 * e;
    for (double t_s : {600.0, -30000.0, 57400.0}) {
      const Matrix6 Phi = state_transition(chief, t_s);
      for (int column = 0; column < 6; ++column) {
        const auto moved = [&](double step_m) {
          RelativeElements a_roe;
          a_roe[column] = step_m;
          return relative_elements(propagate_mean(chief, t_s),
                                   propagate_mean(apply_relative_elements(chief, a_roe), t_s));
        };
        const RelativeElements difference = (1.0 / 20.0) * (moved(10.0) - moved(-10.0));
        for (int row = 0; row < 6; ++row) {
          // Central differences leave third order and round-off: 1e-7 m / 20 m, and 1e-7 of the
          // entry.
          const double tolerance = 1e-7 + 1e-6 * std::fabs(Phi(row, column));
          EXPECT_NEAR(Phi(row, column), difference[row], tolerance)
              << "row " << row << " column " << column << " t " << t_s << " e " << e;
        }
      }
    }
  }
}

// Against two numerical orbits of an oblate Earth. Second order in J2: 7.6e-6
// (mean_elements_test.cpp) of 450 m, times 5 for the steepest harmonic: 2 cm; rates alike, 94.6 rad
// a day: 0.4 m in the drifting elements. Second order in a_roe: a_roe^2/a = 2 cm; in a*da 94 times
// that in a*dl after ten revolutions.
TEST(RelativeElementsTest, MeanElementsOfTwoOblateOrbitsFollowTheTransition) {
  const RelativeElements start = roe(0, 0, 0, 300, 0, 300);
  const OrbitElements chief = reference_chief();
  StateEci c = flight_test::state_of_mean(chief);
  StateEci d = flight_test::state_of_mean(apply_relative_elements(chief, start));
  for (int k = 1; k <= 60; ++k) {
    c = flight_test::propagate_oblate(c, 960.0);
    d = flight_test::propagate_oblate(d, 960.0);
    const RelativeElements found =
        relative_elements(flight_test::mean_of_state(c), flight_test::mean_of_state(d));
    const RelativeElements expected = state_transition(chief, 960.0 * k) * start;
    EXPECT_NEAR(found[kDa], expected[kDa], 0.04) << k;
    EXPECT_NEAR(found[kDl], expected[kDl], 2.0) << k;
    for (int element = kDex; element <= kDiy; ++element) {
      EXPECT_NEAR(found[element], expected[element], 0.4) << k << ' ' << element;
    }
  }
}

// An impulse on a state, seen in osculating elements: the definition. The published matrix drops
// terms of order e in the argument of latitude (row dl); the others are exact.
TEST(RelativeElementsTest, ControlInputIsWhatAnImpulseDoes) {
  for (int k = 0; k < 16; ++k) {
    OrbitElements orbit = reference_chief();
    orbit.u_rad = kTwoPi * k / 16;
    const flight_support::Matrix<6, 3> B = control_input(orbit);
    const StateEci state = state_from_osculating(orbit);
    const flight_support::Mat3 R_IH = transpose(eci_to_rtn(state));
    for (int axis = 0; axis < 3; ++axis) {
      flight_support::Vec3 dv_RTN;
      dv_RTN[axis] = 0.01;
      const auto kicked = [&](double sign) {
        return relative_elements(
            orbit, osculating_from_state({state.r_ECI, state.v_ECI + sign * (R_IH * dv_RTN)}));
      };
      const RelativeElements difference = (1.0 / 0.02) * (kicked(1.0) - kicked(-1.0));
      // Of 2/n = 1827 m per m/s: e = 1e-3 in row dl, and round-off 1e-7 m / 0.02 m/s elsewhere.
      for (int row = 0; row < 6; ++row) {
        EXPECT_NEAR(B(row, axis), difference[row], row == kDl ? 2.0 : 1e-3)
            << "row " << row << " axis " << axis << " u " << orbit.u_rad;
      }
    }
  }
}

// Linear and near-circular: errors of order e * a_roe = 0.3 m, and a_roe^2 / a = 13 mm.
TEST(RelativeElementsTest, RtnMapAgreesWithTwoKeplerianOrbits) {
  const RelativeElements a_roe = roe(-30, 200, 100, 300, -50, 300);
  for (int k = 0; k < 16; ++k) {
    OrbitElements chief = reference_chief();
    chief.u_rad = kTwoPi * k / 16;
    const double n = mean_motion_radps(chief.a_m);
    const RelativeStateRtn exact = relative_state_rtn(
        state_from_osculating(chief), state_from_osculating(apply_relative_elements(chief, a_roe)));
    const auto linear = rtn_from_relative_elements(chief.u_rad, n) * a_roe;
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_NEAR(linear[axis], exact.r_DC_RTN[axis], 2.0) << axis;
      EXPECT_NEAR(linear[axis + 3], exact.v_DC_RTN[axis], 2.0 * n) << axis;
    }
  }
}

TEST(RelativeElementsTest, TheMapFromInertialDifferencesIsTheInverse) {
  const double n = 1.0948e-3;
  for (int k = 0; k < 16; ++k) {
    const double u = kTwoPi * k / 16;
    Matrix6 inertial = flight_support::identity<6>();  // vx = vx_ECI + n y, vy = vy_ECI - n x
    inertial(3, 1) = n;
    inertial(4, 0) = -n;
    const Matrix6 product =
        rtn_from_relative_elements(u, n) * relative_elements_from_inertial_rtn(u, n);
    for (int r = 0; r < 6; ++r) {
      for (int c = 0; c < 6; ++c) EXPECT_NEAR(product(r, c), inertial(r, c), 1e-12);
    }
  }
}

// D'Amico & Montenbruck (2006): d = sqrt(2) |de.di| / sqrt(de^2 + di^2 + |de + di| |de - di|). The
// header promises 0.4 m of 300 m for the sampling.
TEST(RelativeElementsTest, MinimumDistanceAgreesWithTheClosedForm) {
  flight_test::Noise noise(3);
  for (int k = 0; k < 200; ++k) {
    const double ex = 300 * noise.normal(), ey = 300 * noise.normal();
    const double ix = 300 * noise.normal(), iy = 300 * noise.normal();
    const double product = std::fabs(ex * ix + ey * iy);
    const double sum = std::hypot(ex + ix, ey + iy), difference = std::hypot(ex - ix, ey - iy);
    const double closed = std::sqrt(2.0) * product /
                          std::sqrt(ex * ex + ey * ey + ix * ix + iy * iy + sum * difference);
    const double size = std::fmax(std::hypot(ex, ey), std::hypot(ix, iy));
    const double sampled = minimum_radial_normal_m(roe(0, 0, ex, ey, ix, iy));
    EXPECT_GE(sampled, closed - 1e-9);
    EXPECT_LE(sampled, closed + size * kTwoPi / 128);
  }
}

// With a*da the ellipse is shifted radially: parallel vectors of equal size E leave E - |a da|.
TEST(RelativeElementsTest, RadialOffsetTakesFromTheMinimumDistance) {
  EXPECT_NEAR(minimum_radial_normal_m(roe(50, 0, 0, 150, 0, 150)), 100.0, 0.4);
  EXPECT_NEAR(minimum_radial_normal_m(roe(-50, 999, 0, 150, 0, 150)), 100.0, 0.4);
  EXPECT_NEAR(minimum_radial_normal_m(roe(0, 0, 300, 0, 0, 300)), 0.0, 0.4);
}

TEST(RelativeElementsTest, RtnAxesPointWhereTheirNamesSay) {
  const StateEci state = state_from_osculating(reference_chief());
  const flight_support::Mat3 R_HI = eci_to_rtn(state);
  const flight_support::Vec3 r = R_HI * state.r_ECI, v = R_HI * state.v_ECI;
  EXPECT_NEAR(r[0], norm(state.r_ECI), 1e-6);
  EXPECT_NEAR(r[1], 0, 1e-6);
  EXPECT_NEAR(r[2], 0, 1e-6);
  EXPECT_GT(v[1], 7000);
  EXPECT_NEAR(v[2], 0, 1e-9);
}

}  // namespace
}  // namespace flight_support
