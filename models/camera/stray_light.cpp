#include <orrery/harness/kernel/text.hpp>
#include <orrery/models/camera/stray_light.hpp>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace orrery {

namespace {

constexpr double kDegree = 3.14159265358979323846 / 180;
constexpr int kCell_px = 16;

void check(const char* option, double value, double high) {
  if (!(value >= 0 && value <= high)) {
    throw std::invalid_argument("StrayLight: " + std::string(option) + " = " + to_text(value) +
                                "; accepted: 0 to " + to_text(high));
  }
}

double level(const StraySource& source, const Vec3& d_C, double exponent) {
  const double apart = std::acos(std::clamp(dot(d_C, source.direction_C), -1.0, 1.0));
  const double angle = std::max(kDegree, apart - source.radius_rad);
  if (angle > 90 * kDegree) return 0;
  return source.electrons_ps * std::pow(angle / (30 * kDegree), -exponent);
}

}  // namespace

void check(const StrayLightOptions& options) {
  check("sun_electrons_ps", options.sun_electrons_ps, 1e9);
  check("earth_electrons_ps", options.earth_electrons_ps, 1e9);
  check("exponent", options.exponent, 6);
}

void add_stray_light(ElectronImage& image, const PinholeCamera& camera, const StraySource& source,
                     double exponent, double exposure_s) {
  if (source.electrons_ps == 0) return;
  const int columns = (image.width_px - 1) / kCell_px + 2;
  const int rows = (image.height_px - 1) / kCell_px + 2;
  Image<double> knots(columns, rows);
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      const Pixel at{std::min(double(i * kCell_px), image.width_px - 1.0),
                     std::min(double(j * kCell_px), image.height_px - 1.0)};
      knots.at(i, j) = exposure_s * level(source, camera.direction_C(at), exponent);
    }
  }
  for (int v = 0; v < image.height_px; ++v) {
    const int j = v / kCell_px;
    const double y = double(v % kCell_px) / kCell_px;
    for (int u = 0; u < image.width_px; ++u) {
      const int i = u / kCell_px;
      const double x = double(u % kCell_px) / kCell_px;
      const double above = (1 - x) * knots.at(i, j) + x * knots.at(i + 1, j);
      const double below = (1 - x) * knots.at(i, j + 1) + x * knots.at(i + 1, j + 1);
      image.at(u, v) += static_cast<float>((1 - y) * above + y * below);
    }
  }
}

}  // namespace orrery
