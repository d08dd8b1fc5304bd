/// Tables as CSV files: one header line, LF, shortest numbers that read back the same.
#pragma once

#include <orrery/harness/kernel/time.hpp>
#include <orrery/harness/record/output_file.hpp>

#include <cstdint>
#include <filesystem>
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
  CsvWriter& integer(std::int64_t value);
  CsvWriter& integer(std::uint64_t value);
  CsvWriter& time(SimTime t) { return integer(to_ns(t)); }
  CsvWriter& text(std::string_view value);
  CsvWriter& empty() { return text(""); }
  /// @throws std::logic_error  fewer fields than columns. std::runtime_error  the disk is full.
  void end_row();

  /// @throws std::logic_error  within a row. std::runtime_error  the rest cannot be written.
  void close();
  /// As of OutputFile.
  void flush() { file_.flush(); }
  void continue_in(std::filesystem::path path) { file_.continue_in(std::move(path)); }

 private:
  void begin_field();

  OutputFile file_;
  std::string row_;
  std::size_t columns_;
  std::size_t fields_ = 0;
};

}  // namespace orrery
