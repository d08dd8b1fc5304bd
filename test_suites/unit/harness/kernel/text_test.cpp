#include <orrery/harness/kernel/text.hpp>

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <limits>

namespace orrery {
namespace {

TEST(ToTextTest, IsTheShortestTextThatReadsBack) {
  EXPECT_EQ(to_text(0.1), "0.1");
  EXPECT_EQ(to_text(1e300), "1e+300");
  EXPECT_EQ(to_text(-2.2250738585072014e-308), "-2.2250738585072014e-308");
  EXPECT_EQ(to_text(std::nan("")), "nan");
  const double third = 1.0 / 3.0;
  EXPECT_EQ(std::strtod(to_text(third).c_str(), nullptr), third);
}

TEST(HexDigitsTest, KeepsLeadingZerosAndDropsWhatDoesNotFit) {
  EXPECT_EQ(hex_digits(0, 16), "0000000000000000");
  EXPECT_EQ(hex_digits(0x0123456789abcdefu, 16), "0123456789abcdef");
  EXPECT_EQ(hex_digits(0x0123456789abcdefu, 8), "89abcdef");
}

}  // namespace
}  // namespace orrery
