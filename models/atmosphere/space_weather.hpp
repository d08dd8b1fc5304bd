/// Solar flux and geomagnetic activity at an instant: constant, by month, or day by day from a
/// file.
#pragma once

#include <orrery/harness/kernel/time.hpp>
#include <orrery/models/atmosphere/nrlmsise00.hpp>
#include <orrery/models/frames/time_scales.hpp>

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace orrery {

/// What NRLMSISE-00 asks for; ranges as in Nrlmsise00Input.
struct SpaceWeatherIndices {
  double f107_sfu = 150;                     // observed, of the UT day before
  double f107a_sfu = 150;                    // observed, mean of the 81 days centred on the UT day
  double ap_daily = 15;                      // of the UT day [2 nT]
  std::optional<ApHistory> ap_history = {};  // where the source has three-hourly values
};

/// A table of days, or a constant. A value: copies are independent, lookups are pure and take no
/// lock.
///
/// Flux      "Observed": not reduced to 1 au, as NRLMSISE-00 wants it. Values are handed out as
/// they
///           stand in the source; the few readings that a radio burst raised above 450 sfu are
///           refused later, by the model.
/// Errors    Everything that does not read as a complete table throws std::invalid_argument with
/// source
///           and line: cut short, wrong counts, a missing day, a field that is no number or out of
///           range.
/// Checked   test_suites/unit/models/atmosphere/space_weather_test.cpp; the whole CelesTrak file in
///           test_suites/validation/models/atmosphere
class SpaceWeather {
 public:
  /// @throws std::domain_error  an index outside the range in Nrlmsise00Input.
  static SpaceWeather constant(const SpaceWeatherIndices& indices);

  /// Monthly means of 2014 to 2025, compiled in (models/data). A day has its month's F10.7 and Ap,
  /// no history; F10.7A is the mean of 81 such days, so that 2014-02-10 to 2025-11-21 is covered.
  /// For design and long arcs, not for a given day.
  static SpaceWeather monthly();
  /// The same from text with that header: year,month,f107_obs_monthly_mean,ap_monthly_mean.
  static SpaceWeather parse_monthly(std::string_view text, std::string_view source_name);

  /// CelesTrak's "SpaceWeather" text file, version 1.2 (SW-All.txt, SW-Last5Years.txt): its
  /// observed and daily predicted days. Monthly predictions are checked and left out. Covered from
  /// the fourth day, because the history of ap reaches back 57 h.
  static SpaceWeather load_celestrak(const std::string& path);
  static SpaceWeather parse_celestrak(std::string_view text, std::string_view source_name);

  /// @throws std::out_of_range  an instant outside covered(); names both.
  /// @throws std::invalid_argument  a Julian date that is none.
  SpaceWeatherIndices at(SimTime t) const { return at(gps_to_utc(t)); }
  SpaceWeatherIndices at(const JulianDate& utc) const;

  /// The first instant after `t` at which at() may jump: the next UTC midnight, or, with
  /// three-hourly values, the next multiple of 3 h. None for a constant.
  std::optional<SimTime> next_change(SimTime t) const;

  /// "1957-10-04 to 2026-10-05 UTC", both days included; "all times" for a constant.
  std::string covered() const;

 private:
  friend class CelestrakReader;
  friend class MonthlyReader;

  struct Day {
    double f107_sfu, f107a_sfu, ap_daily;
    std::array<double, 8> ap;  // of the eight intervals of 3 h
  };

  SpaceWeather() = default;
  const Day& day(int days_since_1970) const;
  ApHistory history(int days_since_1970, int interval) const;

  std::string source_;
  std::optional<SpaceWeatherIndices> constant_;
  std::vector<Day> days_;
  int first_day_ = 0;                         // of days_, since 1970-01-01
  int first_covered_ = 0, last_covered_ = 0;  // both included
  bool three_hourly_ = false;
};

/// The first instant after `t` whose UTC is a multiple of `step` after midnight; `step` divides a
/// day.
SimTime next_utc_multiple(SimTime t, Duration step);

}  // namespace orrery
