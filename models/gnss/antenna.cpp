#include <orrery/models/data/embedded_tables.hpp>
#include <orrery/models/gnss/antenna.hpp>
#include <orrery/models/text/numbered_lines.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace orrery {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr int kTableIntervals = 2048;     // of sqrt(1 - cosine), 0 to sqrt(2)
constexpr double kChip_m = 293.052;       // of the C/A code
constexpr double kCodeLoop_Hz = 7.60e-3;  // B d / 2
constexpr double kPhaseLoop_Hz = 15;

/// sqrt(1 / (C/N0)), C/N0 as a ratio in Hz.
double root_of_noise(double cn0_dBHz) {
  constexpr double kHalfDecibel = -std::numbers::ln10 / 20;
  return std::exp(kHalfDecibel * cn0_dBHz);
}

}  // namespace

AntennaPattern AntennaPattern::patch() {
  return parse(embedded::gps_patch_antenna_gain(), "gps_patch_antenna_gain.csv (compiled in)");
}

AntennaPattern AntennaPattern::parse(std::string_view text, std::string_view source_name) {
  text::NumberedLines lines(text, "AntennaPattern", source_name);
  const auto header = lines.next();
  if (!header || *header != "off_boresight_deg,gain_dbi") {
    lines.fail("the first line is not off_boresight_deg,gain_dbi");
  }
  AntennaPattern out;
  while (const auto line = lines.next()) {
    const std::size_t comma = line->find(',');
    if (comma == std::string_view::npos || !lines.line_had_end()) {
      lines.fail(text::quoted(*line) + " is not a whole line of two fields");
    }
    const double angle_rad = lines.real(line->substr(0, comma), "angle", 180) * kDegree;
    const double gain_dBi = lines.real(line->substr(comma + 1), "gain", 100);
    if (angle_rad < 0 || (!out.points_.empty() && angle_rad <= out.points_.back().angle_rad)) {
      lines.fail("angles do not rise from 0 on");
    }
    out.peak_dBi_ = out.points_.empty() ? gain_dBi : std::max(out.peak_dBi_, gain_dBi);
    out.points_.push_back({angle_rad, gain_dBi});
  }
  if (out.points_.size() < 2) lines.fail("fewer than two points");
  return out;
}

double AntennaPattern::gain_dBi(double off_boresight_rad) const {
  const auto after = std::upper_bound(
      points_.begin(), points_.end(), off_boresight_rad,
      [](double angle_rad, const Point& point) { return angle_rad < point.angle_rad; });
  if (after == points_.begin()) return points_.front().gain_dBi;
  if (after == points_.end()) return points_.back().gain_dBi;
  const Point &a = *std::prev(after), &b = *after;
  return a.gain_dBi + (b.gain_dBi - a.gain_dBi) * (off_boresight_rad - a.angle_rad) /
                          (b.angle_rad - a.angle_rad);
}

Cn0Model::Cn0Model(const AntennaPattern& pattern, Cn0Law law) : pattern_(pattern) {
  if (law == Cn0Law::kStretched) {
    const double span_dB = pattern.peak_dBi() - pattern.gain_dBi(90 * kDegree);
    if (!(span_dB > 0)) {
      throw std::invalid_argument("Cn0Model: a pattern without loss at 90 deg cannot be stretched");
    }
    slope_ = (kHighestCn0_dBHz - kLowestCn0_dBHz) / span_dB;
  }
  for (int i = 0; i <= kTableIntervals + 1; ++i) {
    const double x = std::numbers::sqrt2 * i / kTableIntervals;
    table_.push_back(static_cast<float>(at_angle(std::acos(std::max(1 - x * x, -1.0)))));
  }
}

double Cn0Model::at_angle(double off_boresight_rad) const {
  const double loss_dB = pattern_.peak_dBi() - pattern_.gain_dBi(off_boresight_rad);
  return std::clamp(kHighestCn0_dBHz - slope_ * loss_dB, kLowestCn0_dBHz, kHighestCn0_dBHz);
}

double Cn0Model::at_cosine(double cos_off_boresight) const {
  constexpr double kPerStep = kTableIntervals / std::numbers::sqrt2;
  const double at = kPerStep * std::sqrt(std::max(1 - cos_off_boresight, 0.0));
  const int i = std::min(static_cast<int>(at), kTableIntervals);
  const double low = static_cast<double>(table_[static_cast<std::size_t>(i)]);
  const double high = static_cast<double>(table_[static_cast<std::size_t>(i) + 1]);
  return low + (at - i) * (high - low);
}

TrackingNoise tracking_noise(double cn0_dBHz, double wavelength_m) {
  const double root = root_of_noise(cn0_dBHz);
  return {kChip_m * std::sqrt(kCodeLoop_Hz) * root,
          wavelength_m / (2 * std::numbers::pi) * std::sqrt(kPhaseLoop_Hz) * root};
}

double phase_sigma_m(double cn0_dBHz, double wavelength_m) {
  return tracking_noise(cn0_dBHz, wavelength_m).phase_sigma_m;
}

double code_sigma_m(double cn0_dBHz) {
  return tracking_noise(cn0_dBHz, 0).code_sigma_m;
}

}  // namespace orrery
