#include <orrery/harness/kernel/text.hpp>
#include <orrery/models/text/numbered_lines.hpp>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>

namespace orrery::text {
namespace {

constexpr std::string_view kBlanks = " \t\r";

template <class Number>
std::optional<Number> number_in(std::string_view word) {
  Number value{};
  if (word.size() > 1 && word.front() == '+' && word[1] != '-') word.remove_prefix(1);
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc{} || end != word.data() + word.size()) return {};
  return value;
}

}  // namespace

NumberedLines::NumberedLines(std::string_view text, std::string_view reader,
                             std::string_view source)
    : text_(text), reader_(reader), source_(source) {}

std::optional<std::string_view> NumberedLines::next() {
  if (text_.empty()) return {};
  ++number_;
  const std::size_t end = text_.find('\n');
  line_had_end_ = end != std::string_view::npos;
  const std::string_view line = text_.substr(0, end);
  text_.remove_prefix(line_had_end_ ? end + 1 : text_.size());
  const auto strange =
      std::find_if_not(line.begin(), line.end(), [](char c) { return is_text(c); });
  if (strange != line.end())
    fail("byte 0x" + hex_digits(static_cast<unsigned char>(*strange), 2) + " at column " +
         std::to_string(strange - line.begin() + 1) + " is not printable ASCII");
  return line;
}

std::optional<std::string_view> NumberedLines::next_whole() {
  std::optional<std::string_view> line = next();
  if (line && !line_had_end_) fail("cut short: the last line has no line end");
  if (line && line->ends_with('\r')) line->remove_suffix(1);
  return line;
}

void NumberedLines::fail(int line, const std::string& what) const {
  throw std::invalid_argument(reader_ + ": " + source_ + ", line " + std::to_string(line) + ": " +
                              what);
}

double NumberedLines::real(std::string_view text, std::string_view name, double limit) const {
  const std::optional<double> value = finite_number(trimmed(text));
  if (!value) fail(std::string(name) + " is " + quoted(trimmed(text)) + ", not a finite number");
  if (std::abs(*value) > limit)
    fail(std::string(name) + " = " + to_text(*value) + " is outside +-" + to_text(limit));
  return *value;
}

double NumberedLines::real(std::string_view text, std::string_view name, double low,
                           double high) const {
  const std::optional<double> value = finite_number(trimmed(text));
  if (!value || *value < low || *value > high)
    fail(std::string(name) + " is " + quoted(trimmed(text)) + "; accepted: " + to_text(low) +
         " to " + to_text(high));
  return *value;
}

int NumberedLines::integer(std::string_view text, std::string_view name, int low, int high) const {
  const std::optional<int> value = whole_number(trimmed(text));
  if (!value || *value < low || *value > high)
    fail(std::string(name) + " is " + quoted(trimmed(text)) + "; accepted: a whole number, " +
         std::to_string(low) + " to " + std::to_string(high));
  return *value;
}

bool is_text(char c) {
  return (c >= ' ' && c <= '~') || c == '\t' || c == '\r';
}

bool is_text(std::string_view text) {
  return std::all_of(text.begin(), text.end(), [](char c) { return is_text(c); });
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
    if (c < ' ' || c > '~') c = '?';
  }
  return "'" + shown + (text.size() > kLongest ? "..." : "") + "'";
}

std::optional<double> finite_number(std::string_view word) {
  const std::optional<double> value = number_in<double>(word);
  return value && std::isfinite(*value) ? value : std::nullopt;  // from_chars reads "nan" too
}

std::optional<int> whole_number(std::string_view word) {
  return number_in<int>(word);
}

std::string read_file(const std::string& path, std::string_view reader) {
  std::ifstream file(path, std::ios::binary);
  std::error_code unknown;
  if (!file.is_open() || std::filesystem::is_directory(path, unknown))
    throw std::invalid_argument(std::string(reader) + ": cannot read '" + path + "'");
  std::string content{std::istreambuf_iterator<char>(file), {}};
  if (file.bad()) throw std::invalid_argument(std::string(reader) + ": cannot read '" + path + "'");
  if (content.starts_with("\x1f\x8b"))
    throw std::invalid_argument(std::string(reader) + ": '" + path +
                                "' is compressed; unpack it with gzip -d first");
  return content;
}

}  // namespace orrery::text
