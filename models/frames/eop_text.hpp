/// Numbered lines and strict numbers, for the readers of this room. Not installed.
#pragma once

#include <orrery/harness/kernel/simulator_only.hpp>

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace orrery::eop {

/// Takes a text apart line by line and knows where it is, for the messages.
class NumberedLines {
 public:
  /// `reader` opens every message: "EarthOrientationTable".
  NumberedLines(std::string_view text, std::string_view reader, std::string_view source);

  /// The next line without its end; none after the last. Throws on a byte that is no text.
  std::optional<std::string_view> next();
  /// A number cut in the middle still reads as a number: only the line end shows that it is whole.
  bool line_had_end() const { return line_had_end_; }

  /// @throws std::invalid_argument  "reader: source, line N: what", always.
  [[noreturn]] void fail(const std::string& what) const;

  /// The number that `text`, blanks around it aside, is. @throws  as fail(), for anything else, a
  /// value that is not finite, or one outside +-limit.
  double real(std::string_view text, const char* name, double limit) const;
  int integer(std::string_view text, const char* name, int low, int high) const;

 private:
  std::string_view text_;
  std::string prefix_;
  int number_ = 0;
  bool line_had_end_ = true;
};

std::string_view trimmed(std::string_view text);
std::vector<std::string_view> words_of(std::string_view line);
/// In quotes, cut to 40 characters, with what cannot be printed as '?'.
std::string quoted(std::string_view text);
/// The whole file. @throws std::invalid_argument  it cannot be read, or is compressed.
std::string read_file(const std::string& path, const char* reader);

}  // namespace orrery::eop
