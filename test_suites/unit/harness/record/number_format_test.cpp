#include <orrery/harness/record/number_format.hpp>

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <random>

namespace orrery {
namespace {

std::string number(double value) {
  std::string text;
  append_number(text, value);
  return text;
}

std::string fixed(double value, int decimals) {
  std::string text;
  append_fixed(text, value, decimals);
  return text;
}

TEST(NumberFormatTest, ShortestDecimalIsChosen) {
  EXPECT_EQ(number(0.1), "0.1");
  EXPECT_EQ(number(100), "100");
  EXPECT_EQ(number(-2.5e-12), "-2.5e-12");
  EXPECT_EQ(number(1.0 / 3), "0.3333333333333333");
  EXPECT_EQ(number(-0.0), "-0");
}

TEST(NumberFormatTest, NotANumberHasNoSign) {
  EXPECT_EQ(number(std::numeric_limits<double>::quiet_NaN()), "nan");
  EXPECT_EQ(number(-std::numeric_limits<double>::quiet_NaN()), "nan");
  EXPECT_EQ(number(std::numeric_limits<double>::infinity()), "inf");
  EXPECT_EQ(number(-std::numeric_limits<double>::infinity()), "-inf");
}

// strtod is the C library's, written apart from to_chars.
TEST(NumberFormatTest, EveryDoubleReadsBackAsItself) {
  std::mt19937_64 bits(1);  // its sequence is fixed by the standard
  for (int i = 0; i < 100'000; ++i) {
    const double value = std::bit_cast<double>(bits());
    if (!std::isfinite(value)) continue;
    ASSERT_EQ(std::strtod(number(value).c_str(), nullptr), value) << number(value);
  }
}

TEST(NumberFormatTest, IntegersOfTheFullRangeAreExact) {
  std::string text;
  append_number(text, std::numeric_limits<std::int64_t>::min());
  EXPECT_EQ(text, "-9223372036854775808");
  text.clear();
  append_number(text, std::numeric_limits<std::uint64_t>::max());
  EXPECT_EQ(text, "18446744073709551615");
}

TEST(NumberFormatTest, FixedNumbersKeepTheirZeros) {
  EXPECT_EQ(fixed(6928.137, 10), "6928.1370000000");
  EXPECT_EQ(fixed(-0.25, 1), "-0.2");  // a tie goes to the even digit
  EXPECT_EQ(fixed(3, 0), "3");
}

TEST(NumberFormatTest, FixedNumbersMustBeFinite) {
  EXPECT_THROW(fixed(std::numeric_limits<double>::infinity(), 3), std::invalid_argument);
  EXPECT_THROW(fixed(1, 18), std::invalid_argument);
  EXPECT_THROW(fixed(1, -1), std::invalid_argument);
  EXPECT_EQ(fixed(std::numeric_limits<double>::max(), 17).size(), 309u + 1 + 17);
}

}  // namespace
}  // namespace orrery
