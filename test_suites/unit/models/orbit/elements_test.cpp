#include <orrery/models/orbit/elements.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

namespace orrery {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::ThrowsMessage;

constexpr double kPi = 3.141592653589793;

// Vallado, Fundamentals of Astrodynamics (4th ed.), example 2-5, printed to these digits. The
// state's last printed digit, 0.5 m in r, moves the semi-major axis by 2 (a/r)^2 0.5 m = 10 m.
TEST(ElementsTest, TextbookStateGivesTextbookElements) {
  const InertialState state{{6524.834e3, 6862.875e3, 6448.296e3},
                            {4.901327e3, 5.533756e3, -1.976341e3}};
  const KeplerianElements k = to_keplerian(state, 398600.4418e9);
  EXPECT_NEAR(k.a_m, 36127.343e3, 10);
  EXPECT_NEAR(k.e, 0.832853, 5e-7);
  EXPECT_NEAR(k.i_rad * 180 / kPi, 87.870, 1e-3);
  EXPECT_NEAR(k.raan_rad * 180 / kPi, 227.898, 1e-3);
  EXPECT_NEAR(k.argument_of_perigee_rad * 180 / kPi, 53.38, 1e-2);
  // true anomaly 92.335 deg -> mean anomaly by Kepler's equation
  const double nu = 92.335 * kPi / 180;
  const double E = 2 * std::atan(std::sqrt((1 - k.e) / (1 + k.e)) * std::tan(nu / 2));
  EXPECT_NEAR(k.mean_anomaly_rad, E - k.e * std::sin(E), 2e-5);
}

// A circle in the equator's normal plane: all components by hand.
TEST(ElementsTest, CircularPolarOrbitIsExact) {
  const InertialState s = to_inertial(QuasiNonsingularElements{7e6, 0, 0, kPi / 2, 0, kPi / 2});
  EXPECT_NEAR(s.r_ECI.z, 7e6, 1e-8);
  EXPECT_NEAR(s.r_ECI.x, 0, 1e-8);
  EXPECT_NEAR(s.v_ECI.x, -std::sqrt(kMuEarth_m3ps2 / 7e6), 1e-11);
}

// Tolerances: 1e-15 relative in position and velocity, times the conditioning 1/(1 - e) of the way
// back.
TEST(ElementsTest, CartesianDetourKeepsTheElements) {
  for (const double e : {0.0, 1e-9, 0.001, 0.3, 0.9}) {
    for (const double omega : {0.0, 1.0, 4.0}) {
      for (double u = 0.05; u < 2 * kPi; u += 0.3) {
        const QuasiNonsingularElements x{9e6, e * std::cos(omega), e * std::sin(omega), 1.7, 5.9,
                                         u};
        const QuasiNonsingularElements y = to_quasi_nonsingular(to_inertial(x));
        const double tolerance = 2e-14 / ((1 - e) * (1 - e));
        EXPECT_NEAR(y.a_m / x.a_m, 1, tolerance);
        EXPECT_NEAR(y.ex, x.ex, tolerance);
        EXPECT_NEAR(y.ey, x.ey, tolerance);
        EXPECT_NEAR(y.i_rad, x.i_rad, tolerance);
        EXPECT_NEAR(y.raan_rad, x.raan_rad, tolerance);
        EXPECT_NEAR(wrap_to_pi(y.u_rad - x.u_rad), 0, tolerance);
      }
    }
  }
}

TEST(ElementsTest, KeplerianDetourKeepsTheElements) {
  const KeplerianElements k{7e6, 0.01, 1.2, 3.0, 5.0, 6.0};
  const KeplerianElements back = to_keplerian(to_quasi_nonsingular(k));
  EXPECT_NEAR(back.e, k.e, 1e-16);
  EXPECT_NEAR(back.argument_of_perigee_rad, k.argument_of_perigee_rad, 1e-13);
  EXPECT_NEAR(back.mean_anomaly_rad, k.mean_anomaly_rad, 1e-13);
}

// Over Cartesian coordinates, e and i away from their singularities: perigee is known to the
// rounding of e divided by it.
TEST(ElementsTest, CartesianDetourKeepsKeplerianElements) {
  for (const double e : {1e-3, 0.2, 0.7}) {
    for (double angle = 0.1; angle < 2 * kPi; angle += 0.7) {
      const KeplerianElements k{
          2.4e7, e, 0.4 + 0.3 * angle, angle, wrap_to_two_pi(2 * angle), wrap_to_two_pi(3 * angle)};
      const KeplerianElements back = to_keplerian(to_inertial(k));
      const double tolerance = 2e-14 / ((1 - e) * (1 - e));
      EXPECT_NEAR(back.a_m / k.a_m, 1, tolerance);
      EXPECT_NEAR(back.e, k.e, tolerance);
      EXPECT_NEAR(back.i_rad, k.i_rad, tolerance);
      EXPECT_NEAR(wrap_to_pi(back.raan_rad - k.raan_rad), 0, 10 * tolerance);
      EXPECT_NEAR(wrap_to_pi(back.argument_of_perigee_rad - k.argument_of_perigee_rad), 0,
                  10 * tolerance / e);
      EXPECT_NEAR(wrap_to_pi(back.mean_anomaly_rad - k.mean_anomaly_rad), 0, 10 * tolerance / e);
    }
  }
}

TEST(ElementsTest, KeplersEquationHoldsEverywhere) {
  for (const double e : {0.0, 0.001, 0.5, 0.95}) {
    for (double u = -20; u < 20; u += 0.37) {
      const QuasiNonsingularElements x{1, e * 0.6, e * 0.8, 1, 0, u};
      const OrbitPoint p = solve_kepler(x);
      const double F = std::atan2(p.sin_F, p.cos_F);
      EXPECT_NEAR(wrap_to_pi(F - x.ex * p.sin_F + x.ey * p.cos_F - u), 0, 4e-15);
      EXPECT_NEAR(p.sin_theta * p.sin_theta + p.cos_theta * p.cos_theta, 1, 1e-14 / (1 - e));
    }
  }
}

TEST(ElementsTest, OrbitBelowTheGroundIsRefusedWithItsPerigee) {
  EXPECT_THAT(
      [] {
        require_above_ground({6.9e6, 0.08, 0, 1, 0, 0}, "here");
      },
      ThrowsMessage<std::invalid_argument>(AllOf(HasSubstr("here"), HasSubstr("below the ground"),
                                                 HasSubstr("6348000"), HasSubstr("6378136.3"))));
  EXPECT_NO_THROW(require_above_ground({6.9e6, 0.07, 0, 1, 0, 0}, "here"));
}

TEST(ElementsTest, WhatIsNoEllipseIsRefused) {
  EXPECT_THROW(to_inertial(QuasiNonsingularElements{7e6, 0.8, 0.6, 1, 0, 0}),
               std::invalid_argument);
  EXPECT_THROW(to_inertial(QuasiNonsingularElements{-7e6, 0, 0, 1, 0, 0}), std::invalid_argument);
  EXPECT_THROW(to_inertial(QuasiNonsingularElements{7e6, 0, 0, -0.1, 0, 0}), std::invalid_argument);
  EXPECT_THROW(to_inertial(QuasiNonsingularElements{7e6, 0, 0, 1, NAN, 0}), std::invalid_argument);
  EXPECT_THROW(to_quasi_nonsingular(KeplerianElements{7e6, 1.0, 1, 0, 0, 0}),
               std::invalid_argument);
  EXPECT_THROW(to_quasi_nonsingular(InertialState{{7e6, 0, 0}, {0, 11e3, 1e3}}),
               std::invalid_argument)
      << "escape velocity";
  EXPECT_THROW(to_quasi_nonsingular(InertialState{{7e6, 0, 0}, {1e3, 0, 0}}), std::invalid_argument)
      << "straight down";
}

TEST(ElementsTest, EquatorialOrbitHasNoNode) {
  EXPECT_THAT(
      [] {
        to_quasi_nonsingular(InertialState{{7e6, 0, 0}, {0, 7.5e3, 0}});
      },
      ThrowsMessage<std::invalid_argument>(HasSubstr("equatorial")));
  EXPECT_THROW(to_quasi_nonsingular(InertialState{{7e6, 0, 0}, {0, -7.5e3, 0}}),
               std::invalid_argument);
}

TEST(ElementsTest, AnglesWrapIntoTheirRange) {
  EXPECT_NEAR(wrap_to_pi(3 * kPi), kPi, 1e-15);
  EXPECT_EQ(wrap_to_pi(-kPi), kPi);
  EXPECT_NEAR(wrap_to_pi(7), 7 - 2 * kPi, 1e-15);
  EXPECT_NEAR(wrap_to_two_pi(-0.5), 2 * kPi - 0.5, 1e-15);
  EXPECT_EQ(wrap_to_two_pi(0), 0);
}

}  // namespace
}  // namespace orrery
