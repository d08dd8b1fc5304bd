#include <orrery/harness/record/number_format.hpp>

#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <stdexcept>
#include <string_view>

#ifdef __SSE2__
#include <emmintrin.h>
#endif

namespace orrery {

namespace {

static_assert(std::endian::native == std::endian::little,
              "eight_digits stores words as they lie in memory: swap them on this machine");

constexpr int kMostDecimals = 17;
constexpr int kMostInOneWord = 15;  // decimals: a product below 10^15 has fractions of 1/8 at least
constexpr std::array<double, kMostDecimals + 1> kPowersOfTen = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,
                                                                1e6,  1e7,  1e8,  1e9,  1e10, 1e11,
                                                                1e12, 1e13, 1e14, 1e15, 1e16, 1e17};
constexpr std::array<std::uint64_t, 17> kIntegerPowersOfTen = [] {
  std::array<std::uint64_t, 17> powers{1};
  for (std::size_t i = 1; i < powers.size(); ++i) powers[i] = 10 * powers[i - 1];
  return powers;
}();
constexpr std::uint64_t kTenTo8 = 100'000'000, kTenTo16 = kTenTo8 * kTenTo8;

// Digits of a number below 10^8, the first in the lowest byte: divided by 10^4, 10^2 and 10 in
// parallel, where a multiplication and a shift are a division (exact below 10^4 and 10^2).
[[gnu::always_inline]] inline std::uint64_t eight_digits(std::uint64_t value) {
  const std::uint64_t fours = value / 10'000 | (value % 10'000) << 32;
  const std::uint64_t hundreds = (fours * 10'486 >> 20) & 0x7f'0000'007f;
  const std::uint64_t twos = hundreds | (fours - 100 * hundreds) << 16;
  const std::uint64_t tens = (twos * 103 >> 10) & 0x000f'000f'000f'000f;
  return tens | (twos - 10 * tens) << 8;
}

struct TwoByEight {
  std::uint64_t first, second;
};

// Digits of two numbers below 10^8 at once, in half the time on a processor that can: the same
// divisions, in lanes of 32 and 16 bits.
[[gnu::always_inline]] inline TwoByEight eight_digits_of_two(std::uint64_t a, std::uint64_t b) {
#ifdef __SSE2__
  const auto all = [](int lane) { return _mm_set1_epi32(lane); };
  const __m128i values = _mm_set_epi64x(static_cast<long long>(b), static_cast<long long>(a));
  // 3518437209 / 2^45 is 1e-4 to within 2^-32 of itself: exact for all numbers of 32 bits.
  const __m128i tops =
      _mm_srli_epi64(_mm_mul_epu32(values, all(static_cast<int>(3'518'437'209u))), 45);
  const __m128i fours = _mm_or_si128(
      tops, _mm_slli_epi64(_mm_sub_epi64(values, _mm_mul_epu32(tops, all(10'000))), 32));
  // 5243 / 2^19 is exact for the hundreds of numbers below 10^4, 6554 / 2^16 for tens below 100.
  const __m128i hundreds = _mm_srli_epi16(_mm_mulhi_epu16(fours, _mm_set1_epi16(5243)), 3);
  const __m128i twos = _mm_or_si128(
      hundreds,
      _mm_slli_epi32(_mm_sub_epi16(fours, _mm_mullo_epi16(hundreds, _mm_set1_epi16(100))), 16));
  const __m128i tens = _mm_mulhi_epu16(twos, _mm_set1_epi16(6554));
  const __m128i digits = _mm_or_si128(
      tens, _mm_slli_epi16(_mm_sub_epi16(twos, _mm_mullo_epi16(tens, _mm_set1_epi16(10))), 8));
  return {static_cast<std::uint64_t>(_mm_cvtsi128_si64(digits)),
          static_cast<std::uint64_t>(_mm_cvtsi128_si64(_mm_unpackhi_epi64(digits, digits)))};
#else
  return {eight_digits(a), eight_digits(b)};
#endif
}

constexpr std::uint64_t kZeros = 0x3030'3030'3030'3030;

void store(char* out, std::uint64_t digits) {
  std::memcpy(out, &digits, sizeof digits);
}

// Of a number below 10^8, without zeros in front. Eight bytes are stored, whatever is returned.
[[gnu::always_inline]] inline char* write_without_zeros(char* out, std::uint64_t digits) {
  const int zeros = std::countr_zero(digits | std::uint64_t{1} << 56) / 8;
  store(out, (digits + kZeros) >> (8 * zeros));
  return out + (8 - zeros);
}

[[gnu::always_inline]] inline char* write_eight(char* out, std::uint64_t value) {
  return write_without_zeros(out, eight_digits(value));
}

// 16 digits of a number below 10^16, zeros in front.
[[gnu::always_inline]] inline void store_sixteen(char* out, std::uint64_t value) {
  store(out, eight_digits(value / kTenTo8) + kZeros);
  store(out + 8, eight_digits(value % kTenTo8) + kZeros);
}

char* write_text(char* out, std::string_view text) {
  std::memcpy(out, text.data(), text.size());
  return out + text.size();
}

template <class... Format>
char* write_chars(char* out, Format... format) {
  return std::to_chars(out, out + kLongestNumber, format...).ptr;
}

char* write_slowly(char* out, double value, int decimals) {
  if (!std::isfinite(value)) return write_number(out, value);
  return write_chars(out, value, std::chars_format::fixed, decimals);
}

template <class Value>
void append(std::string& out, Value value) {
  std::array<char, kLongestNumber> text;
  out.append(text.data(), write_number(text.data(), value));
}

}  // namespace

char* write_number(char* out, double value) {
  // Without the sign, which differs between processors for 0/0.
  return std::isnan(value) ? write_text(out, "nan") : write_chars(out, value);
}

char* write_number(char* out, std::int64_t value) {
  if (value >= 0) return write_number(out, static_cast<std::uint64_t>(value));
  *out++ = '-';
  return write_number(out, 0 - static_cast<std::uint64_t>(value));
}

char* write_number(char* out, std::uint64_t value) {
  if (value < kTenTo8) return write_eight(out, value);
  if (value < kTenTo16) {
    out = write_eight(out, value / kTenTo8);
    store(out, eight_digits(value % kTenTo8) + kZeros);
    return out + 8;
  }
  out = write_eight(out, value / kTenTo16);
  store_sixteen(out, value % kTenTo16);
  return out + 16;
}

char* write_fixed(char* out, double value, int decimals) {
  constexpr double kMost = 9007199254740992;  // 2^53: all integers below are doubles
  const auto scale = static_cast<std::size_t>(decimals);
  const double size = std::fabs(value);
  if (!(size < kMost) || decimals > kMostInOneWord) return write_slowly(out, value, decimals);
  auto whole = static_cast<std::uint64_t>(size);
  const double scaled = (size - static_cast<double>(whole)) * kPowersOfTen[scale];
  auto part = static_cast<std::uint64_t>(scaled);
  const double rest = scaled - static_cast<double>(part);
  // All this is exact but the product, which is half a unit of its last place off at most.
  if (std::fabs(rest - 0.5) <= scaled * 0x1p-52) return write_slowly(out, value, decimals);
  part += rest > 0.5 ? 1 : 0;
  if (part == kIntegerPowersOfTen[scale]) {
    part = 0;
    ++whole;
  }
  *out = '-';
  out += std::signbit(value) ? 1 : 0;
  // Those that tables use get by with fewer than 16 digits behind the point.
  if (whole < kTenTo8 && decimals <= 9) {
    const std::uint64_t last = decimals == 9 ? part % 10 : 0;
    const std::uint64_t eight = decimals == 9 ? part / 10 : part * kIntegerPowersOfTen[8 - scale];
    const TwoByEight digits = eight_digits_of_two(whole, eight);
    out = write_without_zeros(out, digits.first);
    if (decimals == 0) return out;
    *out++ = '.';
    store(out, digits.second + kZeros);
    out[8] = static_cast<char>('0' + last);
    return out + decimals;
  }
  out = write_number(out, whole);
  if (decimals == 0) return out;
  *out++ = '.';
  store_sixteen(out, part * kIntegerPowersOfTen[16 - scale]);
  return out + decimals;
}

void append_number(std::string& out, double value) {
  append(out, value);
}

void append_number(std::string& out, std::int64_t value) {
  append(out, value);
}

void append_number(std::string& out, std::uint64_t value) {
  append(out, value);
}

void append_fixed(std::string& out, double value, int decimals) {
  if (!std::isfinite(value)) {
    throw std::invalid_argument("append_fixed: value is not finite");
  }
  if (decimals < 0 || decimals > kMostDecimals) {
    throw std::invalid_argument("append_fixed: decimals = " + std::to_string(decimals) +
                                "; accepted: 0 to 17");
  }
  std::array<char, kLongestNumber> text;
  out.append(text.data(), write_fixed(text.data(), value, decimals));
}

}  // namespace orrery
