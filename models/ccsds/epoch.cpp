#include <orrery/models/ccsds/epoch.hpp>

#include <erfa.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <stdexcept>

namespace orrery {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;
constexpr std::int64_t kDay_ns = 86'400 * kSecond_ns;
constexpr std::int32_t kGpsEpoch_day = 3657;  // 1980-01-06
constexpr Duration kTaiMinusGps = 19s;
constexpr Duration kTtMinusGps = 51s + 184ms;

constexpr std::array<std::string_view, 12> kNames = {"UTC", "TAI", "GPS",  "TT",  "TDB", "TCB",
                                                     "TCG", "UT1", "GMST", "MET", "MRT", "SCLK"};

using Date = std::chrono::year_month_day;

Date date_of(std::int32_t day) {
  return std::chrono::sys_days(std::chrono::days(day));
}

std::string padded(std::int64_t value, std::size_t width) {
  const std::string digits = std::to_string(value);
  return digits.size() < width ? std::string(width - digits.size(), '0') + digits : digits;
}

// ---- text

// Takes `count` digits from the front, or fails.
std::optional<int> take_digits(std::string_view& text, std::size_t count) {
  if (text.size() < count) return {};
  int value = 0;
  for (const char c : text.substr(0, count)) {
    if (c < '0' || c > '9') return {};
    value = 10 * value + (c - '0');
  }
  text.remove_prefix(count);
  return value;
}

bool take(std::string_view& text, char expected) {
  if (text.empty() || text.front() != expected) return false;
  text.remove_prefix(1);
  return true;
}

std::optional<std::int32_t> day_number(const std::chrono::sys_days& day) {
  return static_cast<std::int32_t>(day.time_since_epoch().count());
}

// YYYY-MM-DD or YYYY-DDD, up to the T.
std::optional<std::int32_t> take_date(std::string_view& text) {
  const std::optional<int> year = take_digits(text, 4);
  if (!year || !take(text, '-')) return {};
  const std::chrono::year y(*year);
  if (text.find('T') == 3) {
    const std::optional<int> day = take_digits(text, 3);
    if (!day || *day < 1 || *day > (y.is_leap() ? 366 : 365)) return {};
    return day_number(std::chrono::sys_days(y / 1 / 1) + std::chrono::days(*day - 1));
  }
  const std::optional<int> month = take_digits(text, 2);
  if (!month || !take(text, '-')) return {};
  const std::optional<int> day = take_digits(text, 2);
  if (!day) return {};
  const Date date{y, std::chrono::month(static_cast<unsigned>(*month)),
                  std::chrono::day(static_cast<unsigned>(*day))};
  if (!date.ok()) return {};
  return day_number(std::chrono::sys_days(date));
}

// .d... in nanoseconds; nothing is zero.
std::optional<std::int64_t> take_fraction_ns(std::string_view& text) {
  if (!take(text, '.')) return 0;
  std::int64_t ns = 0, unit_ns = kSecond_ns / 10;
  std::size_t digits = 0;
  for (; digits < text.size() && text[digits] >= '0' && text[digits] <= '9'; ++digits) {
    ns += unit_ns * (text[digits] - '0');
    unit_ns /= 10;
  }
  if (digits == 0) return {};
  text.remove_prefix(digits);
  return ns;
}

// ---- time systems

[[noreturn]] void throw_not_convertible(const std::string& what, TimeSystem system,
                                        const char* accepted) {
  throw std::invalid_argument("to_sim_time, to_epoch: " + what + " " +
                              std::string(name_of(system)) + "; accepted: " + accepted);
}

// TAI - UTC on a day from 1972 on.
Duration tai_minus_utc(std::int32_t day) {
  const Date date = date_of(day);
  double delta_s = 0;
  // Status 1: leap seconds may have been announced since ERFA's release.
  eraDat(static_cast<int>(date.year()), static_cast<int>(static_cast<unsigned>(date.month())),
         static_cast<int>(static_cast<unsigned>(date.day())), 0.0, &delta_s);
  return static_cast<int>(delta_s) * 1s;
}

// TDB - TT, from either: the difference in the argument is 2 ms.
Duration tdb_minus_tt(std::int32_t day, std::int64_t ns_of_day) {
  constexpr double k1970_JD = 2440587.5;
  const double difference_s =
      eraDtdb(k1970_JD + day, static_cast<double>(ns_of_day) / static_cast<double>(kDay_ns), 0.0,
              0.0, 0.0, 0.0);
  return Duration(std::llround(1e9 * difference_s));
}

// The clock of a system without leap seconds: GPS time plus an offset.
SimTime on_gps_clock(const CcsdsEpoch& epoch) {
  return SimTime(days(epoch.day - kGpsEpoch_day) + Duration(epoch.ns_of_day));
}

CcsdsEpoch from_gps_clock(SimTime t) {
  const auto day = std::chrono::floor<std::chrono::days>(t.time_since_epoch());
  return {static_cast<std::int32_t>(day.count()) + kGpsEpoch_day,
          to_ns(t.time_since_epoch() - Duration(day))};
}

SimTime utc_to_sim_time(const CcsdsEpoch& epoch) {
  const Duration offset = tai_minus_utc(epoch.day);
  if (epoch.ns_of_day >= kDay_ns && tai_minus_utc(epoch.day + 1) == offset)
    throw_not_convertible("no leap second at " + to_text(epoch), TimeSystem::kUTC,
                          "second 60 at the end of a day that has one");
  return on_gps_clock(epoch) + offset - kTaiMinusGps;
}

CcsdsEpoch sim_time_to_utc(SimTime t) {
  const SimTime tai = t + kTaiMinusGps;
  CcsdsEpoch epoch = from_gps_clock(tai);
  // The UTC day begins TAI - UTC after the TAI day of the same date.
  const Duration offset = tai_minus_utc(epoch.day);
  if (Duration(epoch.ns_of_day) >= offset) return {epoch.day, epoch.ns_of_day - to_ns(offset)};
  --epoch.day;
  return {epoch.day, epoch.ns_of_day + kDay_ns - to_ns(tai_minus_utc(epoch.day))};
}

void require_in_range(const CcsdsEpoch& epoch, TimeSystem system) {
  const int year = static_cast<int>(date_of(epoch.day).year());
  if (year < 1980 || year > 2200)
    throw_not_convertible("epoch " + to_text(epoch), system, "years 1980 to 2200");
  if (epoch.ns_of_day < 0 ||
      epoch.ns_of_day >= kDay_ns + (system == TimeSystem::kUTC ? kSecond_ns : 0))
    throw_not_convertible("ns_of_day = " + std::to_string(epoch.ns_of_day) + " ns", system,
                          "0 to 86400 s, in UTC with a leap second 86401 s");
}

}  // namespace

