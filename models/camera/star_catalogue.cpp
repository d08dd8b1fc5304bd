#include <orrery/harness/kernel/text.hpp>
#include <orrery/models/camera/star_catalogue.hpp>
#include <orrery/models/frames/time_scales.hpp>
#include <orrery/models/text/numbered_lines.hpp>

#include <erfa.h>
#include <erfam.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <stdexcept>
#include <utility>

namespace orrery {

namespace {

constexpr const char* kReader = "StarCatalogue";
constexpr const char* kBrightStars = "/usr/share/xplanet/stars/BSC";
constexpr double kDegree = 3.14159265358979323846 / 180;
constexpr double kArcsecond = kDegree / 3600;
constexpr double kSpeedOfLight_mps = 299792458.0;
constexpr double kLargestMotion_arcsecpyr = 20;  // Barnard's star: 10.4

Star star_at(double ra_rad, double dec_rad, double pm_ra_radpyr, double pm_dec_radpyr) {
  const double ca = std::cos(ra_rad), sa = std::sin(ra_rad);
  const double cd = std::cos(dec_rad), sd = std::sin(dec_rad);
  const Vec3 east{-sa, ca, 0}, north{-sd * ca, -sd * sa, cd};
  return {.direction_ECI = {cd * ca, cd * sa, sd},
          .proper_motion_ECI_radpyr = pm_ra_radpyr * east + pm_dec_radpyr * north};
}

std::vector<std::string_view> fields_of(std::string_view line) {
  std::vector<std::string_view> fields;
  for (std::size_t begin = 0;;) {
    const std::size_t comma = line.find(',', begin);
    fields.push_back(text::trimmed(line.substr(begin, comma - begin)));
    if (comma == std::string_view::npos) return fields;
    begin = comma + 1;
  }
}

// Of the header line.
class Columns {
 public:
  Columns(const text::NumberedLines& lines, std::string_view header)
      : lines_(lines), names_(fields_of(header)) {}

  std::optional<std::size_t> find(std::string_view name) const {
    const auto at = std::find(names_.begin(), names_.end(), name);
    if (at == names_.end()) return {};
    return static_cast<std::size_t>(at - names_.begin());
  }
  std::size_t need(std::string_view name) const {
    const std::optional<std::size_t> column = find(name);
    if (!column) lines_.fail("the header has no column " + std::string(name));
    return *column;
  }
  std::size_t count() const { return names_.size(); }

 private:
  const text::NumberedLines& lines_;
  std::vector<std::string_view> names_;
};

class CsvReader {
 public:
  CsvReader(std::string_view text, std::string_view source) : lines_(text, kReader, source) {}

  std::vector<Star> read() {
    const auto header = lines_.next();
    if (!header) lines_.fail("empty; expected a header line");
    const Columns columns(lines_, *header);
    find(columns);
    std::vector<Star> stars;
    while (const auto line = lines_.next()) {
      if (text::trimmed(*line).empty()) continue;
      const std::vector<std::string_view> fields = fields_of(*line);
      // A quoted last field (a spectral type) may have commas of its own.
      if (fields.size() < columns.count()) {
        lines_.fail(std::to_string(fields.size()) + " fields; the header has " +
                    std::to_string(columns.count()));
      }
      stars.push_back(star(fields));
    }
    if (stars.empty()) lines_.fail("no star");
    return stars;
  }

 private:
  using Fields = std::vector<std::string_view>;

  void find(const Columns& columns) {
    ra_ = columns.need("ra_deg_j2000");
    dec_ = columns.need("dec_deg_j2000");
    magnitude_ = columns.need("vmag");
    b_v_ = columns.find("b_v");
    number_ = columns.find("hip") ? columns.find("hip") : columns.find("hr");
    for (const auto& [unit, scale] : {std::pair{"mas_yr", 1e-3}, std::pair{"arcsec_yr", 1.0}}) {
      const auto ra = columns.find("pm_ra_cosdec_" + std::string(unit));
      const auto dec = columns.find("pm_dec_" + std::string(unit));
      if (ra && dec) pm_ra_ = ra, pm_dec_ = dec, pm_arcsec_ = scale;
    }
  }

  std::optional<double> optional_real(const Fields& fields, std::optional<std::size_t> column,
                                      const char* name, double limit) const {
    if (!column || fields[*column].empty()) return {};
    return lines_.real(fields[*column], name, limit);
  }

  Star star(const Fields& fields) const {
    const double ra = lines_.real(fields[ra_], "ra_deg_j2000", 0, 360);
    const double dec = lines_.real(fields[dec_], "dec_deg_j2000", 90);
    const double limit = kLargestMotion_arcsecpyr / pm_arcsec_;
    const double motion_ra = optional_real(fields, pm_ra_, "pm_ra_cosdec", limit).value_or(0);
    const double motion_dec = optional_real(fields, pm_dec_, "pm_dec", limit).value_or(0);
    const double scale = pm_arcsec_ * kArcsecond;
    Star star = star_at(ra * kDegree, dec * kDegree, motion_ra * scale, motion_dec * scale);
    star.magnitude = lines_.real(fields[magnitude_], "vmag", 30);
    star.b_v = optional_real(fields, b_v_, "b_v", 10);
    if (number_ && !fields[*number_].empty()) {
      star.number = lines_.integer(fields[*number_], "number", 0, 100000000);
    }
    return star;
  }

