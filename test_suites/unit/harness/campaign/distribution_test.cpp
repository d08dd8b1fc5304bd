#include <orrery/harness/campaign/distribution.hpp>

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>
#include <stdexcept>

namespace orrery {
namespace {

// Textbook quantiles of the standard normal: 1.6448536 at 95 %, 0.67448975 at 75 %.
TEST(DistributionTest, QuantilesAreThoseOfTheTextbook) {
  EXPECT_NEAR(Distribution(Normal{11, 0.11}).at(0.95), 11 + 0.11 * 1.6448536, 1e-8);
  EXPECT_DOUBLE_EQ(Distribution(Uniform{-2, 6}).at(0.25), 0);
  EXPECT_DOUBLE_EQ(Distribution(LogNormal{3, 0.5}).at(0.5), 3);
  EXPECT_NEAR(Distribution(LogNormal{3, 0.5}).at(0.75), 3 * std::exp(0.5 * 0.67448975), 1e-7);
  // A normal cut to its upper half: the median is the 75 % quantile of the whole.
  EXPECT_NEAR(Distribution(TruncatedNormal{1, 2, 1, 100}).at(0.5), 1 + 2 * 0.67448975, 1e-7);
  EXPECT_NEAR(Distribution(TruncatedNormal{1, 2, -100, 1}).at(0.5), 1 - 2 * 0.67448975, 1e-7);
}

// Far from the mean a normal falls off as an exponential of rate x: between 7 and 8 sigma the
// median excess is ln 2 / 7 less a correction of the order of 1/7^3 (0.003): 0.0965 against 0.0990.
TEST(DistributionTest, TruncationKeepsItsDigitsInTheTails) {
  const double upper = Distribution(TruncatedNormal{0, 1, 7, 8}).at(0.5);
  const double lower = Distribution(TruncatedNormal{0, 1, -8, -7}).at(0.5);
  EXPECT_NEAR(upper - 7, std::log(2.0) / 7, 0.003);
  EXPECT_NEAR(upper, -lower, 1e-12);
}

TEST(DistributionTest, DiscreteValuesComeInProportion) {
  const Distribution even(Discrete{{1, 2, 4, 8}});
  EXPECT_EQ(even.at(0.24), 1);
  EXPECT_EQ(even.at(0.26), 2);
  EXPECT_EQ(even.at(0.99), 8);
  const Distribution uneven(Discrete{{1, 2, 3}, {1, 0, 3}});
  std::map<double, int> counts;
  for (int i = 0; i < 1000; ++i) ++counts[uneven.at((i + 0.5) / 1000)];
  EXPECT_EQ(counts[1], 250);
  EXPECT_EQ(counts[2], 0);
  EXPECT_EQ(counts[3], 750);
}

TEST(DistributionTest, EachValueIsOneDraw) {
  for (const Distribution& d :
       {Distribution(Normal{}), Distribution(Uniform{}), Distribution(LogNormal{}),
        Distribution(TruncatedNormal{}), Distribution(Discrete{{1, 2}})}) {
    RandomStream stream(7);
    d.draw(stream);
    EXPECT_EQ(stream.draws(), 1u) << d.to_string();
  }
}

TEST(DistributionTest, SaysWhatItIs) {
  EXPECT_EQ(Distribution(Normal{11, 0.11}).to_string(), "Normal(11, 0.11)");
  EXPECT_EQ(Distribution(Discrete{{1, 2}, {1, 3}}).to_string(), "Discrete(1, 2; weights 1, 3)");
}

TEST(DistributionTest, RefusesWhatIsNone) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(Distribution(Normal{0, -1}), std::invalid_argument);
  EXPECT_THROW(Distribution(Normal{kNan, 1}), std::invalid_argument);
  EXPECT_THROW(Distribution(Uniform{1, 0}), std::invalid_argument);
  EXPECT_THROW(Distribution(LogNormal{0, 1}), std::invalid_argument);
  EXPECT_THROW(Distribution(TruncatedNormal{0, 1, 9, 10}), std::invalid_argument);
  EXPECT_THROW(Distribution(Discrete{}), std::invalid_argument);
  EXPECT_THROW(Distribution(Discrete{{1, 2}, {1}}), std::invalid_argument);
  EXPECT_THROW(Distribution(Discrete{{1, 2}, {0, 0}}), std::invalid_argument);
  EXPECT_THROW(Distribution(Normal{}).at(0), std::invalid_argument);
}

}  // namespace
}  // namespace orrery
