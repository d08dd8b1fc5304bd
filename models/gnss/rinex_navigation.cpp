#include <orrery/models/gnss/gps_constants.hpp>
#include <orrery/models/gnss/rinex_navigation.hpp>
#include <orrery/models/text/numbered_lines.hpp>

#include <algorithm>
#include <cmath>
#include <iterator>

namespace orrery {
namespace {

using text::NumberedLines;
using text::quoted;
using text::trimmed;

constexpr const char* kReader = "RinexNavigation";
constexpr std::size_t kNumberWidth = 19;

std::string_view columns(std::string_view line, std::size_t from, std::size_t width) {
  return from < line.size() ? line.substr(from, width) : std::string_view();
}

/// Fortran writes 0.1D+01; a field that is left blank reads as 0.
double fortran(const NumberedLines& lines, std::string_view field, const char* name, double limit) {
  const std::string_view text = trimmed(field);
  if (text.empty()) return 0;
  std::string number(text);
  std::replace_if(
      number.begin(), number.end(), [](char c) { return c == 'D' || c == 'd'; }, 'e');
  return lines.real(number, name, limit);
}

/// Reads the header and then record by record.
class NavigationReader {
 public:
  NavigationReader(std::string_view text, std::string_view source)
      : lines_(text, kReader, source) {}

  RinexNavigation read() {
    read_header();
    std::optional<std::string_view> line = next();
    while (line) {
      if (is_gps(*line)) {
        out_.ephemerides.push_back(record(*line));
        line = next();
      } else {
        line = pass_over();
      }
    }
    return std::move(out_);
  }

 private:
  std::optional<std::string_view> next() {
    const auto line = lines_.next();
    if (line && !lines_.line_had_end()) lines_.fail("cut short: the last line has no line end");
    return line && trimmed(*line).empty() ? next_filled() : line;
  }
  std::optional<std::string_view> next_filled() {
    while (const auto line = lines_.next()) {
      if (!trimmed(*line).empty()) lines_.fail(quoted(*line) + " after a blank line");
    }
    return {};
  }

  void read_header() {
    const auto first = lines_.next();
    if (!first || trimmed(columns(*first, 60, 20)) != "RINEX VERSION / TYPE") {
      lines_.fail("the first line is not a RINEX header's");
    }
    const double version = lines_.real(columns(*first, 0, 9), "version", 10);
    const bool two = version >= 2 && version < 3, three = version >= 3 && version < 4;
    if (!two && !three)
      lines_.fail("version " + quoted(columns(*first, 0, 9)) + "; accepted: 2 and 3");
    three_ = three;
    if (columns(*first, 20, 1) != "N") {
      lines_.fail("file type " + quoted(columns(*first, 20, 1)) + "; accepted: N (navigation)");
    }
    while (true) {
      const auto line = lines_.next();
      if (!line) lines_.fail("cut short: no END OF HEADER");
      const std::string_view label = trimmed(columns(*line, 60, 20));
      if (label == "END OF HEADER") return;
      header_line(*line, label);
    }
  }

  void header_line(std::string_view line, std::string_view label) {
    if (label == "ION ALPHA") coefficients(line, 2, alpha_);
    if (label == "ION BETA") coefficients(line, 2, beta_);
    if (label == "IONOSPHERIC CORR" && line.starts_with("GPSA")) coefficients(line, 5, alpha_);
    if (label == "IONOSPHERIC CORR" && line.starts_with("GPSB")) coefficients(line, 5, beta_);
    if (alpha_ && beta_) out_.ionosphere = {*alpha_, *beta_};
    if (label == "LEAP SECONDS") {
      out_.leap_seconds = lines_.integer(columns(line, 0, 6), "leap seconds", 0, 99);
    }
  }

  void coefficients(std::string_view line, std::size_t from,
                    std::optional<std::array<double, 4>>& out) {
    out.emplace();
    for (std::size_t i = 0; i < 4; ++i) {
      (*out)[i] = fortran(lines_, columns(line, from + 12 * i, 12), "ionosphere", 1e9);
    }
  }

  bool is_gps(std::string_view line) const {
    if (!three_) return true;
    const char system = line[0];
    if (system == ' ' || system < 'A' || system > 'Z') {
      lines_.fail(quoted(line) + "; expected the first line of a record");
    }
    return system == 'G';
  }

  /// To the next line that opens a record.
  std::optional<std::string_view> pass_over() {
    auto line = next();
    while (line && line->starts_with(" ")) line = next();
    return line;
  }

  double number(std::string_view line, std::size_t index, const char* name, double limit) const {
    const std::size_t from = (three_ ? 4 : 3) + index * kNumberWidth;
    return fortran(lines_, columns(line, from, kNumberWidth), name, limit);
  }
  int whole(double value, const char* name, int low, int high) const {
    const double rounded = std::round(value);
    if (std::abs(value - rounded) > 1e-6 || rounded < low || rounded > high) {
      lines_.fail(std::string(name) + " = " + std::to_string(value) +
                  "; accepted: " + std::to_string(low) + " to " + std::to_string(high));
    }
    return static_cast<int>(rounded);
  }
  double within(double value, const char* name, double low, double high) const {
    if (value >= low && value <= high) return value;
    lines_.fail(std::string(name) + " = " + std::to_string(value) +
                "; accepted: " + std::to_string(low) + " to " + std::to_string(high));
  }

