/// How the real Earth turns: UT1, polar motion and nutation offsets from files of the IERS.
#pragma once

#include <orrery/harness/kernel/time.hpp>

#include <string>
#include <string_view>
#include <vector>

namespace orrery {

/// Earth orientation at one instant. All zero: UT1 = UTC, no polar motion, the bare nutation model.
struct EarthOrientationParameters {
  double ut1_minus_utc_s = 0;  // UTC by ERFA's leap seconds, as leap_seconds() of time_scales.hpp
  double x_pole_rad = 0, y_pole_rad = 0;
  double dpsi_rad = 0,
         deps_rad = 0;         // to be added to the IAU 1980 nutation; from EME2000 to GCRF axes
  double length_of_day_s = 0;  // in excess of 86400 s
};

/// A table of daily Earth orientation parameters, interpolated.
///
/// Formats   IERS finals2000A (fixed columns: polar motion, UT1-UTC, dX, dY) and CelesTrak's
/// EOP-All
///           (polar motion, UT1-UTC, dPsi, dEps, dX, dY, TAI-UTC). Observed and predicted rows
///           count alike; last_observed() tells where the prediction begins. Rows before 1980 are
///           checked and left out, since leap_seconds() and SimTime's calendar begin there.
/// Method    Cubic Lagrange through the four rows nearest, on UT1-TAI, which has no leap seconds;
/// at
///           a row its own values, to rounding. Interpolating a day of the 13.66 d tide this way
///           leaves 1 us of UT1; linear interpolation 20 us, 1 cm in low Earth orbit. Tides within
///           a day (UT1 50 us, pole 0.5 mas: 2 cm) are not in the files, nor added.
///           dX, dY of finals2000A (corrections to IAU 2000A/2006) are turned into dPsi, dEps by
///           comparing the two models' poles at the instant asked for: about 0.1 ms a call; with
///           CelesTrak's dPsi, dEps 0.3 us. Missing predictions of dX, dY count as zero (0.3 mas),
///           those of the length of day follow from UT1.
/// Pure      Same instant, same bits, whatever was asked before; safe to call from several threads.
/// Errors    Everything that does not read as a whole file throws std::invalid_argument with source
///           and line: cut short, wrong columns, not a number, not finite, implausibly large, not
///           text, dates out of order, TAI-UTC other than ERFA's.
/// Checked   test_suites/unit/models/frames/eop_table_test.cpp,
///           test_suites/validation/models/frames/eop_table_test.cpp
class EarthOrientationTable {
 public:
  /// Zeros at every instant.
  static EarthOrientationTable none() { return {}; }

  /// The format is recognised: EOP-All begins with VERSION or a comment, finals2000A with a date.
  /// @throws std::invalid_argument  see above; also fewer than 4 rows since 1980.
  static EarthOrientationTable parse(std::string_view text, std::string_view source_name);
  /// The same from a file. @throws std::invalid_argument  also if it cannot be read, or is
  /// compressed.
  static EarthOrientationTable load(const std::string& path);

  /// @throws std::out_of_range  `t` outside first() to last(); none() has no such limits.
  EarthOrientationParameters at(SimTime t) const;

  /// Two rows next to one another with from <= t < to, or the last two: at() is smooth between
  /// them.
  struct Span {
    SimTime from, to;
  };
  /// @throws as at(); std::logic_error  for none().
  Span rows_around(SimTime t) const;

  bool is_none() const { return rows_.empty(); }
  /// 0h UTC of the first and last row; of the last observed one, first() if all are predicted.
  /// @throws std::logic_error  for none().
  SimTime first() const;
  SimTime last() const;
  SimTime last_observed() const;

 private:
  enum class Offsets { kDpsiDeps, kDxDy };
  struct Row {
    SimTime t;
    double ut1_minus_tai_s = 0;
    double x_pole_rad = 0, y_pole_rad = 0;
    double offset_1_rad = 0, offset_2_rad = 0;
    double length_of_day_s = 0;
  };

  void fill_length_of_day();
  void require_rows(const char* function) const;
  std::size_t row_before(SimTime t) const;

  std::string source_;
  Offsets offsets_ = Offsets::kDpsiDeps;
  std::vector<Row> rows_;
  SimTime last_observed_{};
};

}  // namespace orrery
