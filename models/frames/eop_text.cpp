#include <orrery/harness/kernel/text.hpp>
#include <orrery/models/frames/eop_text.hpp>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <iterator>
#include <stdexcept>

namespace orrery::eop {
namespace {

constexpr std::string_view kBlanks = " \t\r";

bool is_text(char c) {
  return (c >= ' ' && c <= '~') || c == '\t' || c == '\r';
}

template <class Number>
std::optional<Number> whole_number_in(std::string_view word) {
  Number value{};
  if (word.size() > 1 && word.front() == '+' && word[1] != '-') word.remove_prefix(1);
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc{} || end != word.data() + word.size()) return {};
  return value;
}

}  // namespace

NumberedLines::NumberedLines(std::string_view text, std::string_view reader,
                             std::string_view source)
    : text_(text), prefix_(std::string(reader) + ": " + std::string(source)) {}

std::optional<std::string_view> NumberedLines::next() {
  if (text_.empty()) return {};
  ++number_;
  const std::size_t end = text_.find('\n');
  line_had_end_ = end != std::string_view::npos;
  const std::string_view line = text_.substr(0, end);
  text_.remove_prefix(line_had_end_ ? end + 1 : text_.size());
  const auto strange = std::find_if_not(line.begin(), line.end(), is_text);
  if (strange != line.end())
    fail("byte 0x" + hex_digits(static_cast<unsigned char>(*strange), 2) + " at column " +
         std::to_string(strange - line.begin() + 1) + " is not text");
  return line;
}

void NumberedLines::fail(const std::string& what) const {
  throw std::invalid_argument(prefix_ + ", line " + std::to_string(number_) + ": " + what);
}

double NumberedLines::real(std::string_view text, const char* name, double limit) const {
  const std::optional<double> value = whole_number_in<double>(trimmed(text));
  // from_chars also reads "nan" and "inf".
  if (!value || !std::isfinite(*value))
    fail(std::string(name) + " is " + quoted(trimmed(text)) + ", not a finite number");
  if (std::abs(*value) > limit)
    fail(std::string(name) + " = " + to_text(*value) + " is outside +-" + to_text(limit));
  return *value;
}

int NumberedLines::integer(std::string_view text, const char* name, int low, int high) const {
  const std::optional<int> value = whole_number_in<int>(trimmed(text));
  if (!value || *value < low || *value > high)
    fail(std::string(name) + " is " + quoted(trimmed(text)) + "; accepted: " + std::to_string(low) +
         " to " + std::to_string(high));
  return *value;
}

std::string_view trimmed(std::string_view text) {
  text.remove_prefix(std::min(text.find_first_not_of(kBlanks), text.size()));
  return text.substr(0, text.find_last_not_of(kBlanks) + 1);
}

std::vector<std::string_view> words_of(std::string_view line) {
  std::vector<std::string_view> words;
  for (line = trimmed(line); !line.empty(); line = trimmed(line)) {
    words.push_back(line.substr(0, line.find_first_of(kBlanks)));
    line.remove_prefix(words.back().size());
  }
  return words;
}

std::string quoted(std::string_view text) {
  constexpr std::size_t kLongest = 40;
  std::string shown(text.substr(0, kLongest));
  for (char& c : shown) {
    if (!is_text(c)) c = '?';
  }
  return "'" + shown + (text.size() > kLongest ? "..." : "") + "'";
}

std::string read_file(const std::string& path, const char* reader) {
  std::ifstream file(path, std::ios::binary);
  std::string text{std::istreambuf_iterator<char>(file), {}};
  if (!file.is_open() || file.bad())
    throw std::invalid_argument(std::string(reader) + ": cannot read '" + path + "'");
  if (text.starts_with("\x1f\x8b"))
    throw std::invalid_argument(std::string(reader) + ": '" + path +
                                "' is compressed; unpack it with gzip -d first");
  return text;
}

}  // namespace orrery::eop
