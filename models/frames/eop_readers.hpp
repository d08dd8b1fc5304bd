/// Rows of Earth orientation parameters as the IERS and CelesTrak print them. Not installed.
#pragma once

#include <orrery/harness/kernel/simulator_only.hpp>

#include <optional>
#include <string_view>
#include <vector>

namespace orrery::eop {

/// One day, at 0h UTC.
struct Row {
  int mjd = 0;
  double x_pole_arcsec = 0, y_pole_arcsec = 0;
  double ut1_minus_utc_s = 0;
  std::optional<double> length_of_day_s;  // in excess of 86400 s
  // dPsi, dEps to IAU 1980, or dX, dY to IAU 2000A/2006: see File.
  std::optional<double> first_offset_arcsec, second_offset_arcsec;
  bool predicted = false;
};

enum class PoleOffsets { kIau1980, kIau2000A };

struct File {
  PoleOffsets offsets = PoleOffsets::kIau1980;
  std::vector<Row> rows;  // one a day, no day missing
};

/// Both check every row: number of columns, numbers, plausible size, date against MJD, one day
/// after the other; CelesTrak's also that TAI-UTC is ERFA's.
/// @throws std::invalid_argument  with source and line.
File read_finals2000a(std::string_view text, std::string_view source);
File read_celestrak(std::string_view text, std::string_view source);

/// TAI - UTC [s] at 0h UTC of a day from 1972 on, from ERFA's table.
int tai_minus_utc_s(int mjd);

constexpr int kMjd1970 = 40587;   // 1970-01-01
constexpr int kMjd1972 = 41317;   // TAI-UTC is a whole number from here on
constexpr int kMjd1980 = 44239;   // gps_midnight and leap_seconds begin here
constexpr int kMjd2200 = 124957;  // 2200-12-31, where they end

}  // namespace orrery::eop
