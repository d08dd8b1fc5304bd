#include <orrery/harness/kernel/text.hpp>
#include <orrery/harness/kernel/time.hpp>

#include <cmath>
#include <stdexcept>
#include <string>

namespace orrery {
namespace {

constexpr std::chrono::sys_days kGpsEpoch = std::chrono::year{1980} / 1 / 6;
constexpr std::int64_t kNsPerSecond = 1'000'000'000;
constexpr std::uint64_t kNsPerDay = 86'400'000'000'000;

// At least `width` digits. std::to_string of an integer knows no locale.
std::string padded(std::uint64_t value, std::size_t width) {
  const std::string digits = std::to_string(value);
  return digits.size() < width ? std::string(width - digits.size(), '0') + digits : digits;
}

// "<whole>.<fraction>" of value / unit_ns without trailing zeros; digits = log10(unit_ns).
std::string decimal(std::uint64_t value, std::uint64_t unit_ns, std::size_t digits) {
  std::string text = std::to_string(value / unit_ns) + '.' + padded(value % unit_ns, digits);
  text.erase(text.find_last_not_of('0') + 1);
  if (text.back() == '.') text.pop_back();
  return text;
}

[[noreturn]] void throw_not_a_date(int year, int month, int day) {
  throw std::invalid_argument("gps_midnight: " + std::to_string(year) + "-" +
                              std::to_string(month) + "-" + std::to_string(day) +
                              " is not a date of the years 1980 to 2200");
}

}  // namespace

Duration from_seconds(double seconds) {
  constexpr double kLimit_s = 9.2e9;
  if (!(std::fabs(seconds) <= kLimit_s)) {
    throw std::invalid_argument("from_seconds: seconds = " + to_text(seconds) +
                                " s is outside -9.2e9 ... 9.2e9 s");
  }
  // Whole seconds apart, so that nanoseconds survive beyond 2^53 ns (104 days).
  const double whole = std::trunc(seconds);
  const double fraction_ns = (seconds - whole) * 1e9;
  return Duration(static_cast<std::int64_t>(whole) * kNsPerSecond + std::llround(fraction_ns));
}

SimTime gps_midnight(int year, int month, int day) {
  if (year < 1980 || year > 2200 || month < 1 || day < 1) throw_not_a_date(year, month, day);
  const std::chrono::year_month_day date{std::chrono::year(year),
                                         std::chrono::month(static_cast<unsigned>(month)),
                                         std::chrono::day(static_cast<unsigned>(day))};
  if (month > 12 || day > 31 || !date.ok()) throw_not_a_date(year, month, day);
  return SimTime(std::chrono::sys_days(date) - kGpsEpoch);
}

std::string to_calendar(SimTime t) {
  // Days first: nanoseconds since 1970 would leave the range near its ends.
  const auto day = std::chrono::floor<std::chrono::days>(t.time_since_epoch());
  const std::chrono::year_month_day date{kGpsEpoch + day};
  const auto ns_of_day =
      static_cast<std::uint64_t>(to_ns(t)) - static_cast<std::uint64_t>(day.count()) * kNsPerDay;
  const std::uint64_t s_of_day = ns_of_day / kNsPerSecond;

  return padded(static_cast<std::uint64_t>(static_cast<int>(date.year())), 4) + '-' +
         padded(static_cast<unsigned>(date.month()), 2) + '-' +
         padded(static_cast<unsigned>(date.day()), 2) + 'T' + padded(s_of_day / 3600, 2) + ':' +
         padded(s_of_day / 60 % 60, 2) + ':' + padded(s_of_day % 60, 2) + '.' +
         padded(ns_of_day % kNsPerSecond, 9);
}

std::string to_string(SimTime t) {
  return to_calendar(t) + " GPST";
}

std::string to_string(Duration d) {
  // Unsigned, since the most negative duration has no positive counterpart.
  const auto bits = static_cast<std::uint64_t>(d.count());
  const std::uint64_t size_ns = d.count() < 0 ? 0 - bits : bits;
  const std::string sign = d.count() < 0 ? "-" : "";
  if (size_ns == 0) return "0 s";
  if (size_ns >= 1'000'000'000) return sign + decimal(size_ns, 1'000'000'000, 9) + " s";
  if (size_ns >= 1'000'000) return sign + decimal(size_ns, 1'000'000, 6) + " ms";
  if (size_ns >= 1'000) return sign + decimal(size_ns, 1'000, 3) + " us";
  return sign + std::to_string(size_ns) + " ns";
}

}  // namespace orrery
