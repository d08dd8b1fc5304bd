#include "formation_gnc/navigation/orbit_pair.hpp"

#include <orrery/models/orbit/gravity_force.hpp>
#include <orrery/models/orbit/space_environment.hpp>
#include <orrery/models/orbit/spacecraft_orbit.hpp>

#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "formation_gnc/navigation/flight_gravity.hpp"
#include "support/orbit/constants.hpp"

namespace formation_gnc {
namespace {

using flight_support::vec3;

const Vec3 kPlace = vec3(4.0e6, -3.2e6, 4.6e6);

// GGM05S at one place, two independent formulations outside this project agree to 1e-15.
TEST(FlightGravityTest, EqualsPublishedVectors) {
  const Vec3 r[2] = {kPlace, kPlace};
  const double expected[2][3] = {{-4.8773340701340544, 3.9019224760528317, -5.6246624520102380},
                                 {-4.8773698526738842, 3.9021488421411883, -5.6246764767453490}};
  for (int k = 0; k < 2; ++k) {
    Vec3 a[2];
    gravity_ECEF(k == 0 ? 2 : 20, r, a);
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_NEAR(a[0][axis], expected[k][axis], 5e-15);
      EXPECT_EQ(a[0][axis], a[1][axis]);
    }
  }
}

TEST(FlightGravityTest, IsFiniteOnTheAxis) {
  const Vec3 r[2] = {vec3(0, 0, 7e6), vec3(0, 0, -7e6)};
  Vec3 a[2];
  gravity_ECEF(20, r, a);
  EXPECT_NEAR(a[0][2], -8.12, 0.02);
  EXPECT_TRUE(flight_support::is_finite(a[0]) && flight_support::is_finite(a[1]));
}

orrery::OrbitState truth_state(const Vec3& r, const Vec3& v, orrery::SimTime t) {
  return {t, {r[0], r[1], r[2]}, {v[0], v[1], v[2]}, 11};
}

// Against the simulator's propagator (Gauss's equations in elements, another implementation of the
// field and of Earth orientation) with the same field of 20x20, 40 m apart, over 30 min in steps of
// 10 s. Nystroem's error goes with the fourth power of the step, 0.43 m at 30 s: 5.3 mm at 10 s.
// Seen: 4.8 mm; relative 2e-7 m; with steps of 5 s 0.25 mm, where the flight's shorter nutation
// shows.
TEST(OrbitPairTest, CoastsAsTheSimulatorDoes) {
  using namespace orrery;
  const SimTime start = gps_midnight(2025, 3, 20);
  OrbitPair pair;
  pair.r[0] = vec3(4.9e6, -2.0e6, 4.45e6);
  pair.v[0] = vec3(3.30e3, 6.7e3, -0.6e3);
  pair.r[1] = pair.r[0] + vec3(20, -25, 24);
  pair.v[1] = pair.v[0] + vec3(0.01, 0.02, -0.03);
  const auto space = std::make_shared<const EarthEnvironment>();
  SpacecraftOrbitOptions options{.forces = {make_earth_gravity(20)}, .environment = space};
  SpacecraftOrbit first(truth_state(pair.r[0], pair.v[0], start), options);
  SpacecraftOrbit second(truth_state(pair.r[1], pair.v[1], start), options);
  EarthAttitude earth;
  OrbitPairOptions step;
  step.longest_step_s = 10.0;
  coast(&pair, to_ns(start), 1800.0, step, &earth);
  const OrbitState a = first.at(start + 1800s), b = second.at(start + 1800s);
  const orrery::Vec3 error = orrery::Vec3{pair.r[0][0], pair.r[0][1], pair.r[0][2]} - a.r_ECI;
  const orrery::Vec3 relative =
      orrery::Vec3{pair.r[1][0] - pair.r[0][0], pair.r[1][1] - pair.r[0][1],
                   pair.r[1][2] - pair.r[0][2]} -
      (b.r_ECI - a.r_ECI);
  EXPECT_LT(norm(error), 1e-2);
  EXPECT_LT(norm(relative), 1e-6);
}

TEST(OrbitPairTest, CoastsBackToWhereItCameFrom) {
  OrbitPair pair;
  pair.r[0] = pair.r[1] = vec3(4.9e6, -2.0e6, 4.45e6);
  pair.v[0] = pair.v[1] = vec3(3.30e3, 6.7e3, -0.6e3);
  const OrbitPair before = pair;
  EarthAttitude earth;
  coast(&pair, 1'426'500'000'000'000'000, 95.0, {}, &earth);
  coast(&pair, 1'426'500'095'000'000'000, -95.0, {}, &earth);
  // Twice the error of seven steps.
  EXPECT_LT(norm(pair.r[0] - before.r[0]), 1e-4);
  EXPECT_LT(norm(pair.v[0] - before.v[0]), 1e-6);
}

// Differences over 200 m; the field's fourth derivative leaves 1e-15 1/s^2 of 1e-6.
TEST(OrbitPairTest, GradientIsThatOfCentralTermAndJ2) {
  const Mat3 G = gravity_gradient(kPlace);
  for (int j = 0; j < 3; ++j) {
    Vec3 step;
    step[j] = 100.0;
    const Vec3 r[2] = {kPlace + step, kPlace - step};
    Vec3 a[2];
    gravity_ECEF(2, r, a);
    for (int i = 0; i < 3; ++i) {
      // C22 and S22, which the gradient leaves out, are 2e-6 of it.
      EXPECT_NEAR(G(i, j), (a[0][i] - a[1][i]) / 200.0, 3e-11) << i << j;
    }
  }
}

const Vec3 kTau_s = vec3(200.0, 5700.0, 100.0);

// Transition against the flow itself, by differences of trajectories 100 m and 0.1 m/s apart. The
// gradient of the middle stands for all of the step; it turns by 3 n G at most, which dt^3 / 12
// makes 7e-7 of rr and vv, and dt^4 / 24 of rv. Seen: 2e-7.
TEST(OrbitPairTest, TransitionIsTheDerivativeOfTheFlow) {
  const Vec3 r = vec3(4.9e6, -2.0e6, 4.45e6), v = vec3(3.30e3, 6.7e3, -0.6e3);
  const std::int64_t t_ns = 1'426'500'000'000'000'000;
  EarthAttitude earth;
  OrbitPair reference;
  reference.r[0] = reference.r[1] = r;
  reference.v[0] = reference.v[1] = v;
  coast(&reference, t_ns, 10.0, {}, &earth);
  const OrbitTransition t =
      orbit_transition(0.5 * (r + reference.r[0]), 0.5 * (v + reference.v[0]), 10.0, kTau_s);
  for (int j = 0; j < 3; ++j) {
    OrbitPair moved;
    moved.r[0] = moved.r[1] = r;
    moved.v[0] = moved.v[1] = v;
    moved.r[0][j] += 100.0;
    moved.v[1][j] += 0.1;
    coast(&moved, t_ns, 10.0, {}, &earth);
    for (int i = 0; i < 3; ++i) {
      EXPECT_NEAR(t.rr(i, j), (moved.r[0][i] - reference.r[0][i]) / 100.0, 7e-7);
      EXPECT_NEAR(t.vr(i, j), (moved.v[0][i] - reference.v[0][i]) / 100.0, 4e-9);
      EXPECT_NEAR(t.rv(i, j), (moved.r[1][i] - reference.r[1][i]) / 0.1, 4e-6);
      EXPECT_NEAR(t.vv(i, j), (moved.v[1][i] - reference.v[1][i]) / 0.1, 7e-7);
    }
  }
}

// The noise against quadrature of its definition, P = integral of q g g^T + w h h^T with g = (r, v,
// a) that a unit impulse of the Gauss-Markov process's noise builds up, h that of a unit impulse.
// The series end at x^2, x = dt/tau: 4e-4 at 15 s of 200 s, 3e-3 of 100 s.
TEST(OrbitPairTest, NoiseIsTheIntegralOfItsDefinition) {
  const double dt = 15.0;
  const EmpiricalAcceleration empirical = {vec3(2e-5, 1e-9, 3e-7), kTau_s, vec3(0, 1e-16, 1e-11)};
  const OrbitNoise noise = orbit_noise(flight_support::identity<3>(), dt, empirical);
  for (int axis = 0; axis < 3; ++axis) {
    const double tau = kTau_s[axis], sigma = empirical.sigma_mps2[axis];
    const double q = 2 * sigma * sigma / tau, w = empirical.white_m2ps3[axis];
    double expected[3][3] = {};
    const int steps = 20000;
    for (int k = 0; k < steps; ++k) {
      const double s = dt * (k + 0.5) / steps, e = std::exp(-s / tau);
      const double g[3] = {tau * tau * (s / tau - 1 + e), tau * (1 - e), e}, h[3] = {s, 1, 0};
      for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) {
          expected[i][j] += (q * g[i] * g[j] + w * h[i] * h[j]) * dt / steps;
        }
      }
    }
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        double sum = 0.0;
        for (int c = 0; c < 9; ++c) {
          sum += noise.column[c][3 * i + axis] * noise.weight[c] * noise.column[c][3 * j + axis];
        }
        EXPECT_NEAR(sum, expected[i][j], 3e-3 * std::sqrt(expected[i][i] * expected[j][j])) << axis;
      }
    }
  }
  for (double weight : noise.weight) EXPECT_GT(weight, 0.0);
}

// The empirical part of the transition: a constant acceleration of self for tau much longer than
// the step moves by a dt^2/2 and a dt, less the decay's third of x = dt/tau: 1e-3.
TEST(OrbitPairTest, EmpiricalAccelerationsDecayEachWithItsTimeConstant) {
  const OrbitTransition t = orbit_transition(kPlace, vec3(0.0, 7.5e3, 100.0), 10.0, kTau_s);
  const Mat3 R_IH = rtn_to_eci(kPlace, vec3(0.0, 7.5e3, 100.0));
  for (int axis = 0; axis < 3; ++axis) {
    const double x = 10.0 / kTau_s[axis];
    EXPECT_NEAR(t.aa[axis], std::exp(-x), 1e-15);
    for (int k = 0; k < 3; ++k) {
      EXPECT_NEAR(t.va(k, axis), 10.0 * (1 - x / 2 + x * x / 6) * R_IH(k, axis), 10 * x * x * x);
      EXPECT_NEAR(t.ra(k, axis), 50.0 * (1 - x / 3 + x * x / 12) * R_IH(k, axis), 50 * x * x * x);
    }
  }
}

}  // namespace
}  // namespace formation_gnc
