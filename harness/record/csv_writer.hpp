/// Tables as CSV files: one header line, LF, shortest numbers that read back the same, or with a
/// fixed count of decimals.
#pragma once

#include <orrery/harness/kernel/time.hpp>
#include <orrery/harness/record/output_file.hpp>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <initializer_list>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace orrery {

/// One row at a time, field by field:
///
///   CsvWriter csv(path, {"t_GPS_ns", "x_m", "fate"});
///   csv.integer(to_ns(t)).number(x_m).text("delivered").end_row();
///
/// Fields with a comma, a quote or a line break are quoted (RFC 4180).
class CsvWriter {
 public:
  /// @throws std::invalid_argument  no columns. std::runtime_error  the file cannot be written.
  CsvWriter(const std::filesystem::path& path, const std::vector<std::string_view>& columns);

  /// @throws std::logic_error  more fields than columns.
  CsvWriter& number(double value);
  /// Some fields with 0 to 17 decimals: where a table need not be finer, shorter and faster.
  CsvWriter& fixed(std::initializer_list<double> values, int decimals);
  CsvWriter& integer(std::int64_t value);
  CsvWriter& integer(std::uint64_t value);
  CsvWriter& time(SimTime t) { return integer(to_ns(t)); }
  CsvWriter& text(std::string_view value);
  CsvWriter& empty() { return text(""); }
  /// @throws std::logic_error  fewer fields than columns. std::runtime_error  the disk is full.
  void end_row();

  /// @throws std::logic_error  within a row. std::runtime_error  the rest cannot be written.
  void close();
  /// From here on `sink` gets what goes into the fields, for a digest: of numbers all 64 bits (any
  /// NaN as 0x7ff8000000000000), of texts the length in 64 bits and the characters.
  void give_values_to(std::function<void(Bytes)> sink) { sink_ = std::move(sink); }

  /// As of OutputFile.
  void flush() { file_.flush(); }
  void continue_in(std::filesystem::path path) { file_.continue_in(std::move(path)); }

 private:
  char* begin_fields(std::size_t count);
  void end_field(const char* end);
  char* room(std::size_t bytes);
  void add_value(std::uint64_t value);
  void hand_over_values();

  OutputFile file_;
  std::string row_;  // as long as the longest so far; its text ends at end_
  std::size_t end_ = 0;
  std::size_t columns_;
  std::size_t fields_ = 0;
  std::function<void(Bytes)> sink_;
  std::vector<std::uint64_t> values_;  // for the sink
};

}  // namespace orrery
