#include "support/orbit/mean_elements.hpp"

#include <gtest/gtest.h>

#include "flight_test_support.hpp"

namespace flight_support {
namespace {

using flight_test::reference_chief;

OrbitElements eccentric(double e) {
  OrbitElements orbit = reference_chief();
  orbit.ex = 0.6 * e;
  orbit.ey = -0.8 * e;
  return orbit;
}

TEST(MeanElementsTest, StateAndElementsAreInverse) {
  for (double e : {0.0, 0.001, 0.05}) {
    for (int k = 0; k < 24; ++k) {
      OrbitElements orbit = eccentric(e);
      orbit.u_rad = kTwoPi * k / 24;
      const OrbitElements back = osculating_from_state(state_from_osculating(orbit));
      // Round-off of double over a few hundred operations: 1e-13 of each.
      EXPECT_NEAR(back.a_m, orbit.a_m, 1e-6);
      EXPECT_NEAR(wrap_pi(back.u_rad - orbit.u_rad), 0.0, 1e-12);
      EXPECT_NEAR(back.ex, orbit.ex, 1e-13);
      EXPECT_NEAR(back.ey, orbit.ey, 1e-13);
      EXPECT_NEAR(back.i_rad, orbit.i_rad, 1e-13);
      EXPECT_NEAR(wrap_pi(back.raan_rad - orbit.raan_rad), 0.0, 1e-13);
    }
  }
}

// Vis viva and the orbit equation at perigee, independent of the conversion.
TEST(MeanElementsTest, PerigeeIsWhereTheElementsSay) {
  OrbitElements orbit = eccentric(0.05);
  orbit.u_rad = std::atan2(orbit.ey, orbit.ex);  // M = 0
  const StateEci state = state_from_osculating(orbit);
  EXPECT_NEAR(norm(state.r_ECI), orbit.a_m * 0.95, 1e-6);
  EXPECT_NEAR(norm(state.v_ECI), std::sqrt(kMuEarth_m3ps2 / orbit.a_m * 1.05 / 0.95), 1e-9);
  EXPECT_NEAR(dot(state.r_ECI, state.v_ECI), 0.0, 1e-3);
}

// Brouwer's first-order variations at e = 0 (Schaub & Junkins, Analytical Mechanics, appendix F):
//   da = 3/2 J2 R^2/a sin^2 i cos 2u,  di = 3/8 J2 (R/a)^2 sin 2i cos 2u,
//   dRAAN = 3/4 J2 (R/a)^2 cos i sin 2u.
// The sum has 16 points and the functions two harmonics, so only round-off remains: 1e-9 of 9 km.
TEST(MeanElementsTest, CircularOrbitsFollowBrouwersClosedForm) {
  const OrbitElements orbit = eccentric(0.0);
  const double q = kJ2 * std::pow(kRadiusEarth_m / orbit.a_m, 2);
  const double s = std::sin(orbit.i_rad), c = std::cos(orbit.i_rad);
  for (int k = 0; k < 36; ++k) {
    OrbitElements mean = orbit;
    mean.u_rad = kTwoPi * k / 36;
    const OrbitElements osculating = osculating_from_mean(mean);
    const double c2u = std::cos(2 * mean.u_rad), s2u = std::sin(2 * mean.u_rad);
    EXPECT_NEAR(osculating.a_m - mean.a_m, 1.5 * q * mean.a_m * s * s * c2u, 1e-5);
    EXPECT_NEAR(osculating.i_rad - mean.i_rad, 0.75 * q * s * c * c2u, 1e-12);
    EXPECT_NEAR(wrap_pi(osculating.raan_rad - mean.raan_rad), 0.75 * q * c * s2u, 1e-12);
  }
}

// The same for the eccentricity vector at e = 0, from the same source with nu = M, omega = u:
//   dex = 3/2 J2 (R/a)^2 ((1 - 5/4 sin^2 i) cos u + 7/12 sin^2 i cos 3u),
//   dey = 3/2 J2 (R/a)^2 ((1 - 7/4 sin^2 i) sin u + 7/12 sin^2 i sin 3u).
TEST(MeanElementsTest, CircularOrbitsGainTheKnownEccentricity) {
  const OrbitElements orbit = eccentric(0.0);
  const double q = 1.5 * kJ2 * std::pow(kRadiusEarth_m / orbit.a_m, 2);
  const double s2 = std::pow(std::sin(orbit.i_rad), 2);
  for (int k = 0; k < 36; ++k) {
    OrbitElements mean = orbit;
    mean.u_rad = kTwoPi * k / 36;
    const double u = mean.u_rad;
    const OrbitElements osculating = osculating_from_mean(mean);
    EXPECT_NEAR(osculating.ex,
                q * ((1 - 1.25 * s2) * std::cos(u) + 7.0 / 12 * s2 * std::cos(3 * u)), 1e-12);
    EXPECT_NEAR(osculating.ey,
                q * ((1 - 1.75 * s2) * std::sin(u) + 7.0 / 12 * s2 * std::sin(3 * u)), 1e-12);
  }
}

// The convention: the variation averages to zero over M. 64 points integrate all its harmonics
// exactly. The bound is the accuracy that the header states, 1e-4 of variations of 9 km and 1e-3
// rad.
TEST(MeanElementsTest, TheVariationHasNoMean) {
  for (double e : {0.001, 0.02, 0.05}) {
    double a_m = 0, u_rad = 0, ex = 0, ey = 0, i_rad = 0, raan_rad = 0;
    for (int k = 0; k < 64; ++k) {
      OrbitElements mean = eccentric(e);
      mean.u_rad = kTwoPi * k / 64;
      const OrbitElements osculating = osculating_from_mean(mean);
      a_m += (osculating.a_m - mean.a_m) / 64;
      u_rad += wrap_pi(osculating.u_rad - mean.u_rad) / 64;
      ex += (osculating.ex - mean.ex) / 64;
      ey += (osculating.ey - mean.ey) / 64;
      i_rad += (osculating.i_rad - mean.i_rad) / 64;
      raan_rad += wrap_pi(osculating.raan_rad - mean.raan_rad) / 64;
    }
    EXPECT_NEAR(a_m, 0, 1.0) << e;
    for (double angle : {u_rad, ex, ey, i_rad, raan_rad}) EXPECT_NEAR(angle, 0, 1e-7) << e;
  }
}

// Three rounds, each takes three digits off 9 km and 1.3e-3 rad.
TEST(MeanElementsTest, OsculatingAndMeanAreInverse) {
  for (int k = 0; k < 24; ++k) {
    OrbitElements mean = reference_chief();
    mean.u_rad = kTwoPi * k / 24;
    const OrbitElements back = mean_from_osculating(osculating_from_mean(mean));
    EXPECT_NEAR(back.a_m, mean.a_m, 1e-3);
    EXPECT_NEAR(wrap_pi(back.u_rad - mean.u_rad), 0.0, 1e-10);
    EXPECT_NEAR(back.ex, mean.ex, 1e-10);
    EXPECT_NEAR(back.ey, mean.ey, 1e-10);
  }
}

// Against a numerical orbit of an oblate Earth, in Cartesian coordinates: what remains is second
// order, the square of the first-order amplitude 3/2 J2 (R/a)^2 = 1.4e-3 times a factor of a few; 4
// is allowed, 7.6e-6 or 52 m. Rates are off by as much, 94.6 rad of motion in a day make 7e-4 rad
// of it, and so in u does -3/2 n t da/a. Observed: a 28 m, e 2e-6, RAAN 1.4e-5, u 7e-5.
TEST(MeanElementsTest, MeanElementsOfAnOblateOrbitAreSmooth) {
  const OrbitElements start = reference_chief();
  StateEci state = flight_test::state_of_mean(start);
  for (int k = 0; k <= 100; ++k) {
    const double t_s = 864.0 * k;
    const OrbitElements expected = propagate_mean(start, t_s);
    const OrbitElements mean = flight_test::mean_of_state(state);
    EXPECT_NEAR(mean.a_m, expected.a_m, 52.0) << t_s;
    EXPECT_NEAR(mean.ex, expected.ex, 7.6e-6) << t_s;
    EXPECT_NEAR(mean.ey, expected.ey, 7.6e-6) << t_s;
    EXPECT_NEAR(mean.i_rad, expected.i_rad, 7.6e-6) << t_s;
    EXPECT_NEAR(wrap_pi(mean.raan_rad - expected.raan_rad), 0.0, 7e-4) << t_s;
    EXPECT_NEAR(wrap_pi(mean.u_rad - expected.u_rad), 0.0, 7e-4) << t_s;
    state = flight_test::propagate_oblate(state, 864.0);
  }
}

// Vallado (2013), eq. 9-37 with e = 0: the node of a sun-synchronous orbit advances 360 deg a
// tropical year, 0.9856 deg a day; at 550 km and 97.59 deg within 0.2 %.
TEST(MeanElementsTest, TheReferenceOrbitIsSunSynchronous) {
  const double degrees_per_day = secular_rates(eccentric(0.0)).raan_radps * 86400 * 180 / kPi;
  EXPECT_NEAR(degrees_per_day, 360.0 / 365.2422, 0.002);
}

}  // namespace
}  // namespace flight_support
