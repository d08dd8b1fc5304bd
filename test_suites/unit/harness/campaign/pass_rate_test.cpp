#include <orrery/harness/campaign/pass_rate.hpp>

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

namespace orrery {
namespace {

// Wilks's sample sizes, 95 % / 95 %, one-sided, of order 1 to 10: the fewest runs that show a rate
// of 0.95 with 0, 1, 2 ... failures. S. S. Wilks, Ann. Math. Stat. 12 (1941), 91; tabulated in Nutt
// & Wallis, Reliability Engineering & System Safety 83 (2004), 57, and in NUREG/CR-5249.
TEST(PassRateTest, AgreesWithWilksSampleSizes) {
  const std::uint64_t fewest[] = {59, 93, 124, 153, 181, 208, 234, 260, 286, 311};
  for (std::uint64_t failures = 0; failures < 10; ++failures) {
    const std::uint64_t n = fewest[failures];
    EXPECT_GE(pass_rate_lower_bound(n - failures, n, 0.95), 0.95) << n;
    EXPECT_LT(pass_rate_lower_bound(n - 1 - failures, n - 1, 0.95), 0.95) << n;
  }
}

// The same for 99 % / 95 % and 90 % / 90 % without a failure: 299 and 22.
TEST(PassRateTest, AgreesWithTheOthersInUse) {
  EXPECT_GE(pass_rate_lower_bound(299, 299, 0.95), 0.99);
  EXPECT_LT(pass_rate_lower_bound(298, 298, 0.95), 0.99);
  EXPECT_GE(pass_rate_lower_bound(22, 22, 0.9), 0.90);
  EXPECT_LT(pass_rate_lower_bound(21, 21, 0.9), 0.90);
}

// Closed forms: no failures, (1 - c)^(1/n); one success of one, 1 - c. Observed below 2e-16.
TEST(PassRateTest, AgreesWithClosedForms) {
  for (const std::uint64_t n : {1u, 10u, 100u, 10000u, 1000000u}) {
    EXPECT_NEAR(pass_rate_lower_bound(n, n, 0.95), std::pow(0.05, 1 / static_cast<double>(n)),
                1e-9);
  }
  // At least one of two passes with probability 1 - (1 - p)^2.
  EXPECT_NEAR(pass_rate_lower_bound(1, 2, 0.95), 1 - std::sqrt(0.95), 1e-9);
  EXPECT_EQ(pass_rate_lower_bound(0, 100, 0.95), 0);
}

// Two-sided 95 % as published: 81 of 263 in Agresti & Coull's manner of citing, here from the
// tables of Blyth & Still, JASA 78 (1983), 108 (Clopper-Pearson column): 0 of 10, 1 of 10, 5 of 10.
TEST(PassRateTest, AgreesWithPublishedIntervals) {
  const struct {
    std::uint64_t passed, runs;
    double low, high;
  } rows[] = {
      {0, 10, 0, 0.3085}, {1, 10, 0.0025, 0.4450}, {5, 10, 0.1871, 0.8129}, {10, 10, 0.6915, 1}};
  for (const auto& row : rows) {
    const PassRateInterval interval = pass_rate_interval(row.passed, row.runs, 0.95);
    EXPECT_NEAR(interval.low, row.low, 5.1e-5) << row.passed;  // four decimals are printed
    EXPECT_NEAR(interval.high, row.high, 5.1e-5) << row.passed;
  }
}

// The bound is where the binomial's tail, summed term by term, is 1 - confidence.
TEST(PassRateTest, AgreesWithTheBinomialSummed) {
  const std::uint64_t n = 40;
  for (std::uint64_t k = 1; k <= n; ++k) {
    const double p = pass_rate_lower_bound(k, n, 0.9);
    double tail = 0, choose = 1;
    for (std::uint64_t i = 0; i <= n; ++i) {
      const double exponent = static_cast<double>(i);
      if (i >= k) tail += choose * std::pow(p, exponent) * std::pow(1 - p, 40 - exponent);
      choose *= (40 - exponent) / (exponent + 1);
    }
    EXPECT_NEAR(tail, 0.1, 1e-9) << k;
  }
}

TEST(PassRateTest, RefusesWhatIsNoCount) {
  EXPECT_THROW(pass_rate_lower_bound(0, 0, 0.95), std::invalid_argument);
  EXPECT_THROW(pass_rate_lower_bound(3, 2, 0.95), std::invalid_argument);
  EXPECT_THROW(pass_rate_lower_bound(1, 2, 95), std::invalid_argument);
}

}  // namespace
}  // namespace orrery
