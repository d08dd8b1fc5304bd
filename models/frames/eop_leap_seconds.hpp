/// The published table of leap seconds, to check the one that Orrery computes with.
#pragma once

#include <orrery/harness/kernel/simulator_only.hpp>

#include <string>
#include <string_view>
#include <vector>

namespace orrery {

/// TAI - UTC as in the USNO's tai-utc.dat. Simulations take leap seconds from ERFA
/// (time_scales.hpp); comparing the two tells whether ERFA is older than the file.
class LeapSecondTable {
 public:
  /// @throws std::invalid_argument  with source and line: not a row of that format, not a date, the
  ///                                Julian date another one, out of order, no row at all.
  static LeapSecondTable parse(std::string_view text, std::string_view source_name);
  static LeapSecondTable load(const std::string& path);

  /// TAI - UTC [s] on a UTC day, `mjd` (with its fraction: before 1972 UTC drifted).
  /// @throws std::out_of_range  before the first row; not finite.
  double tai_minus_utc_s(double mjd) const;

  /// The first day of each row.
  std::vector<int> steps_mjd() const;

 private:
  struct Row {
    int mjd = 0;
    double offset_s = 0;
    double drift_origin_mjd = 0, drift_s_per_day = 0;
  };
  std::vector<Row> rows_;
};

}  // namespace orrery
