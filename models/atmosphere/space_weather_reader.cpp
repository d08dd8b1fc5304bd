#include <orrery/models/atmosphere/space_weather.hpp>
#include <orrery/models/data/embedded_tables.hpp>
#include <orrery/models/text/numbered_lines.hpp>

#include <array>
#include <chrono>

namespace orrery {
namespace {

using text::NumberedLines;
using text::quoted;
using text::trimmed;

// What no index has ever exceeded by far; above, a file is damaged.
constexpr double kHighestFlux_sfu = 2000, kHighestAp = 400;

constexpr const char* kReader = "SpaceWeather";

int days_since_1970(const NumberedLines& lines, int year, int month, int day) {
  const std::chrono::year_month_day date{std::chrono::year(year),
                                         std::chrono::month(static_cast<unsigned>(month)),
                                         std::chrono::day(static_cast<unsigned>(day))};
  if (!date.ok()) {
    lines.fail("no such date: " + std::to_string(year) + "-" + std::to_string(month) + "-" +
               std::to_string(day));
  }
  return static_cast<int>(std::chrono::sys_days(date).time_since_epoch().count());
}

constexpr int kFirstYear = 1900, kLastYear = 2200;

}  // namespace

// ---- CelesTrak

/// The layout is fixed columns: FORMAT(I4,I3,I3,I5,I3,8I3,I4,8I4,I4,F4.1,I2,I4,F6.1,I2,5F6.1).
class CelestrakReader {
 public:
  CelestrakReader(std::string_view text, std::string_view source) : lines_(text, kReader, source) {}

  SpaceWeather read() {
    expect_first_line();
    while (const std::optional<std::string_view> line = next_keyword()) {
      if (line->substr(0, 4) == "NUM_") read_section(*line);
    }
    if (!seen_observed_) lines_.fail("cut short: no section OBSERVED");
    return finish();
  }

 private:
  static constexpr std::array<std::size_t, 33> kWidths = {4, 3, 3, 5, 3, 3, 3, 3, 3, 3, 3,
                                                          3, 3, 4, 4, 4, 4, 4, 4, 4, 4, 4,
                                                          4, 4, 2, 4, 6, 2, 6, 6, 6, 6, 6};
  static constexpr std::size_t kLineLength = 130;
  static constexpr std::size_t kFirstAp = 14, kMeanAp = 22, kObservedFlux = 30, kObservedMean = 31;
  using Fields = std::array<std::string_view, kWidths.size()>;

  void expect_first_line() {
    const std::optional<std::string_view> line = lines_.next_whole();
    if (!line || *line != "DATATYPE CssiSpaceWeather") {
      lines_.fail("not a CelesTrak space-weather file: it starts with DATATYPE CssiSpaceWeather");
    }
  }

  /// The next line that is neither empty nor a comment.
  std::optional<std::string_view> next_keyword() {
    while (const std::optional<std::string_view> line = lines_.next_whole()) {
      if (trimmed(*line).empty() || line->front() == '#') continue;
      const bool known = line->substr(0, 8) == "VERSION " || line->substr(0, 8) == "UPDATED " ||
                         line->substr(0, 4) == "NUM_";
      if (!known) lines_.fail("unknown: " + quoted(*line));
      return line;
    }
    return {};
  }

  /// NUM_<name>_POINTS n, BEGIN <name>, n lines, END <name>.
  void read_section(std::string_view head) {
    const std::size_t blank = head.find(' ');
    const std::string_view keyword = head.substr(0, blank);
    constexpr std::string_view kPoints = "_POINTS";
    if (blank == std::string_view::npos || keyword.size() <= 4 + kPoints.size() ||
        keyword.substr(keyword.size() - kPoints.size()) != kPoints) {
      lines_.fail("unknown: " + quoted(head));
    }
    const std::string name(keyword.substr(4, keyword.size() - 4 - kPoints.size()));
    const int announced = lines_.integer(head.substr(blank), keyword, 1, 1'000'000);
    begin_section(name);
    for (int i = 0; i < announced; ++i) read_row(name, i, announced);
    if (lines_.next_whole() != "END " + name) {
      lines_.fail("END " + name + " is missing: more lines than the " + std::to_string(announced) +
                  " announced, or cut short");
    }
  }