  SimTime clock_time(std::string_view line) const {
    const std::size_t at = three_ ? 4 : 3;
    int year = lines_.integer(columns(line, at, three_ ? 4 : 2), "year", 0, 2200);
    if (!three_) year += year < 80 ? 2000 : 1900;
    const std::size_t rest = at + (three_ ? 4 : 2);
    const auto part = [&](std::size_t i, const char* name, int low, int high) {
      return lines_.integer(columns(line, rest + 3 * i, 3), name, low, high);
    };
    const int month = part(0, "month", 1, 12), day = part(1, "day", 1, 31);
    const int hour = part(2, "hour", 0, 23), minute = part(3, "minute", 0, 59);
    const double second = within(
        lines_.real(columns(line, rest + 12, three_ ? 3 : 5), "second", 60), "second", 0, 59.999);
    try {
      return gps_midnight(year, month, day) + hour * 1h + minute * 1min + from_seconds(second);
    } catch (const std::invalid_argument& error) {
      lines_.fail(error.what());
    }
  }

  BroadcastEphemeris record(std::string_view first) {
    BroadcastEphemeris e;
    e.prn = lines_.integer(columns(first, three_ ? 1 : 0, 2), "PRN", 1, 32);
    const SimTime toc = clock_time(first);
    const std::size_t at = three_ ? 23 : 22;
    const auto clock = [&](std::size_t i, const char* name, double limit) {
      return fortran(lines_, columns(first, at + i * kNumberWidth, kNumberWidth), name, limit);
    };
    e.af0_s = clock(0, "af0", 1e-3);
    e.af1_sps = clock(1, "af1", 1e-8);
    e.af2_sps2 = clock(2, "af2", 1e-14);
    read_orbit(e);
    // toc as counted from the start of toe's week: the two may lie on either side of its end.
    e.toc_s = to_seconds(toc - gps::from_week(e.week, 0));
    within(e.toc_s - e.toe_s, "toc - toe", -86400, 86400);
    return e;
  }

  std::string_view orbit_line() {
    const auto line = next();
    if (!line) lines_.fail("cut short: a record has 8 lines");
    if (!line->starts_with(" ")) lines_.fail("cut short: " + quoted(*line) + " opens a new record");
    return *line;
  }

  void read_orbit(BroadcastEphemeris& e) {
    constexpr double kAngle = 6.3;
    std::string_view line = orbit_line();
    const int iode = whole(number(line, 0, "IODE", 1e6), "IODE", 0, 255);
    e.crs_m = number(line, 1, "Crs", 1100);
    e.delta_n_radps = number(line, 2, "delta n", 1.2e-8);
    e.mean_anomaly_rad = number(line, 3, "M0", kAngle);
    line = orbit_line();
    e.cuc_rad = number(line, 0, "Cuc", 1e-4);
    e.eccentricity = within(number(line, 1, "eccentricity", 1), "eccentricity", 0, 0.1);
    e.cus_rad = number(line, 2, "Cus", 1e-4);
    e.sqrt_a_sqrtm = within(number(line, 3, "sqrt(A)", 1e9), "sqrt(A)", 4743, 5478);
    line = orbit_line();
    e.toe_s = whole(number(line, 0, "toe", 1e9), "toe", 0, 604799);
    e.cic_rad = number(line, 1, "Cic", 1e-4);
    e.raan0_rad = number(line, 2, "Omega0", kAngle);
    e.cis_rad = number(line, 3, "Cis", 1e-4);
    line = orbit_line();
    e.i0_rad = number(line, 0, "i0", kAngle);
    e.crc_m = number(line, 1, "Crc", 1100);
    e.argument_of_perigee_rad = number(line, 2, "omega", kAngle);
    e.raan_rate_radps = number(line, 3, "OmegaDot", 1e-7);
    line = orbit_line();
    e.i_rate_radps = number(line, 0, "IDOT", 1e-8);
    e.l2_codes = whole(number(line, 1, "codes on L2", 1e6), "codes on L2", 0, 3);
    e.week = whole(number(line, 2, "week", 1e6), "week", 0, 11000);
    e.l2p_data_off = whole(number(line, 3, "L2 P data flag", 1e6), "L2 P data flag", 0, 1) != 0;
    line = orbit_line();
    e.ura_index = ura_index(within(number(line, 0, "accuracy", 1e9), "accuracy", 0, 1e5));
    e.health = whole(number(line, 1, "health", 1e6), "health", 0, 63);
    e.tgd_s = number(line, 2, "TGD", 1e-6);
    e.iodc = whole(number(line, 3, "IODC", 1e6), "IODC", 0, 1023);
    e.iode = iode;
    line = orbit_line();
    const double fit_h = within(number(line, 1, "fit interval", 1e3), "fit interval", 0, 200);
    e.fit_interval_above_4h = fit_h > 4;
  }

  /// IS-GPS-200, 20.3.3.3.1.3: an index holds up to its limit. Files give limits or nominal values.
  static int ura_index(double accuracy_m) {
    constexpr double kLimits_m[] = {2.4, 3.4, 4.85, 6.85, 9.65, 13.65, 24,  48,
                                    96,  192, 384,  768,  1536, 3072,  6144};
    const auto* end = std::end(kLimits_m);
    return static_cast<int>(std::lower_bound(std::begin(kLimits_m), end, accuracy_m) -
                            std::begin(kLimits_m));
  }

  NumberedLines lines_;
  bool three_ = false;
  std::optional<std::array<double, 4>> alpha_, beta_;
  RinexNavigation out_;
};

}  // namespace

RinexNavigation RinexNavigation::parse(std::string_view text, std::string_view source_name) {
  return NavigationReader(text, source_name).read();
}

RinexNavigation RinexNavigation::load(const std::string& path) {
  return parse(text::read_file(path, kReader), path);
}

}  // namespace orrery
