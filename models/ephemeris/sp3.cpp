#include <orrery/harness/kernel/text.hpp>
#include <orrery/models/ccsds/epoch.hpp>
#include <orrery/models/ephemeris/sp3.hpp>
#include <orrery/models/text/numbered_lines.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <stdexcept>

namespace orrery {
namespace {

using text::NumberedLines;
using text::quoted;
using text::trimmed;

constexpr std::int32_t kMjdOf1970 = 40587, kGpsEpochDay = 3657;
constexpr std::size_t kSatellitesPerLine = 17, kIdLines = 5, kMostSatellites = 85;
// Larger by far than any orbit about the Earth, smaller than a field of stars for "none".
constexpr double kFarthest_km = 1e6 - 1, kFastest_dmps = 1e6 - 1;
constexpr double kNoClock = 999999;

/// Reads line after line: each function takes those that are its own.
class Sp3Reader {
 public:
  Sp3Reader(std::string_view text, std::string_view source, Sp3Options options)
      : lines_(text, "parse_sp3", source), options_(options) {}

  Sp3 read() {
    read_first_line();
    read_second_line();
    read_satellite_ids();
    read_accuracies();
    read_time_system();
    read_constants();
    while (line_.starts_with("/*")) {
      sp3_.comments.emplace_back(trimmed(columns(3, 80)));
      advance();
    }
    while (line_.starts_with("* ")) read_epoch();
    read_end();
    return std::move(sp3_);
  }

 private:
  void advance() {
    const std::optional<std::string_view> line = lines_.next();
    if (!line || !lines_.line_had_end()) lines_.fail("cut short: no line EOF at the end");
    line_ = line->ends_with('\r') ? line->substr(0, line->size() - 1) : *line;
  }

  void require(std::string_view begin, const char* what) const {
    if (!line_.starts_with(begin))
      lines_.fail(quoted(line_) + "; accepted here: " + what + ", which begins with '" +
                  std::string(begin) + "'");
  }

  /// Columns as the standard counts them, from 1; what the line lacks is empty.
  std::string_view columns(std::size_t first, std::size_t last) const {
    if (first > line_.size()) return {};
    return line_.substr(first - 1, last - first + 1);
  }
  bool has(std::size_t column, char mark) const {
    return columns(column, column) == std::string_view(&mark, 1);
  }

  // ---- header

  void read_first_line() {
    advance();
    if (!line_.starts_with("#c"))
      lines_.fail(quoted(columns(1, 2)) + " is not the begin of a version read; accepted: #c");
    if (!has(3, 'P') && !has(3, 'V'))
      lines_.fail("column 3 is " + quoted(columns(3, 3)) + "; accepted: P, V");
    sp3_.has_velocities = has(3, 'V');
    start_ = calendar_at(4);
    sp3_.announced_epochs = lines_.integer(columns(33, 39), "number of epochs", 1, 9999999);
    sp3_.frame = trimmed(columns(47, 51));
    sp3_.agency = trimmed(columns(57, 60));
  }

  void read_second_line() {
    advance();
    require("##", "the week and the interval");
    const int week = lines_.integer(columns(4, 7), "GPS week", 0, 9999);
    const double second = lines_.real(columns(9, 23), "second of week", 604800);
    const double interval_s = lines_.real(columns(25, 38), "interval", 99999.99999999);
    const int mjd = lines_.integer(columns(40, 44), "Modified Julian Date", 0, 99999);
    const double fraction = lines_.real(columns(46, 60), "fraction of day", 1);
    if (!(interval_s > 0))
      lines_.fail("interval = " + to_text(interval_s) + " s; accepted: above 0");
    sp3_.interval = from_seconds(interval_s);
    const double day_s = 1e-9 * static_cast<double>(start_.ns_of_day);
    const double week_s = 86400.0 * (start_.day - kGpsEpochDay - 7 * week) + day_s;
    const double mjd_s = 86400.0 * (start_.day + kMjdOf1970 - mjd) + day_s;
    if (std::abs(week_s - second) > 1e-3)
      lines_.fail("week and second of week are not the start in line 1, " + to_text(start_));
    if (std::abs(mjd_s - 86400.0 * fraction) > 1e-3)
      lines_.fail("the Modified Julian Date is not the start in line 1, " + to_text(start_));
  }

