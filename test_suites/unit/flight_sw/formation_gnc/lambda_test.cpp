#include "formation_gnc/navigation/lambda.hpp"

#include <orrery/harness/kernel/random.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace formation_gnc {
namespace {

// De Jonge & Tiberius's example; integers and distances found by brute force with 30 digits.
TEST(LambdaTest, SolvesThePublishedExample) {
  const double a[] = {5.450, 3.100, 2.970};
  const double q[] = {6.290, 5.978, .544, 5.978, 6.292, 2.340, .544, 2.340, 6.288};
  const IntegerLeastSquares s = integer_least_squares(3, a, q);
  ASSERT_TRUE(s.solved);
  EXPECT_EQ(std::vector<double>(s.best, s.best + 3), (std::vector<double>{5, 3, 4}));
  EXPECT_EQ(std::vector<double>(s.second, s.second + 3), (std::vector<double>{6, 4, 4}));
  EXPECT_NEAR(s.best_distance, 0.218331095, 1e-9);
  EXPECT_NEAR(s.second_distance, 0.307272576, 1e-9);
  EXPECT_NEAR(s.second_distance / s.best_distance, 1.407, 1e-3);
}

// Gauss-Jordan: the tests' own inverse.
std::vector<double> inverse(std::vector<double> m, int n) {
  std::vector<double> out(m.size(), 0.0);
  for (int i = 0; i < n; ++i) out[i * n + i] = 1.0;
  for (int k = 0; k < n; ++k) {
    const double pivot = m[k * n + k];
    for (int j = 0; j < n; ++j) m[k * n + j] /= pivot, out[k * n + j] /= pivot;
    for (int i = 0; i < n; ++i) {
      if (i == k) continue;
      const double f = m[i * n + k];
      for (int j = 0; j < n; ++j) {
        m[i * n + j] -= f * m[k * n + j];
        out[i * n + j] -= f * out[k * n + j];
      }
    }
  }
  return out;
}

struct Problem {
  int n;
  std::vector<double> a, q;
};

// Correlated as double differences are: a common part of a few directions, and a little of each.
Problem random_problem(orrery::RandomStream* random, int n, double common, double own) {
  Problem p{n, std::vector<double>(n), std::vector<double>(n * n, 0.0)};
  for (int direction = 0; direction < 2; ++direction) {
    std::vector<double> g(n);
    for (double& x : g) x = random->uniform(-common, common);
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j < n; ++j) p.q[i * n + j] += g[i] * g[j];
    }
  }
  for (int i = 0; i < n; ++i) {
    p.q[i * n + i] += own;
    p.a[i] = random->uniform(-100, 100);
  }
  return p;
}

double distance(const Problem& p, const std::vector<double>& weight, const std::vector<double>& z) {
  double sum = 0.0;
  for (int i = 0; i < p.n; ++i) {
    for (int j = 0; j < p.n; ++j) {
      sum += (p.a[i] - z[i]) * weight[i * p.n + j] * (p.a[j] - z[j]);
    }
  }
  return sum;
}

/// All vectors within `reach` of the rounded one in each component.
std::vector<double> two_least_by_brute_force(const Problem& p, int reach) {
  const std::vector<double> weight = inverse(p.q, p.n);
  std::vector<double> z(p.n), all;
  std::vector<int> step(p.n, -reach);
  while (true) {
    for (int i = 0; i < p.n; ++i) z[i] = std::round(p.a[i]) + step[i];
    all.push_back(distance(p, weight, z));
    int k = 0;
    while (k < p.n && ++step[k] > reach) step[k++] = -reach;
    if (k == p.n) break;
  }
  std::partial_sort(all.begin(), all.begin() + 2, all.end());
  all.resize(2);
  return all;
}

// 150 problems of 2 to 4 differences. The ellipsoids are at most 2.5 cycles long, so 7 on each side
// hold the two best for sure.
TEST(LambdaTest, EqualsBruteForce) {
  orrery::RandomStream random(1);
  for (int k = 0; k < 150; ++k) {
    const int n = 2 + k % 3;
    const Problem p = random_problem(&random, n, 1.2, 0.02);
    const IntegerLeastSquares s = integer_least_squares(n, p.a.data(), p.q.data());
    ASSERT_TRUE(s.solved) << k;
    const std::vector<double> expected = two_least_by_brute_force(p, 7);
    EXPECT_NEAR(s.best_distance, expected[0], 1e-9 * (1 + expected[0])) << k;
    EXPECT_NEAR(s.second_distance, expected[1], 1e-9 * (1 + expected[1])) << k;
    const std::vector<double> weight = inverse(p.q, n);
    EXPECT_NEAR(distance(p, weight, {s.best, s.best + n}), expected[0], 1e-9 * (1 + expected[0]));
  }
}

// Eleven differences with a float solution off by a known little: the integers behind it are found,
// and the success rate is an honest lower bound (Teunissen 1999): seen 0.9997 of 2000 at 0.9989
// promised.
TEST(LambdaTest, FindsElevenIntegersAsOftenAsItPromises) {
  orrery::RandomStream random(2);
  int found = 0;
  double promised = 0.0;
  constexpr int kRuns = 500;
  for (int k = 0; k < kRuns; ++k) {
    const int n = kMostIntegers;
    std::vector<std::vector<double>> g(3, std::vector<double>(n));
    for (auto& direction : g) {
      for (double& x : direction) x = 4 * random.normal();
    }
    constexpr double kOwn = 0.06;
    std::vector<double> truth(n), a(n), q(n * n, 0.0);
    std::vector<double> common = {random.normal(), random.normal(), random.normal()};
    for (int i = 0; i < n; ++i) {
      truth[i] = static_cast<double>(random.integer(-1000, 1000));
      a[i] = truth[i] + kOwn * random.normal();
      q[i * n + i] = kOwn * kOwn;
      for (int d = 0; d < 3; ++d) a[i] += g[d][i] * common[d];
    }
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j < n; ++j) {
        for (int d = 0; d < 3; ++d) q[i * n + j] += g[d][i] * g[d][j];
      }
    }
    const IntegerLeastSquares s = integer_least_squares(n, a.data(), q.data());
    ASSERT_TRUE(s.solved) << k;
    found += std::equal(truth.begin(), truth.end(), s.best);
    promised += s.success_rate / kRuns;
  }
  // Three sigmas of a binomial below the promise.
  EXPECT_GE(found, kRuns * promised - 3 * std::sqrt(kRuns * promised * (1 - promised)) - 1);
  EXPECT_GT(promised, 0.5);
}

TEST(LambdaTest, RefusesWhatHasNoSolution) {
  const double a[] = {0.3, 0.4}, singular[] = {1, 1, 1, 1}, negative[] = {1, 0, 0, -1};
  EXPECT_FALSE(integer_least_squares(2, a, singular).solved);
  EXPECT_FALSE(integer_least_squares(2, a, negative).solved);
  const double q[] = {1, 0, 0, 1}, nothing[] = {NAN, 0.4}, huge[] = {1e12, 0.4};
  EXPECT_FALSE(integer_least_squares(2, nothing, q).solved);
  EXPECT_FALSE(integer_least_squares(2, huge, q).solved);
  EXPECT_FALSE(integer_least_squares(0, a, q).solved);
  EXPECT_FALSE(integer_least_squares(kMostIntegers + 1, a, q).solved);
}

}  // namespace
}  // namespace formation_gnc
