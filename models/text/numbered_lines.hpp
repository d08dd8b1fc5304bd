/// Numbered lines and strict numbers, for everything here that reads a text file. Not installed.
#pragma once

#include <orrery/harness/kernel/simulator_only.hpp>

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace orrery::text {

/// Takes a text apart line by line and knows where it is, for the messages.
class NumberedLines {
 public:
  /// `reader` opens every message: "EarthOrientationTable".
  NumberedLines(std::string_view text, std::string_view reader, std::string_view source);

  /// The next line without its end; none after the last. Throws on a byte that is not printable
  /// ASCII, tabulator or carriage return.
  std::optional<std::string_view> next();
  /// A number cut in the middle still reads as a number: only the line end shows that it is whole.
  bool line_had_end() const { return line_had_end_; }
  /// As next(), for formats in which every line ends: throws where the last one does not.
  std::optional<std::string_view> next_whole();
  /// Of the line last handed out, from 1.
  int number() const { return number_; }
  const std::string& source() const { return source_; }

  /// @throws std::invalid_argument  "reader: source, line N: what", always. Without a number: the
  ///                                line last handed out.
  [[noreturn]] void fail(int line, const std::string& what) const;
  [[noreturn]] void fail(const std::string& what) const { fail(number_, what); }

  /// The number that `text`, blanks around it aside, is. @throws  as fail(), for anything else, a
  /// value that is not finite, or one outside +-limit, or [low, high].
  double real(std::string_view text, std::string_view name, double limit) const;
  double real(std::string_view text, std::string_view name, double low, double high) const;
  int integer(std::string_view text, std::string_view name, int low, int high) const;

 private:
  std::string_view text_;
  std::string reader_, source_;
  int number_ = 0;
  bool line_had_end_ = true;
};

/// Printable ASCII, tabulator or carriage return.
bool is_text(char c);
bool is_text(std::string_view text);
std::string_view trimmed(std::string_view text);
std::vector<std::string_view> words_of(std::string_view line);
/// In quotes, cut to 40 characters, with what cannot be printed as '?'.
std::string quoted(std::string_view text);
/// All of `word` as one number, a leading '+' allowed; nothing for "nan", "inf" or anything else.
std::optional<double> finite_number(std::string_view word);
std::optional<int> whole_number(std::string_view word);
/// The whole file. @throws std::invalid_argument  it cannot be read, or is compressed; names
/// `reader`.
std::string read_file(const std::string& path, std::string_view reader);

}  // namespace orrery::text