  void read_satellite_ids() {
    std::size_t count = 0;
    for (std::size_t i = 0; i < kIdLines; ++i) {
      advance();
      require("+ ", "satellite identifiers");
      if (i == 0)
        count = static_cast<std::size_t>(lines_.integer(columns(4, 6), "number of satellites", 1,
                                                        static_cast<int>(kMostSatellites)));
      for (std::size_t k = 0; k < kSatellitesPerLine && sp3_.satellites.size() < count; ++k)
        add_satellite(columns(10 + 3 * k, 12 + 3 * k));
    }
  }

  void add_satellite(std::string_view id) {
    if (id.size() != 3 || id.find_first_of(" \t") == 0 || id.back() == ' ')
      lines_.fail("satellite identifier " + quoted(id) + "; accepted: three characters, as G01");
    if (index_of(id) != sp3_.satellites.size()) lines_.fail(quoted(id) + " is listed twice");
    sp3_.satellites.push_back({std::string(id)});
  }

  std::size_t index_of(std::string_view id) const {
    const auto& all = sp3_.satellites;
    return static_cast<std::size_t>(
        std::find_if(all.begin(), all.end(), [&](const auto& s) { return s.id == id; }) -
        all.begin());
  }

  void read_accuracies() {
    for (std::size_t i = 0; i < kIdLines; ++i) {
      advance();
      require("++", "accuracy codes");
      for (std::size_t k = 0; k < kSatellitesPerLine; ++k) {
        const std::size_t satellite = i * kSatellitesPerLine + k;
        const std::string_view code = trimmed(columns(10 + 3 * k, 12 + 3 * k));
        if (code.empty() || satellite >= sp3_.satellites.size()) continue;
        const int exponent = lines_.integer(code, "accuracy code", 0, 99);
        if (exponent > 0) sp3_.satellites[satellite].accuracy_m = std::ldexp(1e-3, exponent);
      }
    }
  }

  void read_time_system() {
    advance();
    require("%c", "the time system");
    sp3_.time_system = trimmed(columns(10, 12));
    const std::optional<TimeSystem> system = time_system_named(sp3_.time_system);
    if (system != TimeSystem::kGPS && system != TimeSystem::kTAI && system != TimeSystem::kUTC)
      lines_.fail("time system " + quoted(sp3_.time_system) + "; accepted: GPS, TAI, UTC");
    time_system_ = *system;
    sp3_.start = instant(start_);
    advance();
    require("%c", "the second line of characters");
  }

  void read_constants() {
    for (const char* const begin : {"%f", "%f", "%i", "%i"}) {
      advance();
      require(begin, "a line of constants");
    }
    advance();
    require("/*", "a comment");
  }

  // ---- epochs

