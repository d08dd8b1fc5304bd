/// How strong a receiver hears a satellite, and how much it hears of noise.
#pragma once

#include <orrery/harness/kernel/simulator_only.hpp>

#include <string_view>
#include <vector>

namespace orrery {

/// Gain of an antenna against the angle from its boresight, the same at every azimuth.
///
/// Method   Linear between the points given; beyond the last the last value.
class AntennaPattern {
 public:
  /// Sensor Systems S67-1575-39, a hemispherical patch for L1, measured (models/data).
  static AntennaPattern patch();
  /// Text with the header "off_boresight_deg,gain_dbi" and at least two points by rising angle.
  /// @throws std::invalid_argument  "AntennaPattern: <source>, line N: ...".
  static AntennaPattern parse(std::string_view text, std::string_view source_name);

  /// @param off_boresight_rad  0 to pi.
  double gain_dBi(double off_boresight_rad) const;
  double peak_dBi() const { return peak_dBi_; }

 private:
  struct Point {
    double angle_rad, gain_dBi;
  };
  std::vector<Point> points_;
  double peak_dBi_ = 0;
};

/// Carrier to noise density of a received satellite.
enum class Cn0Law {
  /// 45 - 24 (Gmax - G) / (Gmax - G(90 deg)): both bounds of the paper's Table 2 are reached with
  /// any pattern, 45 dB-Hz on boresight and 21 at 90 deg. The reference mission's.
  kStretched,
  kAsMeasured,  // 45 - (Gmax - G)
};

constexpr double kHighestCn0_dBHz = 45, kLowestCn0_dBHz = 21;

/// The law on a pattern, clamped to 21 to 45 dB-Hz.
class Cn0Model {
 public:
  /// @throws std::invalid_argument  kStretched with a pattern that is flat up to 90 deg.
  Cn0Model(const AntennaPattern& pattern, Cn0Law law);
  /// By a table of 2048 steps of sqrt(1 - cosine), linear between (0.06 deg near boresight, 0.08
  /// deg at 90): within 0.05 dB of at_angle(), and without trigonometry.
  double at_cosine(double cos_off_boresight) const;
  double at_angle(double off_boresight_rad) const;

 private:
  AntennaPattern pattern_;
  double slope_ = 1;
  std::vector<float> table_;
};

/// Standard deviation of thermal tracking noise. Bounds of Table 2 of Bell and D'Amico: phase 0.659
/// to 10.45 mm and code 0.1437 to 2.2769 m are what these loops give at 45 and 21 dB-Hz.
///
/// Source  Kaplan & Hegarty, Understanding GPS (2006), 5.6: phase lock loop of 15 Hz, lambda / 2 pi
///         sqrt(B / (C/N0)); delay lock loop with B d / 2 = 7.60e-3 Hz, 293.052 m sqrt(that /
///         (C/N0)). Squaring loss is left out, as both bounds are met without it.
double phase_sigma_m(double cn0_dBHz, double wavelength_m);
double code_sigma_m(double cn0_dBHz);
/// Both at once.
struct TrackingNoise {
  double code_sigma_m = 0, phase_sigma_m = 0;
};
TrackingNoise tracking_noise(double cn0_dBHz, double wavelength_m);

}  // namespace orrery
