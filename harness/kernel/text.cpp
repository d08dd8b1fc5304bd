#include <orrery/harness/kernel/text.hpp>

#include <array>
#include <charconv>

namespace orrery {

std::string to_text(double value) {
  std::array<char, 32> text;  // the longest is "-2.2250738585072014e-308", 24
  const std::to_chars_result end = std::to_chars(text.data(), text.data() + text.size(), value);
  return std::string(text.data(), end.ptr);
}

std::string hex_digits(std::uint64_t value, int digits) {
  std::string text(static_cast<std::size_t>(digits), '0');
  for (int i = digits - 1; i >= 0; --i, value >>= 4) text[i] = "0123456789abcdef"[value & 15];
  return text;
}

}  // namespace orrery