  /// "2018 12 25  0  0  0.00000000", the year in columns `at` to at + 3.
  CcsdsEpoch calendar_at(std::size_t at) const {
    const int year = lines_.integer(columns(at, at + 3), "year", 1980, 2200);
    const int month = lines_.integer(columns(at + 5, at + 6), "month", 1, 12);
    const int day = lines_.integer(columns(at + 8, at + 9), "day", 1, 31);
    const int hour = lines_.integer(columns(at + 11, at + 12), "hour", 0, 23);
    const int minute = lines_.integer(columns(at + 14, at + 15), "minute", 0, 59);
    const double second = lines_.real(columns(at + 17, at + 27), "second", 61);
    if (second < 0 || second >= (hour == 23 && minute == 59 ? 61 : 60))
      lines_.fail("second = " + to_text(second) + " is no second of that minute");
    const std::chrono::year_month_day date{std::chrono::year(year),
                                           std::chrono::month(static_cast<unsigned>(month)),
                                           std::chrono::day(static_cast<unsigned>(day))};
    if (!date.ok()) lines_.fail(quoted(columns(at, at + 9)) + " is not a date");
    return {static_cast<std::int32_t>(std::chrono::sys_days(date).time_since_epoch().count()),
            (hour * 60 + minute) * 60'000'000'000 + std::llround(1e9 * second)};
  }

  SimTime instant(const CcsdsEpoch& epoch) const {
    try {
      return to_sim_time(epoch, time_system_);
    } catch (const std::invalid_argument& error) {
      lines_.fail(error.what());
    }
  }

  void read_epoch() {
    const SimTime t = instant(calendar_at(4));
    require_on_grid(t);
    sp3_.epochs.push_back(t);
    advance();
    for (Sp3Satellite& satellite : sp3_.satellites) read_records(satellite, t);
  }

  void require_on_grid(SimTime t) const {
    const auto count = static_cast<std::int64_t>(sp3_.epochs.size());
    const Duration since_start = t - sp3_.start;
    if (!options_.excerpt && since_start != count * sp3_.interval)
      lines_.fail("epoch " + std::to_string(count + 1) + " is " + to_string(since_start) +
                  " after the start; the header's interval is " + to_string(sp3_.interval));
    if (since_start < Duration::zero() || since_start % sp3_.interval != Duration::zero())
      lines_.fail("epoch is " + to_string(since_start) +
                  " after the start; accepted: multiples of " + to_string(sp3_.interval));
    if (count > 0 && t <= sp3_.epochs.back()) lines_.fail("epoch is not later than the one before");
  }

  /// The position, the velocity where there is one, and correlations, which are passed over.
  void read_records(Sp3Satellite& satellite, SimTime t) {
    require_record('P', satellite.id);
    Sp3Record record{.t = t};
    const Vec3 r_km = vector("position [km]", kFarthest_km);
    record.r_ECEF = 1e3 * r_km;
    record.clock_s = clock("clock [us]", 1e-6);
    record.clock_event = has(75, 'E');
    record.clock_predicted = has(76, 'P');
    record.maneuver = has(79, 'M');
    record.orbit_predicted = has(80, 'P');
    advance();
    if (line_.starts_with("EP")) advance();
    if (sp3_.has_velocities) read_velocity(satellite, record);
    if (r_km != Vec3{}) satellite.records.push_back(record);
  }

  void read_velocity(const Sp3Satellite& satellite, Sp3Record& record) {
    require_record('V', satellite.id);
    const Vec3 v_dmps = vector("velocity [dm/s]", kFastest_dmps);
    if (v_dmps != Vec3{}) record.v_ECEF = 0.1 * v_dmps;
    record.clock_rate = clock("clock rate [1e-4 us/s]", 1e-10);
    advance();
    if (line_.starts_with("EV")) advance();
  }

  void require_record(char kind, const std::string& id) const {
    const std::string begin = kind + id;
    if (line_.substr(0, 4) != begin)
      lines_.fail(quoted(line_.substr(0, 4)) + "; accepted here: " + begin);
    if (line_.size() < 60)
      lines_.fail("cut short: " + std::to_string(line_.size()) + " columns; accepted: 60 to 80");
  }

  Vec3 vector(const char* name, double limit) const {
    Vec3 v;
    v.x = lines_.real(columns(5, 18), name, limit);
    v.y = lines_.real(columns(19, 32), name, limit);
    v.z = lines_.real(columns(33, 46), name, limit);
    return v;
  }

  std::optional<double> clock(const char* name, double unit) const {
    const double value = lines_.real(columns(47, 60), name, 1e7);
    if (std::abs(value) >= kNoClock) return {};
    return unit * value;
  }

  // ---- end

  void read_end() {
    if (trimmed(line_) != "EOF")
      lines_.fail(quoted(line_) + "; accepted here: an epoch, which begins with '* ', or EOF");
    const auto found = static_cast<int>(sp3_.epochs.size());
    if (found == 0) lines_.fail("no epoch before EOF");
    if (options_.excerpt ? found > sp3_.announced_epochs : found != sp3_.announced_epochs)
      lines_.fail(std::to_string(found) + " epochs; the header announces " +
                  std::to_string(sp3_.announced_epochs));
    while (const auto rest = lines_.next())
      if (!trimmed(*rest).empty()) lines_.fail(quoted(*rest) + " follows EOF");
  }

  NumberedLines lines_;
  Sp3Options options_;
  std::string_view line_;
  Sp3 sp3_;
  CcsdsEpoch start_;
  TimeSystem time_system_ = TimeSystem::kGPS;
};

}  // namespace

const Sp3Satellite& Sp3::satellite(std::string_view id) const {
  std::string known;
  for (const Sp3Satellite& s : satellites) {
    if (s.id == id) return s;
    known += " " + s.id;
  }
  throw std::out_of_range("Sp3::satellite: no '" + std::string(id) + "'; there are:" + known);
}

Sp3 parse_sp3(std::string_view text, std::string_view source_name, Sp3Options options) {
  return Sp3Reader(text, source_name, options).read();
}

Sp3 load_sp3(const std::string& path, Sp3Options options) {
  return parse_sp3(text::read_file(path, "load_sp3"), path, options);
}

}  // namespace orrery
