// Compiled for PCLMULQDQ, and called only where the processor has it.
#include <orrery/models/gnss/crc_fold.hpp>

#include <cstring>
#include <emmintrin.h>
#include <wmmintrin.h>

namespace orrery::novatel {
namespace {

/// x^n modulo the polynomial, bits reflected, one place higher: the product of two reflected
/// numbers of 64 bits comes out one place too low.
constexpr std::uint64_t power(int n) {
  std::uint32_t value = 0x80000000u;  // x^0
  for (int i = 0; i < n; ++i) value = (value & 1u) != 0 ? value >> 1 ^ 0xEDB88320u : value >> 1;
  return std::uint64_t{value} << 1;
}

/// Factors that carry a register of 128 bits on by so many lanes, for its low and its high half.
struct Factors {
  std::uint64_t low, high;
};
constexpr Factors carry_on(int lanes) {
  return {power(128 * lanes + 32), power(128 * lanes - 32)};
}
constexpr Factors kByFour = carry_on(4), kByOne = carry_on(1);
static_assert(kByFour.low == 0x154442bd4 && kByFour.high == 0x1c6e41596);  // as published
static_assert(kByOne.low == 0x1751997d0 && kByOne.high == 0x0ccaa009e);

__m128i load(const std::byte* at) {
  return _mm_loadu_si128(reinterpret_cast<const __m128i*>(at));
}

__m128i load(const Factors& f) {
  return _mm_set_epi64x(static_cast<long long>(f.high), static_cast<long long>(f.low));
}

/// x, carried on by the distance of `k`, and what stands there.
__m128i folded(__m128i x, __m128i k, __m128i next) {
  const __m128i low = _mm_clmulepi64_si128(x, k, 0x00), high = _mm_clmulepi64_si128(x, k, 0x11);
  return _mm_xor_si128(_mm_xor_si128(low, high), next);
}

}  // namespace

CrcFold crc_fold_clmul(Bytes bytes, std::uint32_t crc) {
  const std::byte *at = bytes.data(), *const end = at + bytes.size();
  __m128i x[4];
  for (int i = 0; i < 4; ++i) x[i] = load(at + 16 * i);
  x[0] = _mm_xor_si128(x[0], _mm_cvtsi32_si128(static_cast<int>(crc)));
  const __m128i by_four = load(kByFour), by_one = load(kByOne);
  for (at += 64; end - at >= 64; at += 64) {
    for (int i = 0; i < 4; ++i) x[i] = folded(x[i], by_four, load(at + 16 * i));
  }
  __m128i one = x[0];
  for (int i = 1; i < 4; ++i) one = folded(one, by_one, x[i]);
  for (; end - at >= 16; at += 16) one = folded(one, by_one, load(at));
  CrcFold out{{}, static_cast<std::size_t>(at - bytes.data())};
  std::memcpy(out.remainder.data(), &one, sizeof one);
  return out;
}

}  // namespace orrery::novatel