  text::NumberedLines lines_;
  std::size_t ra_ = 0, dec_ = 0, magnitude_ = 0;
  std::optional<std::size_t> b_v_, number_, pm_ra_, pm_dec_;
  double pm_arcsec_ = 1;
};

// dec ra mag "name" BSN HD SAO
Star xplanet_star(const text::NumberedLines& lines, std::string_view line) {
  const std::vector<std::string_view> words = text::words_of(line);
  if (words.size() < 3) lines.fail("fewer than 3 columns");
  const double dec = lines.real(words[0], "declination", 90);
  const double ra = lines.real(words[1], "right ascension", 0, 24);
  Star star = star_at(ra * 15 * kDegree, dec * kDegree, 0, 0);
  star.magnitude = lines.real(words[2], "magnitude", 30);
  const std::size_t quote = line.rfind('"');
  if (quote != std::string_view::npos) {
    const std::vector<std::string_view> numbers = text::words_of(line.substr(quote + 1));
    if (!numbers.empty()) star.number = text::whole_number(numbers[0]).value_or(0);
  }
  return star;
}

}  // namespace

StarCatalogue::StarCatalogue(std::vector<Star> stars) : stars_(std::move(stars)) {
  for (const Star& star : stars_) {
    if (!(std::abs(norm(star.direction_ECI) - 1) < 1e-9) ||
        !is_finite(star.proper_motion_ECI_radpyr) || !(std::abs(star.magnitude) <= 30)) {
      throw std::invalid_argument("StarCatalogue: star " + std::to_string(star.number) +
                                  ": direction no unit vector, or magnitude = " +
                                  to_text(star.magnitude) + "; accepted: -30 to 30");
    }
  }
  std::stable_sort(stars_.begin(), stars_.end(),
                   [](const Star& a, const Star& b) { return a.magnitude < b.magnitude; });
}

StarCatalogue StarCatalogue::parse_csv(std::string_view text, std::string_view source_name) {
  return StarCatalogue(CsvReader(text, source_name).read());
}

StarCatalogue StarCatalogue::parse_xplanet(std::string_view text, std::string_view source_name) {
  text::NumberedLines lines(text, kReader, source_name);
  std::vector<Star> stars;
  while (const auto line = lines.next()) {
    const std::string_view content = text::trimmed(*line);
    if (!content.empty() && content.front() != '#') stars.push_back(xplanet_star(lines, content));
  }
  if (stars.empty()) lines.fail("no star");
  return StarCatalogue(std::move(stars));
}

StarCatalogue StarCatalogue::load(const std::string& path) {
  const std::string text = text::read_file(path, kReader);
  return path.ends_with(".csv") ? parse_csv(text, path) : parse_xplanet(text, path);
}

StarCatalogue StarCatalogue::bright_stars() {
  if (!std::filesystem::exists(kBrightStars)) {
    throw std::runtime_error(std::string("StarCatalogue: no ") + kBrightStars +
                             ": install Debian's package xplanet, or load() a catalogue");
  }
  return load(kBrightStars);
}

StarCatalogue StarCatalogue::to_magnitude(double magnitude) const {
  StarCatalogue brighter;
  for (const Star& star : stars_) {
    if (star.magnitude <= magnitude) brighter.stars_.push_back(star);
  }
  return brighter;
}

Vec3 direction_ECI(const Star& star, double years) {
  return unit(star.direction_ECI + years * star.proper_motion_ECI_radpyr);
}

double julian_years(SimTime t) {
  return 100 * gps_to_tt_centuries(t);
}

// With k = 1/gamma, b = v/c: u' = (k u + b + b (u.b)/(1 + k)) / (1 + u.b).
Vec3 aberrated(const Vec3& u, const Vec3& v) {
  const Vec3 b = v / kSpeedOfLight_mps;
  const double k = std::sqrt(1 - dot(b, b)), along = dot(u, b);
  return unit(k * u + (1 + along / (1 + k)) * b);
}

Vec3 earth_velocity_ECI(SimTime t) {
  const JulianDate tt = gps_to_tt(t);  // TDB - TT is below 2 ms
  double heliocentric[2][3], barycentric[2][3];
  eraEpv00(tt.day, tt.fraction, heliocentric, barycentric);
  const double scale = ERFA_DAU / ERFA_DAYSEC;
  return {scale * barycentric[1][0], scale * barycentric[1][1], scale * barycentric[1][2]};
}

}  // namespace orrery
