#include "formation_gnc/navigation/ud_factor.hpp"

#include <orrery/harness/kernel/random.hpp>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "formation_gnc/navigation/orbit_pair.hpp"

// The naive model is a full matrix: Joseph's update, congruences, sums.
namespace formation_gnc {
namespace {

using Covariance = Eigen::Matrix<double, kStates, kStates>;
using Column = Eigen::Matrix<double, kStates, 1>;

Covariance matrix_of(const UdFactor& ud) {
  Covariance P;
  for (int i = 0; i < kStates; ++i) {
    for (int j = 0; j < kStates; ++j) P(i, j) = ud.covariance(i, j);
  }
  return P;
}

Column dense(const SparseRow& h) {
  Column column = Column::Zero();
  for (int k = 0; k < h.count; ++k) column(h.state[k]) = h.value[k];
  return column;
}

Column random_column(orrery::RandomStream* random, int last) {
  Column g = Column::Zero();
  for (int k = 0; k <= last; ++k) g(k) = random->uniform(-1, 1);
  return g;
}

SparseRow random_row(orrery::RandomStream* random) {
  SparseRow h;
  int state = static_cast<int>(random->integer(0, 5));
  while (h.count < SparseRow::kMost && state < kStates) {
    h.add(state, random->uniform(-1, 1));
    state += 1 + static_cast<int>(random->integer(0, 6));
  }
  return h;
}

UdFactor random_factor(orrery::RandomStream* random) {
  UdFactor ud;
  for (int k = 0; k < 50; ++k) ud.add(1.0, random_column(random, kStates - 1).data(), kStates - 1);
  return ud;
}

double distance(const Covariance& a, const Covariance& b) {
  return (a - b).norm() / b.norm();
}

// Tolerance of this file: 44 states, numbers near 1, some 10^3 operations on each: 1e-12; seen
// 3e-15.
constexpr double kTolerance = 1e-12;

TEST(UdFactorTest, MeasurementEqualsJosephsForm) {
  orrery::RandomStream random(1);
  UdFactor ud = random_factor(&random);
  for (int k = 0; k < 20; ++k) {
    const SparseRow row = random_row(&random);
    const Column h = dense(row);
    const Covariance P = matrix_of(ud);
    const double r = 0.1 + 0.01 * k, s = h.dot(P * h) + r;
    const Column K = P * h / s;
    const Covariance left = Covariance::Identity() - K * h.transpose();
    const Projection projection = ud.project(row);
    EXPECT_NEAR(projection.variance + r, s, kTolerance * s);
    Column gain;
    ud.measure(projection, r, gain.data());
    EXPECT_LT((gain - K).norm(), kTolerance * K.norm());
    EXPECT_LT(distance(matrix_of(ud), left * P * left.transpose() + r * K * K.transpose()),
              kTolerance);
  }
}

TEST(UdFactorTest, AdditionOfRankOneEqualsTheSum) {
  orrery::RandomStream random(2);
  UdFactor ud = random_factor(&random);
  for (int last : {0, 1, 16, 31, kStates - 1}) {
    const Covariance P = matrix_of(ud);
    const Column g = random_column(&random, last);
    ud.add(0.7, g.data(), last);
    EXPECT_LT(distance(matrix_of(ud), P + 0.7 * g * g.transpose()), kTolerance) << last;
  }
}

TEST(UdFactorTest, ForgottenStateLeavesTheOthersAsTheyWere) {
  orrery::RandomStream random(3);
  UdFactor ud = random_factor(&random);
  for (int state : {0, 1, 5, 20, 37, kStates - 1}) {
    Covariance expected = matrix_of(ud);
    expected.row(state).setZero();
    expected.col(state).setZero();
    expected(state, state) = 9.0;
    ud.forget(state, 9.0);
    EXPECT_LT(distance(matrix_of(ud), expected), kTolerance) << state;
  }
}

TEST(UdFactorTest, OrbitsMoveAsTheFullMatrixDoes) {
  orrery::RandomStream random(4);
  UdFactor ud = random_factor(&random);
  for (int clock = 0; clock < kClocks; ++clock) ud.forget(clock, 100.0);
  const flight_support::Vec3 r = flight_support::vec3(4.0e6, -3.2e6, 4.6e6);
  const flight_support::Vec3 v = flight_support::vec3(5.0e3, 5.7e3, -0.4e3);
  const flight_support::Mat3 R_IH = rtn_to_eci(r, v);
  const EmpiricalAcceleration fast = {
      flight_support::vec3(2e-1, 2e-1, 1e-1), flight_support::vec3(200.0, 200.0, 200.0), {}};
  const EmpiricalAcceleration slow = {flight_support::vec3(1e-2, 3e-2, 1e-2),
                                      flight_support::vec3(200.0, 5700.0, 100.0),
                                      flight_support::vec3(0.0, 1e-2, 0.0)};
  const OrbitTransition t_self = orbit_transition(r, v, 10.0, fast.tau_s);
  const OrbitTransition t_difference = with_time_constants(t_self, R_IH, 10.0, slow.tau_s);
  const OrbitNoise self = orbit_noise(R_IH, 10.0, fast);
  const OrbitNoise difference = orbit_noise(R_IH, 10.0, slow);

  Covariance Phi = Covariance::Identity(), Q = Covariance::Zero();
  for (int first : {kPositionSelf, kPositionDifference}) {
    const OrbitTransition& t = first == kPositionSelf ? t_self : t_difference;
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        Phi(first + i, first + j) = t.rr(i, j);
        Phi(first + i, first + 3 + j) = t.rv(i, j);
        Phi(first + i, first + 6 + j) = t.ra(i, j);
        Phi(first + 3 + i, first + j) = t.vr(i, j);
        Phi(first + 3 + i, first + 3 + j) = t.vv(i, j);
        Phi(first + 3 + i, first + 6 + j) = t.va(i, j);
      }
      Phi(first + 6 + i, first + 6 + i) = t.aa[i];
    }
    const OrbitNoise& noise = first == kPositionSelf ? self : difference;
    for (int c = 0; c < 9; ++c) {
      const Eigen::Map<const Eigen::Matrix<double, 9, 1>> column(noise.column[c]);
      Q.block<9, 9>(first, first) += noise.weight[c] * column * column.transpose();
    }
  }
  const Covariance expected = Phi * matrix_of(ud) * Phi.transpose() + Q;
  ud.move_orbits(t_self, t_difference, self, difference);
  EXPECT_LT(distance(matrix_of(ud), expected), kTolerance);
}

