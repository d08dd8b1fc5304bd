#include <orrery/models/atmosphere/space_weather.hpp>
#include <orrery/models/data/embedded_tables.hpp>

#include <array>
#include <charconv>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <sstream>
#include <stdexcept>

namespace orrery {
namespace {

// What no index has ever exceeded by far; above, a file is damaged.
constexpr double kHighestFlux_sfu = 2000, kHighestAp = 400;

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kBlanks = " \t";
  const std::size_t first = text.find_first_not_of(kBlanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlanks) - first + 1);
}

/// Text from a file, which may be anything, in a message: printable and short.
std::string quoted(std::string_view text) {
  constexpr std::size_t kLongest = 40;
  std::string out = "'";
  for (const char c : text.substr(0, kLongest)) out += c >= ' ' && c <= '~' ? c : '?';
  return out + (text.size() > kLongest ? "...'" : "'");
}

template <class Number>
std::optional<Number> number_in(std::string_view text) {
  Number value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size()) return {};
  return value;
}

/// Hands out a text line by line and knows which one, for the messages.
class LineReader {
 public:
  LineReader(std::string_view text, std::string_view source) : text_(text), source_(source) {}

  const std::string& source() const { return source_; }

  [[noreturn]] void fail(const std::string& what) const {
    throw std::invalid_argument("SpaceWeather: " + source_ + ", line " + std::to_string(line_) +
                                ": " + what);
  }

  /// Without its end; nothing at the end of the text.
  std::optional<std::string_view> next() {
    if (text_.empty()) return {};
    ++line_;
    const std::size_t end = text_.find('\n');
    // A number cut in the middle still reads as a number: only the line end shows that it is whole.
    if (end == std::string_view::npos) fail("cut short: the last line has no line end");
    std::string_view line = text_.substr(0, end);
    text_.remove_prefix(end + 1);
    if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
    return line;
  }

  double real(std::string_view name, std::string_view field, double low, double high) const {
    const std::string_view text = trimmed(field);
    const std::optional<double> value = number_in<double>(text);
    if (!value || !(*value >= low && *value <= high)) {
      char range[80];
      std::snprintf(range, sizeof range, "; accepted: %g to %g", low, high);
      fail(std::string(name) + " is " + quoted(text) + range);
    }
    return *value;
  }

  int whole(std::string_view name, std::string_view field, int low, int high) const {
    const std::string_view text = trimmed(field);
    const std::optional<int> value = number_in<int>(text);
    if (!value || *value < low || *value > high) {
      fail(std::string(name) + " is " + quoted(text) + "; accepted: a whole number, " +
           std::to_string(low) + " to " + std::to_string(high));
    }
    return *value;
  }

  int days_since_1970(int year, int month, int day) const {
    const std::chrono::year_month_day date{std::chrono::year(year),
                                           std::chrono::month(static_cast<unsigned>(month)),
                                           std::chrono::day(static_cast<unsigned>(day))};
    if (!date.ok()) {
      fail("no such date: " + std::to_string(year) + "-" + std::to_string(month) + "-" +
           std::to_string(day));
    }
    return static_cast<int>(std::chrono::sys_days(date).time_since_epoch().count());
  }

 private:
  std::string_view text_;
  std::string source_;
  std::size_t line_ = 0;
};

constexpr int kFirstYear = 1900, kLastYear = 2200;

}  // namespace

// ---- CelesTrak

/// The layout is fixed columns: FORMAT(I4,I3,I3,I5,I3,8I3,I4,8I4,I4,F4.1,I2,I4,F6.1,I2,5F6.1).
class CelestrakReader {
 public:
  CelestrakReader(std::string_view text, std::string_view source) : lines_(text, source) {}

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
    const std::optional<std::string_view> line = lines_.next();
    if (!line || *line != "DATATYPE CssiSpaceWeather") {
      lines_.fail("not a CelesTrak space-weather file: it starts with DATATYPE CssiSpaceWeather");
    }
  }

  /// The next line that is neither empty nor a comment.
  std::optional<std::string_view> next_keyword() {
    while (const std::optional<std::string_view> line = lines_.next()) {
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
    const int announced = lines_.whole(keyword, head.substr(blank), 1, 1'000'000);
    begin_section(name);
    for (int i = 0; i < announced; ++i) read_row(name, i, announced);
    if (lines_.next() != "END " + name) {
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
    if (lines_.next() != "BEGIN " + name) lines_.fail("BEGIN " + name + " is missing");
  }

  void read_row(const std::string& section, int number, int announced) {
    const std::optional<std::string_view> line = lines_.next();
    if (!line || line->substr(0, 4) == "END ") {
      lines_.fail(section + " ends after " + std::to_string(number) + " of " +
                  std::to_string(announced) + " announced lines");
    }
    const Fields fields = split(*line);
    const int day = lines_.days_since_1970(lines_.whole("year", fields[0], kFirstYear, kLastYear),
                                           lines_.whole("month", fields[1], 1, 12),
                                           lines_.whole("day", fields[2], 1, 31));
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
        lines_.real("column " + std::to_string(at), fields[i], 0, 1e5);
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
    out.f107_sfu = lines_.real("observed F10.7", fields[kObservedFlux], 1, kHighestFlux_sfu);
    out.f107a_sfu =
        lines_.real("observed 81-day mean of F10.7", fields[kObservedMean], 1, kHighestFlux_sfu);
    out.ap_daily = lines_.whole("mean ap", fields[kMeanAp], 0, 400);
    for (std::size_t k = 0; k < out.ap.size(); ++k) {
      out.ap[k] = lines_.whole("ap", fields[kFirstAp + k], 0, 400);
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

  LineReader lines_;
  SpaceWeather weather_;
  bool seen_observed_ = false;
};

// ---- Monthly table

class MonthlyReader {
 public:
  MonthlyReader(std::string_view text, std::string_view source) : lines_(text, source) {}

  SpaceWeather read() {
    constexpr std::string_view kHeader = "year,month,f107_obs_monthly_mean,ap_monthly_mean";
    const std::optional<std::string_view> header = lines_.next();
    if (!header || *header != kHeader) {
      lines_.fail("the first line is not " + std::string(kHeader));
    }
    while (const std::optional<std::string_view> line = lines_.next())
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
    const int year = lines_.whole("year", fields[0], kFirstYear, kLastYear);
    const int month = lines_.whole("month", fields[1], 1, 12);
    const double f107 = lines_.real("F10.7", fields[2], 1, kHighestFlux_sfu);
    const double ap = lines_.real("Ap", fields[3], 0, kHighestAp);
    const int first = lines_.days_since_1970(year, month, 1);
    const int next = month == 12 ? lines_.days_since_1970(year + 1, 1, 1)
                                 : lines_.days_since_1970(year, month + 1, 1);
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

  LineReader lines_;
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
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();  // unlike an iterator it does not throw where the path is a folder's
  if (!file.is_open() || text.bad() || text.str().empty()) {
    throw std::invalid_argument("SpaceWeather::load_celestrak: cannot read '" + path + "'");
  }
  return parse_celestrak(text.str(), path);
}

SpaceWeather SpaceWeather::parse_celestrak(std::string_view text, std::string_view source_name) {
  return CelestrakReader(text, source_name).read();
}

}  // namespace orrery
