#include <orrery/harness/gtest/flags.hpp>
#include <orrery/harness/gtest/seeds.hpp>

#include <gtest/gtest.h>

#include <sstream>
#include <stdexcept>

namespace orrery {
namespace {

class SeedsTest : public testing::TestWithParam<RunId> {};

TEST_P(SeedsTest, SeedIsBasePlusIndex) {
  EXPECT_EQ(GetParam().seed, flags().seed + GetParam().index);
}

INSTANTIATE_TEST_SUITE_P(Three, SeedsTest, Seeds(3));

TEST(SeedsRangeTest, NoneIsRefused) {
  EXPECT_THROW(Seeds(0), std::invalid_argument);
}

TEST(SeedsRangeTest, PrintsSeedAndRun) {
  std::ostringstream text;
  PrintTo(RunId{.seed = 17, .index = 16}, &text);
  EXPECT_EQ(text.str(), "seed 17 (run 16)");
}

}  // namespace
}  // namespace orrery
