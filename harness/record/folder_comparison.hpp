/// Where the records of two runs part.
#pragma once

#include <orrery/harness/kernel/simulator_only.hpp>

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace orrery {

/// The first difference within one file, or a file that one side alone has.
struct FileDifference {
  std::string file;                      // relative to both folders
  std::optional<std::int64_t> t_GPS_ns;  // of the row, where it is a table over time
  std::string text;                      // what differs, in words; one line
};

/// One entry for each file that differs: first those over time, the earliest first, then the others
/// by name.
///
/// Ignored  what equal runs may write otherwise: manifest.json, index.html, and in summary.json the
/// host times
///          wall_s, flight_wall_s and x_real_time; in report.html speed and command line.
/// Tables   (.csv) are compared field by field; a first column that ends in GPS_ns is the time. All
///          else is compared line by line, or byte by byte where it is not text.
/// @throws std::runtime_error  a folder or file cannot be read; names it.
std::vector<FileDifference> compare_folders(const std::filesystem::path& a,
                                            const std::filesystem::path& b);

}  // namespace orrery
