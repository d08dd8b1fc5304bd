/// A package's configuration as text: a line per key, `key = value  # comment`.
///
/// Numbers are decimal, in the C locale, which flight programs never leave. A key is given once.
/// What is wrong is said in one line that names the line, the key, the value and the accepted
/// range. C++17, no allocation.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>

namespace flight_support {

class ConfigurationReader {
 public:
  static constexpr std::size_t kMaxLine = 128;  ///< characters, the final 0 included

  ConfigurationReader(char* message, std::size_t message_bytes)
      : message_(message), message_bytes_(message_bytes) {}
  virtual ~ConfigurationReader() = default;

  /// The whole text; false at the first line that is wrong.
  bool read(const char* text, std::size_t bytes) {
    std::size_t at = 0;
    while (at < bytes) {
      char line[kMaxLine];
      std::size_t length = 0;
      for (; at < bytes && text[at] != '\n'; ++at) {
        if (length + 1 == kMaxLine) return fail("(a line)", "is longer than 127 characters");
        line[length++] = text[at];
      }
      ++at;
      line[length] = '\0';
      if (!read_line(line)) return false;
    }
    return true;
  }

  bool fail(const char* what, const char* why) {
    std::snprintf(message_, message_bytes_, "configuration line %d: '%s' %s", line_, what, why);
    return false;
  }

 protected:
  /// A number of the configuration: where it goes and what it may be.
  struct NumberKey {
    const char* name;
    double* value;
    double low, high;
  };

  virtual bool set(const char* key, const char* value) = 0;

  /// Of the k-th key.
  template <std::size_t kCount>
  bool set_number(const NumberKey (&keys)[kCount], std::size_t k, const char* text) {
    static_assert(kCount <= 64, "a bit each");
    const NumberKey& key = keys[k];
    const std::uint64_t bit = std::uint64_t{1} << k;
    if ((seen_ & bit) != 0) return fail(key.name, "is given twice");
    seen_ |= bit;
    char* end = nullptr;
    const double value = std::strtod(text, &end);
    // Written so that a NaN is out of range.
    if (end == text || *end != '\0' || !(value >= key.low && value <= key.high)) {
      char why[96];
      std::snprintf(why, sizeof why, "is not a number in [%g, %g]: '%.32s'", key.low, key.high,
                    text);
      return fail(key.name, why);
    }
    *key.value = value;
    return true;
  }

 private:
  static bool is_space(char c) { return c == ' ' || c == '\t' || c == '\r'; }

  // Cuts off comment and white space at both ends, in place.
  static char* trimmed(char* line) {
    char* comment = std::strchr(line, '#');
    if (comment != nullptr) *comment = '\0';
    while (is_space(*line)) ++line;
    std::size_t length = std::strlen(line);
    while (length > 0 && is_space(line[length - 1])) line[--length] = '\0';
    return line;
  }

  bool read_line(char* line) {
    ++line_;
    char* key = trimmed(line);
    if (*key == '\0') return true;
    char* equals = std::strchr(key, '=');
    if (equals == nullptr) return fail(key, "has no '='");
    *equals = '\0';
    return set(trimmed(key), trimmed(equals + 1));
  }

  char* message_;
  std::size_t message_bytes_;
  int line_ = 0;
  std::uint64_t seen_ = 0;  // a bit for each number's key
};

}  // namespace flight_support