  void begin_section(const std::string& name) {
    const bool in_order = name == "OBSERVED" ? !seen_observed_ : seen_observed_;
    if ((name != "OBSERVED" && name != "DAILY_PREDICTED" && name != "MONTHLY_PREDICTED") ||
        !in_order) {
      lines_.fail(
          "section " + quoted(name) +
          " is unknown, repeated or out of order; accepted: OBSERVED, then DAILY_PREDICTED, "
          "MONTHLY_PREDICTED");
    }
    seen_observed_ = true;
    if (lines_.next_whole() != "BEGIN " + name) lines_.fail("BEGIN " + name + " is missing");
  }

  void read_row(const std::string& section, int number, int announced) {
    const std::optional<std::string_view> line = lines_.next_whole();
    if (!line || line->substr(0, 4) == "END ") {
      lines_.fail(section + " ends after " + std::to_string(number) + " of " +
                  std::to_string(announced) + " announced lines");
    }
    const Fields fields = split(*line);
    const int day = days_since_1970(
        lines_, lines_.integer(fields[0], "year", kFirstYear, kLastYear),
        lines_.integer(fields[1], "month", 1, 12), lines_.integer(fields[2], "day", 1, 31));
    if (section == "MONTHLY_PREDICTED") return;
    append(day, fields);
  }

  Fields split(std::string_view line) const {
    if (line.size() != kLineLength) {
      lines_.fail("the line has " + std::to_string(line.size()) +
                  " characters; accepted: " + std::to_string(kLineLength));
    }
    Fields fields;
    std::size_t at = 0;
    for (std::size_t i = 0; i < fields.size(); ++i) {
      fields[i] = line.substr(at, kWidths[i]);
      at += kWidths[i];
      // Fields we do not use may be blank, but a line shifted by a column must not pass.
      if (!trimmed(fields[i]).empty()) {
        lines_.real(fields[i], "column " + std::to_string(at), 0, 1e5);
      }
    }
    return fields;
  }

  void append(int day, const Fields& fields) {
    if (weather_.days_.empty()) weather_.first_day_ = day;
    const int expected = weather_.first_day_ + static_cast<int>(weather_.days_.size());
    if (day != expected) {
      lines_.fail("the day does not follow the one before: " + std::to_string(day - expected) +
                  " days off");
    }
    SpaceWeather::Day out{};
    out.f107_sfu = lines_.real(fields[kObservedFlux], "observed F10.7", 1, kHighestFlux_sfu);
    out.f107a_sfu =
        lines_.real(fields[kObservedMean], "observed 81-day mean of F10.7", 1, kHighestFlux_sfu);
    out.ap_daily = lines_.integer(fields[kMeanAp], "mean ap", 0, 400);
    for (std::size_t k = 0; k < out.ap.size(); ++k) {
      out.ap[k] = lines_.integer(fields[kFirstAp + k], "ap", 0, 400);
    }
    weather_.days_.push_back(out);
  }

  SpaceWeather finish() {
    constexpr int kHistoryDays = 3;
    const int days = static_cast<int>(weather_.days_.size());
    if (days <= kHistoryDays)
      lines_.fail("only " + std::to_string(days) + " days; accepted: 4 or more");
    weather_.source_ = lines_.source();
    weather_.three_hourly_ = true;
    weather_.first_covered_ = weather_.first_day_ + kHistoryDays;
    weather_.last_covered_ = weather_.first_day_ + days - 1;
    return std::move(weather_);
  }

