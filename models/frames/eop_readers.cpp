#include <orrery/models/frames/eop_readers.hpp>
#include <orrery/models/text/numbered_lines.hpp>

#include <erfa.h>

#include <chrono>

namespace orrery::eop {

using text::NumberedLines;
using text::quoted;
using text::trimmed;
using text::words_of;

namespace {

constexpr const char* kReader = "EarthOrientationTable";
constexpr int kMjd1962 = 37665;  // the IERS C04 series begins

// Limits of what can be right: the pole wanders within 0.6", UT1-UTC is kept within 0.9 s, days
// have differed by at most 5 ms, corrections to the nutation models by 0.2".
constexpr double kPoleLimit_arcsec = 2;
constexpr double kUt1Limit_s = 1;
constexpr double kLengthOfDayLimit_s = 0.05;
constexpr double kOffsetLimit_arcsec = 1;

std::chrono::year_month_day date_of(int mjd) {
  return std::chrono::sys_days(std::chrono::days(mjd - kMjd1970));
}

std::string date_text(int mjd) {
  const auto date = date_of(mjd);
  return std::to_string(static_cast<int>(date.year())) + "-" +
         std::to_string(static_cast<unsigned>(date.month())) + "-" +
         std::to_string(static_cast<unsigned>(date.day()));
}

// `last` is 0 for the first row.
void require_next_day(const NumberedLines& lines, int last, int mjd) {
  if (last == 0 || mjd == last + 1) return;
  lines.fail("MJD " + std::to_string(mjd) + " (" + date_text(mjd) + ") follows MJD " +
             std::to_string(last) + " (" + date_text(last) +
             "); rows must be one day apart, in order");
}

void require_date(const NumberedLines& lines, int mjd, int year, int month, int day, int century) {
  const auto date = date_of(mjd);
  if (static_cast<int>(date.year()) % century == year % century &&
      static_cast<unsigned>(date.month()) == static_cast<unsigned>(month) &&
      static_cast<unsigned>(date.day()) == static_cast<unsigned>(day))
    return;
  lines.fail("the date " + std::to_string(year) + " " + std::to_string(month) + " " +
             std::to_string(day) + " is not that of MJD " + std::to_string(mjd) + ", " +
             date_text(mjd));
}

// Columns `first` to `last` of a line, counted from 1 as the format description does.
std::string_view columns(std::string_view line, std::size_t first, std::size_t last) {
  if (line.size() < first) return {};
  return line.substr(first - 1, last - first + 1);
}

std::optional<double> optional_real(const NumberedLines& lines, std::string_view field,
                                    const char* name, double limit, double unit) {
  if (trimmed(field).empty()) return {};
  return unit * lines.real(field, name, limit / unit);
}

// https://maia.usno.navy.mil/ser7/readme.finals2000A: fixed columns, milliseconds and
// milliarcseconds for length of day and pole offsets.
Row finals_row(const NumberedLines& lines, std::string_view line, int mjd) {
  Row row;
  row.mjd = mjd;
  const std::string_view pole_flag = columns(line, 17, 17), ut1_flag = columns(line, 58, 58);
  for (const std::string_view flag : {pole_flag, ut1_flag}) {
    if (flag != "I" && flag != "P")
      lines.fail("the flag of the pole or of UT1-UTC is " + quoted(flag) +
                 "; accepted: I (observed) or P (predicted)");
  }
  row.predicted = pole_flag == "P" || ut1_flag == "P";
  row.x_pole_arcsec = lines.real(columns(line, 19, 27), "x of the pole [\"]", kPoleLimit_arcsec);
  row.y_pole_arcsec = lines.real(columns(line, 38, 46), "y of the pole [\"]", kPoleLimit_arcsec);
  row.ut1_minus_utc_s = lines.real(columns(line, 59, 68), "UT1-UTC [s]", kUt1Limit_s);
  row.length_of_day_s =
      optional_real(lines, columns(line, 80, 86), "length of day [ms]", kLengthOfDayLimit_s, 1e-3);
  row.first_offset_arcsec =
      optional_real(lines, columns(line, 98, 106), "dX [mas]", kOffsetLimit_arcsec, 1e-3);
  row.second_offset_arcsec =
      optional_real(lines, columns(line, 117, 125), "dY [mas]", kOffsetLimit_arcsec, 1e-3);
  if (row.first_offset_arcsec.has_value() != row.second_offset_arcsec.has_value())
    lines.fail("one of dX and dY is missing");
  return row;
}

int finals_mjd(const NumberedLines& lines, std::string_view line) {
  // "41684.00": a day as a real number.
  const std::string_view field = trimmed(columns(line, 8, 15));
  if (!field.ends_with(".00")) lines.fail("MJD is " + quoted(field) + "; accepted: like 41684.00");
  const int mjd = lines.integer(field.substr(0, field.size() - 3), "MJD", kMjd1962, kMjd2200);
  const int year = lines.integer(columns(line, 1, 2), "year", 0, 99);
  const int month = lines.integer(columns(line, 3, 4), "month", 1, 12);
  const int day = lines.integer(columns(line, 5, 6), "day", 1, 31);
  require_date(lines, mjd, year, month, day, 100);
  return mjd;
}

Row celestrak_row(const NumberedLines& lines, std::string_view line) {
  const std::vector<std::string_view> word = words_of(line);
  if (word.size() != 13)
    lines.fail(
        std::to_string(word.size()) +
        " columns; accepted: 13, year month day MJD x y UT1-UTC LOD dPsi dEps dX dY TAI-UTC");
  Row row;
  row.mjd = lines.integer(word[3], "MJD", kMjd1962, kMjd2200);
  const int year = lines.integer(word[0], "year", 1962, 2200);
  const int month = lines.integer(word[1], "month", 1, 12);
  const int day = lines.integer(word[2], "day", 1, 31);
  require_date(lines, row.mjd, year, month, day, 10000);
  row.x_pole_arcsec = lines.real(word[4], "x of the pole [\"]", kPoleLimit_arcsec);
  row.y_pole_arcsec = lines.real(word[5], "y of the pole [\"]", kPoleLimit_arcsec);
  row.ut1_minus_utc_s = lines.real(word[6], "UT1-UTC [s]", kUt1Limit_s);
  row.length_of_day_s = lines.real(word[7], "length of day [s]", kLengthOfDayLimit_s);
  row.first_offset_arcsec = lines.real(word[8], "dPsi [\"]", kOffsetLimit_arcsec);
  row.second_offset_arcsec = lines.real(word[9], "dEps [\"]", kOffsetLimit_arcsec);
  lines.real(word[10], "dX [\"]", kOffsetLimit_arcsec);
  lines.real(word[11], "dY [\"]", kOffsetLimit_arcsec);
  const int tai_minus_utc = lines.integer(word[12], "TAI-UTC [s]", 0, 1000);
  if (row.mjd >= kMjd1972 && tai_minus_utc != tai_minus_utc_s(row.mjd))
    lines.fail("TAI-UTC is " + std::to_string(tai_minus_utc) +
               " s; ERFA's table of leap seconds has " + std::to_string(tai_minus_utc_s(row.mjd)) +
               " s for " + date_text(row.mjd));
  return row;
}

/// CelesTrak's file: two blocks of rows with their counts.
class CelestrakReader {
 public:
  CelestrakReader(std::string_view text, std::string_view source) : lines_(text, kReader, source) {}