std::string_view name_of(TimeSystem system) {
  return kNames.at(static_cast<std::size_t>(system));
}

std::optional<TimeSystem> time_system_named(std::string_view name) {
  std::string upper(name);
  for (char& c : upper) {
    if (c >= 'a' && c <= 'z') c = static_cast<char>(c - 'a' + 'A');
  }
  const auto found = std::find(kNames.begin(), kNames.end(), upper);
  if (found == kNames.end()) return {};
  return static_cast<TimeSystem>(found - kNames.begin());
}

std::optional<CcsdsEpoch> read_epoch(std::string_view text) {
  const std::optional<std::int32_t> day = take_date(text);
  if (!day || !take(text, 'T')) return {};
  const std::optional<int> hour = take_digits(text, 2);
  if (!hour || *hour > 23 || !take(text, ':')) return {};
  const std::optional<int> minute = take_digits(text, 2);
  if (!minute || *minute > 59 || !take(text, ':')) return {};
  const std::optional<int> second = take_digits(text, 2);
  if (!second || *second > (*hour == 23 && *minute == 59 ? 60 : 59)) return {};
  const std::optional<std::int64_t> fraction_ns = take_fraction_ns(text);
  if (!fraction_ns) return {};
  take(text, 'Z');
  if (!text.empty()) return {};
  return CcsdsEpoch{*day, ((*hour * 60 + *minute) * 60 + *second) * kSecond_ns + *fraction_ns};
}

std::string to_text(const CcsdsEpoch& epoch) {
  const Date date = date_of(epoch.day);
  // Second 60 belongs to 23:59.
  const std::int64_t minute = std::min<std::int64_t>(epoch.ns_of_day / (60 * kSecond_ns), 1439);
  const std::int64_t ns_of_minute = epoch.ns_of_day - minute * 60 * kSecond_ns;
  std::string text = padded(static_cast<int>(date.year()), 4) + '-' +
                     padded(static_cast<unsigned>(date.month()), 2) + '-' +
                     padded(static_cast<unsigned>(date.day()), 2) + 'T' + padded(minute / 60, 2) +
                     ':' + padded(minute % 60, 2) + ':' + padded(ns_of_minute / kSecond_ns, 2);
  if (ns_of_minute % kSecond_ns != 0) {
    text += '.' + padded(ns_of_minute % kSecond_ns, 9);
    text.erase(text.find_last_not_of('0') + 1);
  }
  return text;
}

SimTime to_sim_time(const CcsdsEpoch& epoch, TimeSystem system) {
  require_in_range(epoch, system);
  switch (system) {
    case TimeSystem::kUTC:
      return utc_to_sim_time(epoch);
    case TimeSystem::kGPS:
      return on_gps_clock(epoch);
    case TimeSystem::kTAI:
      return on_gps_clock(epoch) - kTaiMinusGps;
    case TimeSystem::kTT:
      return on_gps_clock(epoch) - kTtMinusGps;
    case TimeSystem::kTDB:
      return on_gps_clock(epoch) - tdb_minus_tt(epoch.day, epoch.ns_of_day) - kTtMinusGps;
    default:
      throw_not_convertible("time system", system, "UTC, TAI, GPS, TT, TDB");
  }
}

CcsdsEpoch to_epoch(SimTime t, TimeSystem system) {
  require_in_range(from_gps_clock(t), TimeSystem::kGPS);
  switch (system) {
    case TimeSystem::kUTC:
      return sim_time_to_utc(t);
    case TimeSystem::kGPS:
      return from_gps_clock(t);
    case TimeSystem::kTAI:
      return from_gps_clock(t + kTaiMinusGps);
    case TimeSystem::kTT:
      return from_gps_clock(t + kTtMinusGps);
    case TimeSystem::kTDB: {
      const CcsdsEpoch tt = from_gps_clock(t + kTtMinusGps);
      return from_gps_clock(t + kTtMinusGps + tdb_minus_tt(tt.day, tt.ns_of_day));
    }
    default:
      throw_not_convertible("time system", system, "UTC, TAI, GPS, TT, TDB");
  }
}

}  // namespace orrery
