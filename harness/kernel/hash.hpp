/// 64-bit hashing that is the same everywhere: fingerprints, names of random streams.
///
/// Method     h <- mix(h ^ word), mix being the output function of SplitMix64: a golden-ratio step
///            and Stafford's variant 13 (Steele, Lea & Flood, OOPSLA 2014). It is a bijection of h
///            for a given word and of the word for a given h: two chains that differ stay different
///            while they are fed alike, and two words never collide.
/// Not for    security, or tables in memory (nothing in a run iterates in hash order).
/// Checked by test_suites/unit/harness/kernel/fingerprint_test.cpp
#pragma once

#include <orrery/harness/kernel/bytes.hpp>

#include <bit>
#include <cstdint>
#include <string_view>

namespace orrery {

/// The chain `h` after `word`.
constexpr std::uint64_t hash_word(std::uint64_t h, std::uint64_t word) {
  std::uint64_t x = (h ^ word) + 0x9e3779b97f4a7c15u;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

/// The chain `h` after the length and then the bytes, so that ("a", "bc") and ("ab", "c") differ.
std::uint64_t hash_bytes(std::uint64_t h, Bytes bytes);
std::uint64_t hash_text(std::uint64_t h, std::string_view text);

/// The bits of `x` as hashes take them: every NaN counts as 0x7ff8000000000000, since the sign and
/// payload of a NaN differ between compilers. -0.0 and 0.0 differ.
constexpr std::uint64_t fingerprint_bits(double x) {
  return x == x ? std::bit_cast<std::uint64_t>(x) : 0x7ff8000000000000u;
}

}  // namespace orrery