// Property: whatever comes, P stays positive definite. Measurements 1e5 times better than what is
// known, over and over, are what breaks P - K H P in double precision.
TEST(UdFactorTest, StaysPositiveThroughMeasurementsThatAreFarTooGood) {
  orrery::RandomStream random(5);
  UdFactor ud = random_factor(&random);
  for (int k = 0; k < 2000; ++k) {
    double gain[kStates];
    ud.measure(ud.project(random_row(&random)), 1e-20, gain);
    if (k % 10 == 0) ud.forget(static_cast<int>(random.integer(0, kStates - 1)), 1e6);
    for (int j = 0; j < kStates; ++j) {
      ASSERT_GT(ud.d(j), 0.0) << k;
      ASSERT_TRUE(std::isfinite(ud.d(j)) && std::isfinite(gain[j])) << k;
    }
  }
}

// A factor as UdFactor stores it, in arrays, so that a path of the loops can be chosen.
struct Stored {
  double U[ud_kernel::offset(kStates)] = {}, D[kStates], b[kStates] = {};
  ud_kernel::Weighted w;

  explicit Stored(orrery::RandomStream* random) {
    for (int j = 0; j < kStates; ++j) {
      for (int i = 0; i < j; ++i) U[ud_kernel::offset(j) + i] = random->uniform(-1, 1);
      U[ud_kernel::offset(j) + j] = 1.0;
      D[j] = random->uniform(0.1, 2.0);
    }
    for (double& weight : w.weight) weight = random->uniform(0.1, 2.0);
    for (int k = 0; k < ud_kernel::kRows; ++k) {
      const int width = k < ud_kernel::kUpper ? ud_kernel::kWide : ud_kernel::kHalf;
      for (int i = 0; i < ud_kernel::kWide; ++i) {
        w.row[k][i] = i < width ? random->uniform(-1, 1) : 0.0;
      }
    }
  }
};

// Everything once: by one path and by the other.
void do_all(const ud_kernel::Loops& loops, const SparseRow& h, const Column& g, Stored* s) {
  double f[kStates];
  const double variance = loops.project(kStates, s->U, s->D, {h.count, h.state, h.value}, f);
  const double inverse = loops.measure(kStates, s->U, s->D, f, 0.3, s->b);
  EXPECT_NEAR(inverse * (variance + 0.3), 1.0, kTolerance);
  Column x = g;
  loops.add(s->U, s->D, 0.7, x.data(), kStates - 1);
  loops.refactor(s->U, s->D, kPositionSelf, &s->w);
}

#if defined(__x86_64__)
TEST(UdFactorTest, BothWidthsOfRegisterGiveTheSameBits) {
  if (!__builtin_cpu_supports("avx2")) GTEST_SKIP() << "this processor has no AVX2";
  orrery::RandomStream random(6);
  for (int k = 0; k < 50; ++k) {
    const Stored start(&random);
    const SparseRow h = random_row(&random);
    const Column g = random_column(&random, kStates - 1);
    Stored plain = start, wide = start;
    do_all(ud_kernel::kPlain, h, g, &plain);
    do_all(ud_kernel::kAvx2, h, g, &wide);
    ASSERT_EQ(std::memcmp(&plain, &wide, sizeof plain), 0) << k;
    ASSERT_NE(std::memcmp(&plain, &start, sizeof plain), 0) << k;
  }
}
#endif

// Every loop takes a diagonal of ones and zeros below it for granted, and keeps them.
TEST(UdFactorTest, BelowTheDiagonalNothingIsEverStored) {
  orrery::RandomStream random(7);
  Stored s(&random);
  for (int k = 0; k < 20; ++k) {
    do_all(ud_kernel::kPlain, random_row(&random), random_column(&random, kStates - 1), &s);
  }
  for (int j = 0; j < kStates; ++j) {
    for (int i = j; i < ud_kernel::rows(j); ++i) {
      EXPECT_EQ(s.U[ud_kernel::offset(j) + i], i == j ? 1.0 : 0.0) << i << ' ' << j;
    }
  }
}

}  // namespace
}  // namespace formation_gnc
