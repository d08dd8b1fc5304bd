#include <orrery/harness/record/number_format.hpp>

#include <array>
#include <charconv>
#include <cmath>
#include <stdexcept>

namespace orrery {

namespace {

template <class... Format>
void append(std::string& out, Format... format) {
  // The longest is a fixed number: 309 digits, sign, point, 17 decimals.
  std::array<char, 352> text;
  const std::to_chars_result end = std::to_chars(text.data(), text.data() + text.size(), format...);
  out.append(text.data(), end.ptr);
}

}  // namespace

void append_number(std::string& out, double value) {
  if (std::isnan(value)) {
    out += "nan";  // without the sign, which differs between processors for 0/0
    return;
  }
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
  if (decimals < 0 || decimals > 17) {
    throw std::invalid_argument("append_fixed: decimals = " + std::to_string(decimals) +
                                "; accepted: 0 to 17");
  }
  append(out, value, std::chars_format::fixed, decimals);
}

}  // namespace orrery
