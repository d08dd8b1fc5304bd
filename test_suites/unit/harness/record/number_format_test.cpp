#include <orrery/harness/record/number_format.hpp>

#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cmath>
#include <cstdio>
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

// printf is the C library's, exact and to even in ties. Coordinates as tables have them; ties and
// neighbours of ties, where a product rounded in a double decides wrongly; any bits at all.
TEST(NumberFormatTest, FixedNumbersAreTheNearestDecimals) {
  std::mt19937_64 bits(2);
  std::array<char, 400> expected;
  for (int i = 0; i < 200'000; ++i) {
    const double coordinate = static_cast<double>(static_cast<std::int64_t>(bits())) * 0x1p-40;
    const double tie = static_cast<double>(bits() % 100'000'000) / 0x1p8;
    const double half = (static_cast<double>(bits() % 10'000'000) + 0.5) * 1e-6;
    for (const double value : {coordinate, -tie, half, std::bit_cast<double>(bits())}) {
      if (!std::isfinite(value)) continue;
      const int decimals = static_cast<int>(bits() % 18);
      std::snprintf(expected.data(), expected.size(), "%.*f", decimals, value);
      ASSERT_EQ(fixed(value, decimals), expected.data());
    }
  }
}

TEST(NumberFormatTest, IntegersOfAllLengthsAreThoseOfPrintf) {
  std::mt19937_64 bits(3);
  for (int i = 0; i < 200'000; ++i) {
    const std::uint64_t value = bits() >> bits() % 64;
    std::string text;
    append_number(text, value);
    ASSERT_EQ(text, std::to_string(value));
    text.clear();
    append_number(text, -static_cast<std::int64_t>(value >> 1));
    ASSERT_EQ(text, std::to_string(-static_cast<std::int64_t>(value >> 1)));
  }
}

TEST(NumberFormatTest, ARoundedUpFractionCarriesIntoTheIntegers) {
  EXPECT_EQ(fixed(0.9999999, 6), "1.000000");
  EXPECT_EQ(fixed(-9.9999999999, 9), "-10.000000000");
  EXPECT_EQ(fixed(99999999.9999999, 6), "100000000.000000");
  EXPECT_EQ(fixed(-0.0, 3), "-0.000");
}

TEST(NumberFormatTest, FixedNumbersMustBeFinite) {
  EXPECT_THROW(fixed(std::numeric_limits<double>::infinity(), 3), std::invalid_argument);
  EXPECT_THROW(fixed(1, 18), std::invalid_argument);
  EXPECT_THROW(fixed(1, -1), std::invalid_argument);
  EXPECT_EQ(fixed(std::numeric_limits<double>::max(), 17).size(), 309u + 1 + 17);
  std::array<char, kLongestNumber> text;
  const double infinity = std::numeric_limits<double>::infinity();
  EXPECT_EQ(std::string(text.data(), write_fixed(text.data(), -infinity, 3)), "-inf");
  EXPECT_EQ(std::string(text.data(), write_fixed(text.data(), infinity - infinity, 3)), "nan");
}

}  // namespace
}  // namespace orrery