  File read() {
    while (const auto line = lines_.next()) read_line(*line);
    if (in_block_) lines_.fail("cut short: END " + block_ + " is missing");
    if (file_.rows.empty()) lines_.fail("cut short: no row was found");
    return std::move(file_);
  }

 private:
  void read_line(std::string_view line) {
    const std::vector<std::string_view> word = words_of(line);
    if (word.empty() || word[0].starts_with('#')) return;
    if (word[0] == "VERSION" || word[0] == "UPDATED") return;
    if (word[0].starts_with("NUM_") && word.size() == 2) {
      announced_ = lines_.integer(word[1], "number of points", 0, kMjd2200);
    } else if (word[0] == "BEGIN" && word.size() == 2) {
      begin_block(word[1]);
    } else if (word[0] == "END" && word.size() == 2) {
      end_block(word[1]);
    } else if (in_block_) {
      add_row(line);
    } else {
      lines_.fail(quoted(line) + " is neither a row nor a keyword of this format");
    }
  }

  void begin_block(std::string_view name) {
    if (in_block_) lines_.fail("BEGIN " + std::string(name) + " before END " + block_);
    if (name != "OBSERVED" && name != "PREDICTED")
      lines_.fail("BEGIN " + quoted(name) + "; accepted: OBSERVED, PREDICTED");
    in_block_ = true;
    block_ = name;
    rows_before_ = file_.rows.size();
  }

  void end_block(std::string_view name) {
    if (!in_block_ || name != block_) lines_.fail("END " + quoted(name) + " without its BEGIN");
    const std::size_t count = file_.rows.size() - rows_before_;
    if (announced_ < 0 || count != static_cast<std::size_t>(announced_))
      lines_.fail(block_ + " has " + std::to_string(count) + " rows; announced were " +
                  (announced_ < 0 ? "none" : std::to_string(announced_)));
    in_block_ = false;
    announced_ = -1;
  }

  void add_row(std::string_view line) {
    Row row = celestrak_row(lines_, line);
    row.predicted = block_ == "PREDICTED";
    require_next_day(lines_, file_.rows.empty() ? 0 : file_.rows.back().mjd, row.mjd);
    file_.rows.push_back(row);
  }

  NumberedLines lines_;
  File file_;
  std::string block_;
  bool in_block_ = false;
  int announced_ = -1;
  std::size_t rows_before_ = 0;
};

}  // namespace

int tai_minus_utc_s(int mjd) {
  const auto date = date_of(mjd);
  double delta_s = 0;
  // Status 1 says that leap seconds may have been announced since ERFA's release.
  eraDat(static_cast<int>(date.year()), static_cast<int>(static_cast<unsigned>(date.month())),
         static_cast<int>(static_cast<unsigned>(date.day())), 0.0, &delta_s);
  return static_cast<int>(delta_s);
}

File read_finals2000a(std::string_view text, std::string_view source) {
  NumberedLines lines(text, kReader, source);
  File file;
  file.offsets = PoleOffsets::kIau2000A;
  int last = 0;
  bool ended = false;  // the last days of the file carry dates alone
  while (const auto line = lines.next()) {
    if (!lines.line_had_end()) lines.fail("cut short: the last line has no line end");
    const int mjd = finals_mjd(lines, *line);
    require_next_day(lines, last, mjd);
    last = mjd;
    const bool date_alone = trimmed(columns(*line, 16, line->size())).empty();
    if (ended && !date_alone) lines.fail("a row with data follows rows without");
    ended = date_alone;
    if (!ended) file.rows.push_back(finals_row(lines, *line, mjd));
  }
  if (file.rows.empty()) lines.fail("cut short: no row was found");
  return file;
}

File read_celestrak(std::string_view text, std::string_view source) {
  return CelestrakReader(text, source).read();
}

}  // namespace orrery::eop
