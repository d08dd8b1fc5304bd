/// Numbers as the written files have them: the same bytes in every locale.
#pragma once

#include <orrery/harness/kernel/simulator_only.hpp>

#include <cstddef>
#include <cstdint>
#include <string>

namespace orrery {

/// Appends the shortest decimal that reads back as the same double: "0.1", "1e-09", "-0", "nan"
/// (whatever the sign and the payload), "inf", "-inf".
void append_number(std::string& out, double value);
void append_number(std::string& out, std::int64_t value);
void append_number(std::string& out, std::uint64_t value);

/// Appends with exactly `decimals` digits after the point, rounded to nearest.
/// @throws std::invalid_argument  not finite, or decimals outside 0 to 17.
void append_fixed(std::string& out, double value, int decimals);

/// The longest that the functions below write: 309 digits, sign, point, 17 decimals.
constexpr std::size_t kLongestNumber = 352;

/// As append_number, into a buffer with room for kLongestNumber. @returns  the end of the text.
char* write_number(char* out, double value);
char* write_number(char* out, std::int64_t value);
char* write_number(char* out, std::uint64_t value);
/// As append_fixed, and "nan", "inf" or "-inf" for what is not finite.
///
/// Method  What is behind the point, times 10^decimals, is rounded as an integer. Where that is
///         within the product's own error of a tie, and from 2^53 on, std::to_chars writes it: the
///         nearest decimal always, and of two the one whose last digit is even.
char* write_fixed(char* out, double value, int decimals);

}  // namespace orrery
