/// Key-value notation of CCSDS orbit data messages, line by line. Not installed.
#pragma once

#include <orrery/models/ccsds/epoch.hpp>
#include <orrery/models/text/numbered_lines.hpp>

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace orrery::ccsds {

/// "KEYWORD = value", one of the four words that stand alone (META_START), or data without a
/// keyword.
struct KvnLine {
  int number = 0;
  std::string_view keyword;  // empty: data
  std::string_view value;    // of data: the whole line
};

/// Takes a message apart: blank lines are skipped, comments collected, one line looked ahead.
class KvnLines {
 public:
  /// `reader` opens every message: "parse_oem".
  KvnLines(std::string_view text, std::string_view reader, std::string_view source)
      : lines_(text, reader, source) {}

  /// The next line that is no comment, without taking it; null after the last.
  const KvnLine* peek();
  bool next_is(std::string_view keyword);
  /// Takes it. Comments seen on the way are added to `comments`.
  KvnLine take(std::vector<std::string>& comments);
  /// Takes "keyword = ..." or fails with what is there instead.
  KvnLine take(std::string_view keyword, std::vector<std::string>& comments);
  /// Comments that no line has followed.
  void take_remaining_comments(std::vector<std::string>& comments);

  /// @throws std::invalid_argument  "reader: source, line N: what", always. Without a number: the
  ///                                line last looked at.
  [[noreturn]] void fail(int line, const std::string& what) const { lines_.fail(line, what); }
  [[noreturn]] void fail(const std::string& what) const { lines_.fail(what); }

  // Values. `unit` is what may follow in brackets: "km"; empty: nothing may.
  double real(const KvnLine& line, std::string_view unit) const;
  double not_negative(const KvnLine& line, std::string_view unit) const;
  double number(int line, std::string_view word, std::string_view name) const;
  int integer(const KvnLine& line, int low, int high) const;
  CcsdsEpoch epoch(const KvnLine& line) const;
  CcsdsEpoch epoch(int line, std::string_view word, std::string_view name) const;
  std::string text(const KvnLine& line) const;

 private:
  void look_ahead();
  KvnLine classify(std::string_view line) const;

  text::NumberedLines lines_;
  std::optional<KvnLine> next_;
  std::vector<std::string> comments_;
};

using text::quoted;
using text::words_of;

/// Writes what KvnLines reads. @throws std::invalid_argument  text that would not be read back, a
/// number that is not finite; names `writer` and the keyword.
class KvnWriter {
 public:
  explicit KvnWriter(std::string_view writer) : writer_(writer) {}

  void line(std::string_view text);
  void comments(const std::vector<std::string>& comments);
  void text(std::string_view keyword, std::string_view value);
  void real(std::string_view keyword, double value);
  void epoch(std::string_view keyword, const CcsdsEpoch& value);
  void data(std::string_view epoch, const double* values, std::size_t count);

  // Only what is there.
  void optional_text(std::string_view keyword, const std::optional<std::string>& value);
  void optional_real(std::string_view keyword, const std::optional<double>& value);
  void optional_epoch(std::string_view keyword, const std::optional<CcsdsEpoch>& value);

  std::string take() { return std::move(out_); }

 private:
  std::string number(std::string_view name, double value) const;

  std::string writer_, out_;
};

}  // namespace orrery::ccsds
