#include <orrery/models/data/embedded_tables.hpp>
#include <orrery/models/gnss/almanac.hpp>
#include <orrery/models/text/numbered_lines.hpp>

#include <array>
#include <cctype>
#include <numbers>

namespace orrery {
namespace {

using text::NumberedLines;
using text::quoted;
using text::trimmed;
using text::words_of;

constexpr const char* kReader = "GpsAlmanac";
constexpr double kPi = std::numbers::pi;
constexpr double kSecondsOfWeek = 604800;

/// A field of the entry by its number in the files, with what it may hold.
struct Field {
  const char* name;
  double GpsAlmanacEntry::*member;
  double low, high;
};

constexpr double kTurn = 2 * kPi + 1e-6;
constexpr Field kEccentricity{"eccentricity", &GpsAlmanacEntry::eccentricity, 0, 0.1};
constexpr Field kToa{"time of applicability", &GpsAlmanacEntry::toa_s, 0, kSecondsOfWeek};
constexpr Field kInclination{"inclination", &GpsAlmanacEntry::inclination_rad, 0.1, 2};
constexpr Field kRaanRate{"rate of right ascension", &GpsAlmanacEntry::raan_rate_radps, -1e-7,
                          1e-7};
// 22500 to 30000 km: a GPS satellite, also while it is moved.
constexpr Field kSqrtA{"square root of the semi-major axis", &GpsAlmanacEntry::sqrt_a_sqrtm, 4743,
                       5478};
constexpr Field kRaan{"right ascension", &GpsAlmanacEntry::raan0_rad, -kTurn, kTurn};
constexpr Field kPerigee{"argument of perigee", &GpsAlmanacEntry::argument_of_perigee_rad, -kTurn,
                         kTurn};
constexpr Field kAnomaly{"mean anomaly", &GpsAlmanacEntry::mean_anomaly_rad, -kTurn, kTurn};
constexpr Field kAf0{"af0", &GpsAlmanacEntry::af0_s, -9e-4, 9e-4};
constexpr Field kAf1{"af1", &GpsAlmanacEntry::af1_sps, -3.7e-9, 3.7e-9};

void require_in_range(const NumberedLines& lines, const Field& field, double value) {
  if (value >= field.low && value <= field.high) return;
  lines.fail(std::string(field.name) + " = " + std::to_string(value) +
             "; accepted: " + std::to_string(field.low) + " to " + std::to_string(field.high));
}

void set(const NumberedLines& lines, const Field& field, std::string_view text,
         GpsAlmanacEntry& entry, double unit = 1, double offset = 0) {
  const double value = offset + unit * lines.real(text, field.name, 1e9);
  require_in_range(lines, field, value);
  entry.*field.member = value;
}

void append(const NumberedLines& lines, const GpsAlmanacEntry& entry, GpsAlmanac& almanac) {
  for (const GpsAlmanacEntry& other : almanac) {
    if (other.prn == entry.prn) lines.fail("PRN " + std::to_string(entry.prn) + " comes twice");
  }
  almanac.push_back(entry);
}

GpsAlmanac complete(const NumberedLines& lines, GpsAlmanac almanac) {
  if (almanac.empty()) lines.fail("no satellite in the file");
  return almanac;
}

int prn_in(const NumberedLines& lines, std::string_view text) {
  return lines.integer(text, "PRN", 1, 32);
}
int week_in(const NumberedLines& lines, std::string_view text) {
  return lines.integer(text, "week", 0, 8191);
}
int health_in(const NumberedLines& lines, std::string_view text) {
  return lines.integer(text, "health", 0, 255);
}

// ---- The carried table

std::vector<std::string_view> split_at_commas(std::string_view line) {
  std::vector<std::string_view> fields;
  while (true) {
    const std::size_t comma = line.find(',');
    fields.push_back(line.substr(0, comma));
    if (comma == std::string_view::npos) return fields;
    line.remove_prefix(comma + 1);
  }
}

// ---- YUMA

/// The label before the colon, without what stands in brackets, and the value after it.
struct Labelled {
  std::string label;
  std::string_view value;
};

Labelled labelled(const NumberedLines& lines, std::string_view line) {
  const std::size_t colon = line.find(':');
  if (colon == std::string_view::npos) lines.fail(quoted(line) + " has no colon");
  Labelled out{{}, trimmed(line.substr(colon + 1))};
  for (const char c : trimmed(line.substr(0, colon))) {
    if (c == '(') break;
    if (c != ' ') out.label += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  }
  return out;
}

struct YumaField {
  const char* label;  // its beginning: files differ in what follows
  Field field;
};

constexpr std::array<YumaField, 10> kYumaFields{{{"eccentricity", kEccentricity},
                                                 {"timeofapplicability", kToa},
                                                 {"orbitalinclination", kInclination},
                                                 {"rateofrightascen", kRaanRate},
                                                 {"sqrt", kSqrtA},
                                                 {"rightascenatweek", kRaan},
                                                 {"argumentofperigee", kPerigee},
                                                 {"meananom", kAnomaly},
                                                 {"af0", kAf0},
                                                 {"af1", kAf1}}};

GpsAlmanacEntry yuma_record(NumberedLines& lines, std::string_view title) {
  GpsAlmanacEntry entry;
  const auto next = [&lines](const char* label) {
    const auto line = lines.next();
    if (!line) lines.fail(std::string("cut short: '") + label + "' is missing");
    const Labelled field = labelled(lines, *line);
    if (!field.label.starts_with(label)) {
      lines.fail(quoted(*line) + "; expected the field '" + label + "'");
    }
    return field.value;
  };
  entry.prn = prn_in(lines, next("id"));
  entry.health = health_in(lines, next("health"));
  for (const YumaField& field : kYumaFields) set(lines, field.field, next(field.label), entry);
  entry.week = week_in(lines, next("week"));
  // Published files end without a line end: then the title must say the same week.
  if (!lines.line_had_end() &&
      title.find(" " + std::to_string(entry.week) + " ") == std::string_view::npos) {
    lines.fail("cut short: the last line has no line end and its week is not the title's");
  }
  return entry;
}

// ---- SEM

std::vector<std::string_view> sem_line(NumberedLines& lines, std::size_t words, const char* what) {
  while (const auto line = lines.next()) {
    if (trimmed(*line).empty()) continue;
    std::vector<std::string_view> found = words_of(*line);
    if (found.size() < words) {
      lines.fail(quoted(*line) + " has " + std::to_string(found.size()) + " fields; expected " +
                 what);
    }
    return found;
  }
  lines.fail(std::string("cut short: expected ") + what);
}

GpsAlmanacEntry sem_record(NumberedLines& lines, int week, double toa_s) {
  GpsAlmanacEntry entry;
  entry.week = week;
  entry.toa_s = toa_s;
  entry.prn = prn_in(lines, sem_line(lines, 1, "the PRN")[0]);
  sem_line(lines, 1, "the SVN");
  sem_line(lines, 1, "the URA");
  const auto orbit = sem_line(lines, 3, "eccentricity, inclination offset, rate of the node");
  set(lines, kEccentricity, orbit[0], entry);
  set(lines, kInclination, orbit[1], entry, kPi, 0.3 * kPi);
  set(lines, kRaanRate, orbit[2], entry, kPi);
  const auto axes = sem_line(lines, 3, "square root of a, node, argument of perigee");
  set(lines, kSqrtA, axes[0], entry);
  set(lines, kRaan, axes[1], entry, kPi);
  set(lines, kPerigee, axes[2], entry, kPi);
  const auto clock = sem_line(lines, 3, "mean anomaly, af0, af1");
  set(lines, kAnomaly, clock[0], entry, kPi);
  set(lines, kAf0, clock[1], entry);
  set(lines, kAf1, clock[2], entry);
  entry.health = health_in(lines, sem_line(lines, 1, "the health")[0]);
  sem_line(lines, 1, "the configuration");
  return entry;
}

}  // namespace

GpsAlmanac carried_almanac() {
  return parse_almanac_table(embedded::gps_almanac_2016_week1890(),
                             "gps_almanac_2016_week1890.csv (compiled in)");
}

GpsAlmanac parse_almanac_table(std::string_view text, std::string_view source_name) {
  constexpr std::string_view kHeader =
      "prn,health,eccentricity,toa_s,inclination_rad,raan_rate_radps,sqrt_a_m05,raan_rad,"
      "arg_perigee_rad,mean_anomaly_rad,af0_s,af1_sps,week";
  constexpr std::array<Field, 10> kColumns{kEccentricity, kToa,     kInclination, kRaanRate, kSqrtA,
                                           kRaan,         kPerigee, kAnomaly,     kAf0,      kAf1};
  NumberedLines lines(text, kReader, source_name);
  const auto header = lines.next();
  if (!header || *header != kHeader) lines.fail("the first line is not " + std::string(kHeader));
  GpsAlmanac almanac;
  while (const auto line = lines.next()) {
    const std::vector<std::string_view> fields = split_at_commas(*line);
    if (fields.size() != 13 || !lines.line_had_end()) {
      lines.fail(quoted(*line) + " is not a whole line of 13 fields");
    }
    GpsAlmanacEntry entry;
    entry.prn = prn_in(lines, fields[0]);
    entry.health = health_in(lines, fields[1]);
    for (std::size_t i = 0; i < kColumns.size(); ++i) {
      set(lines, kColumns[i], fields[i + 2], entry);
    }
    entry.week = week_in(lines, fields[12]);
    append(lines, entry, almanac);
  }
  return complete(lines, std::move(almanac));
}

GpsAlmanac parse_yuma(std::string_view text, std::string_view source_name) {
  NumberedLines lines(text, kReader, source_name);
  GpsAlmanac almanac;
  while (const auto line = lines.next()) {
    if (trimmed(*line).empty()) continue;
    if (!line->starts_with("****")) lines.fail(quoted(*line) + "; expected a line of asterisks");
    append(lines, yuma_record(lines, *line), almanac);
  }
  return complete(lines, std::move(almanac));
}

GpsAlmanac parse_sem(std::string_view text, std::string_view source_name) {
  NumberedLines lines(text, kReader, source_name);
  const int records =
      lines.integer(sem_line(lines, 1, "the number of records")[0], "number of records", 1, 32);
  const auto time = sem_line(lines, 2, "week and time of applicability");
  const int week = week_in(lines, time[0]);
  const double toa_s = lines.real(time[1], kToa.name, 1e9);
  require_in_range(lines, kToa, toa_s);
  GpsAlmanac almanac;
  for (int i = 0; i < records; ++i) append(lines, sem_record(lines, week, toa_s), almanac);
  while (const auto line = lines.next()) {
    if (!trimmed(*line).empty()) {
      lines.fail(quoted(*line) + " after the last of " + std::to_string(records) + " records");
    }
  }
  return almanac;
}

GpsAlmanac load_almanac(const std::string& path) {
  const std::string text = text::read_file(path, kReader);
  return text.starts_with("***") ? parse_yuma(text, path) : parse_sem(text, path);
}

}  // namespace orrery
