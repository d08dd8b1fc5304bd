#include <orrery/harness/kernel/text.hpp>
#include <orrery/models/frames/eop_leap_seconds.hpp>
#include <orrery/models/frames/eop_readers.hpp>
#include <orrery/models/text/numbered_lines.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <stdexcept>

namespace orrery {
namespace {

constexpr std::string_view kMonths = "JANFEBMARAPRMAYJUNJULAUGSEPOCTNOVDEC";
constexpr double kMjdOrigin_JD = 2400000.5;

int month_of(const text::NumberedLines& lines, std::string_view name) {
  const std::size_t at = name.size() == 3 ? kMonths.find(name) : std::string_view::npos;
  if (at == std::string_view::npos || at % 3 != 0)
    lines.fail("month is " + text::quoted(name) + "; accepted: JAN to DEC");
  return static_cast<int>(at / 3) + 1;
}

int mjd_of(const text::NumberedLines& lines, int year, int month, int day) {
  const std::chrono::year_month_day date{std::chrono::year(year),
                                         std::chrono::month(static_cast<unsigned>(month)),
                                         std::chrono::day(static_cast<unsigned>(day))};
  if (!date.ok()) lines.fail("day " + std::to_string(day) + " is not of that month");
  return static_cast<int>(std::chrono::sys_days(date).time_since_epoch().count()) + eop::kMjd1970;
}

}  // namespace

LeapSecondTable LeapSecondTable::parse(std::string_view text, std::string_view source_name) {
  text::NumberedLines lines(text, "LeapSecondTable", source_name);
  LeapSecondTable table;
  while (const auto line = lines.next()) {
    std::string spaced(text::trimmed(*line));
    if (spaced.empty()) continue;
    // 1972 JAN  1 =JD 2441317.5  TAI-UTC=  10.0       S + (MJD - 41317.) X 0.0      S
    if (spaced.ends_with('S')) spaced.insert(spaced.size() - 1, " ");  // it may touch its number
    const std::vector<std::string_view> word = text::words_of(spaced);
    if (word.size() != 15 || word[3] != "=JD" || word[5] != "TAI-UTC=" || word[7] != "S" ||
        word[8] != "+" || word[9] != "(MJD" || word[10] != "-" || !word[11].ends_with(".)") ||
        word[12] != "X" || word[14] != "S")
      lines.fail(text::quoted(*line) + " is not a row of tai-utc.dat");

    Row row;
    const int year = lines.integer(word[0], "year", 1961, 2200);
    row.mjd = mjd_of(lines, year, month_of(lines, word[1]), lines.integer(word[2], "day", 1, 31));
    if (lines.real(word[4], "Julian date", 1e7) != row.mjd + kMjdOrigin_JD)
      lines.fail("Julian date " + text::quoted(word[4]) + " is not that of the day");
    row.offset_s = lines.real(word[6], "TAI-UTC [s]", 1000);
    row.drift_origin_mjd = lines.real(word[11].substr(0, word[11].size() - 1), "MJD", 1e6);
    row.drift_s_per_day = lines.real(word[13], "drift [s/day]", 0.01);
    if (!table.rows_.empty() && row.mjd <= table.rows_.back().mjd)
      lines.fail("not after the row before");
    table.rows_.push_back(row);
  }
  if (table.rows_.empty()) lines.fail("cut short: no row was found");
  return table;
}

LeapSecondTable LeapSecondTable::load(const std::string& path) {
  return parse(text::read_file(path, "LeapSecondTable::load"), path);
}

double LeapSecondTable::tai_minus_utc_s(double mjd) const {
  if (!(mjd >= rows_.front().mjd) || !std::isfinite(mjd))
    throw std::out_of_range("LeapSecondTable::tai_minus_utc_s: mjd = " + to_text(mjd) +
                            "; accepted: from " + std::to_string(rows_.front().mjd) + " on");
  const auto after = std::upper_bound(rows_.begin(), rows_.end(), mjd,
                                      [](double day, const Row& row) { return day < row.mjd; });
  const Row& row = *(after - 1);
  return row.offset_s + (mjd - row.drift_origin_mjd) * row.drift_s_per_day;
}

std::vector<int> LeapSecondTable::steps_mjd() const {
  std::vector<int> days;
  for (const Row& row : rows_) days.push_back(row.mjd);
  return days;
}

}  // namespace orrery
