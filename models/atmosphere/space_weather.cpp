#include <orrery/models/atmosphere/space_weather.hpp>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <stdexcept>

namespace orrery {
namespace {

constexpr double k1970_JD = 2440587.5;
constexpr int kIntervals = 8;  // of 3 h in a day

std::string date_text(int days_since_1970) {
  const std::chrono::year_month_day date{std::chrono::sys_days(std::chrono::days(days_since_1970))};
  char text[40];
  std::snprintf(text, sizeof text, "%04d-%02u-%02u", static_cast<int>(date.year()),
                static_cast<unsigned>(date.month()), static_cast<unsigned>(date.day()));
  return text;
}

std::string time_text(const JulianDate& utc) {
  const int seconds = static_cast<int>(utc.fraction * 86400);
  char text[40];
  std::snprintf(text, sizeof text, " %02d:%02d:%02d UTC", seconds / 3600, seconds / 60 % 60,
                seconds % 60);
  return text;
}

void check(const char* name, double value, double low, double high) {
  if (value >= low && value <= high) return;
  throw std::domain_error("SpaceWeather::constant: " + std::string(name) + " = " +
                          std::to_string(value) + "; accepted: " + std::to_string(low) + " to " +
                          std::to_string(high));
}

}  // namespace

SpaceWeather SpaceWeather::constant(const SpaceWeatherIndices& indices) {
  check("f107_sfu", indices.f107_sfu, 50, 450);
  check("f107a_sfu", indices.f107a_sfu, 50, 300);
  check("ap_daily", indices.ap_daily, 0, 400);
  if (indices.ap_history) {
    for (const double ap : *indices.ap_history) check("ap_history", ap, 0, 400);
  }
  SpaceWeather out;
  out.constant_ = indices;
  return out;
}

SpaceWeatherIndices SpaceWeather::at(const JulianDate& utc) const {
  if (constant_) return *constant_;
  if (!(utc.day > 0 && utc.day < 1e7 && utc.fraction >= 0 && utc.fraction < 1)) {
    throw std::invalid_argument("SpaceWeather::at: not a Julian date: " + std::to_string(utc.day) +
                                " + " + std::to_string(utc.fraction) + " d");
  }
  const int today = static_cast<int>(utc.day - k1970_JD);
  if (!(today >= first_covered_ && today <= last_covered_)) {
    throw std::out_of_range("SpaceWeather::at: " + date_text(today) + time_text(utc) +
                            " is outside " + source_ + ", which covers " + covered());
  }
  SpaceWeatherIndices out{.f107_sfu = day(today - 1).f107_sfu,
                          .f107a_sfu = day(today).f107a_sfu,
                          .ap_daily = day(today).ap_daily};
  if (three_hourly_) out.ap_history = history(today, static_cast<int>(utc.fraction * kIntervals));
  return out;
}

const SpaceWeather::Day& SpaceWeather::day(int days_since_1970) const {
  return days_[static_cast<std::size_t>(days_since_1970 - first_day_)];
}

ApHistory SpaceWeather::history(int days_since_1970, int interval) const {
  const int now = (days_since_1970 - first_day_) * kIntervals + interval;
  const auto ap = [&](int intervals_ago) {
    const auto at = static_cast<std::size_t>(now - intervals_ago);
    return days_[at / kIntervals].ap[at % kIntervals];
  };
  const auto mean_of_eight = [&](int first_ago) {
    double sum = 0;
    for (int k = first_ago; k < first_ago + kIntervals; ++k) sum += ap(k);
    return sum / kIntervals;
  };
  // Intervals 4 to 11 back began 12 to 33 h before this one, 12 to 19 back 36 to 57 h.
  return {day(days_since_1970).ap_daily,
          ap(0),
          ap(1),
          ap(2),
          ap(3),
          mean_of_eight(4),
          mean_of_eight(12)};
}

std::optional<SimTime> SpaceWeather::next_change(SimTime t) const {
  if (constant_) return {};
  return next_utc_multiple(t, three_hourly_ ? Duration(3h) : Duration(24h));
}

std::string SpaceWeather::covered() const {
  if (constant_) return "all times";
  return date_text(first_covered_) + " to " + date_text(last_covered_) + " UTC";
}

SimTime next_utc_multiple(SimTime t, Duration step) {
  // The GPS epoch was a UTC midnight.
  const auto since_midnight_1980 = [](SimTime at) {
    return at.time_since_epoch() + 19s - leap_seconds(at) * 1s;
  };
  const Duration utc = since_midnight_1980(t);
  Duration intervals = utc / step * step;
  if (intervals > utc) intervals -= step;
  const Duration target = intervals + step;
  const SimTime without_leap = t + (target - utc);
  // A leap second within the interval moves the end.
  const Duration missing = target - since_midnight_1980(without_leap);
  return missing > 0ns ? without_leap + missing : without_leap;
}

}  // namespace orrery