  NumberedLines lines_;
  SpaceWeather weather_;
  bool seen_observed_ = false;
};

// ---- Monthly table

class MonthlyReader {
 public:
  MonthlyReader(std::string_view text, std::string_view source) : lines_(text, kReader, source) {}

  SpaceWeather read() {
    constexpr std::string_view kHeader = "year,month,f107_obs_monthly_mean,ap_monthly_mean";
    const std::optional<std::string_view> header = lines_.next_whole();
    if (!header || *header != kHeader) {
      lines_.fail("the first line is not " + std::string(kHeader));
    }
    while (const std::optional<std::string_view> line = lines_.next_whole())
      append_month(fields_of(*line));
    return finish();
  }

 private:
  static constexpr int kHalfWindow = 40;  // 81 days
  using Fields = std::array<std::string_view, 4>;

  Fields fields_of(std::string_view line) const {
    Fields fields;
    std::string_view rest = line;
    for (std::size_t i = 0; i < fields.size(); ++i) {
      const std::size_t comma = rest.find(',');
      const bool last = i + 1 == fields.size();
      if ((comma == std::string_view::npos) != last) {
        lines_.fail(quoted(line) + " does not have " + std::to_string(fields.size()) + " fields");
      }
      fields[i] = rest.substr(0, comma);
      if (!last) rest.remove_prefix(comma + 1);
    }
    return fields;
  }

  void append_month(const Fields& fields) {
    const int year = lines_.integer(fields[0], "year", kFirstYear, kLastYear);
    const int month = lines_.integer(fields[1], "month", 1, 12);
    const double f107 = lines_.real(fields[2], "F10.7", 1, kHighestFlux_sfu);
    const double ap = lines_.real(fields[3], "Ap", 0, kHighestAp);
    const int first = days_since_1970(lines_, year, month, 1);
    const int next = month == 12 ? days_since_1970(lines_, year + 1, 1, 1)
                                 : days_since_1970(lines_, year, month + 1, 1);
    if (weather_.days_.empty()) weather_.first_day_ = first;
    if (first != weather_.first_day_ + static_cast<int>(weather_.days_.size())) {
      lines_.fail("the month does not follow the one before");
    }
    weather_.days_.insert(weather_.days_.end(), static_cast<std::size_t>(next - first),
                          {f107, 0, ap, {}});
  }

  SpaceWeather finish() {
    const int days = static_cast<int>(weather_.days_.size());
    if (days <= 2 * kHalfWindow) lines_.fail("too short for a mean of 81 days");
    weather_.first_covered_ = weather_.first_day_ + kHalfWindow;
    weather_.last_covered_ = weather_.first_day_ + days - 1 - kHalfWindow;
    for (int i = kHalfWindow; i < days - kHalfWindow; ++i) {
      double sum = 0;
      for (int k = i - kHalfWindow; k <= i + kHalfWindow; ++k) sum += day(k).f107_sfu;
      day(i).f107a_sfu = sum / (2 * kHalfWindow + 1);
    }
    weather_.source_ = lines_.source();
    return std::move(weather_);
  }

  SpaceWeather::Day& day(int index) { return weather_.days_[static_cast<std::size_t>(index)]; }

  NumberedLines lines_;
  SpaceWeather weather_;
};

SpaceWeather SpaceWeather::monthly() {
  return parse_monthly(embedded::space_weather_monthly(),
                       "space_weather_monthly.csv (compiled in)");
}

SpaceWeather SpaceWeather::parse_monthly(std::string_view text, std::string_view source_name) {
  return MonthlyReader(text, source_name).read();
}

SpaceWeather SpaceWeather::load_celestrak(const std::string& path) {
  return parse_celestrak(text::read_file(path, "SpaceWeather::load_celestrak"), path);
}

SpaceWeather SpaceWeather::parse_celestrak(std::string_view text, std::string_view source_name) {
  return CelestrakReader(text, source_name).read();
}

}  // namespace orrery
