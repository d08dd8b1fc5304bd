#include <orrery/harness/kernel/text.hpp>
#include <orrery/models/camera/optics.hpp>
#include <orrery/models/camera/parallel_rows.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>

namespace orrery {

namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kWindow_sigma = 5;
constexpr int kLargestWindow = 2 * (5 * 5 + 2) + 1;

void check(const char* option, double value, double low, double high) {
  if (!(value >= low && value <= high)) {
    throw std::invalid_argument("Optics: " + std::string(option) + " = " + to_text(value) +
                                "; accepted: " + to_text(low) + " to " + to_text(high));
  }
}

// The parts of a unit Gaussian at `centre` that fall on pixels first, first + 1, ...
struct Profile {
  int first = 0, count = 0;
  std::array<double, kLargestWindow> parts;

  Profile(double centre, double sigma, int size) {
    const double reach = kWindow_sigma * sigma;
    first = std::max(0, static_cast<int>(std::ceil(centre - reach - 0.5)));
    const int last = std::min(size - 1, static_cast<int>(std::floor(centre + reach + 0.5)));
    count = std::max(0, last - first + 1);
    const double scale = 1 / (sigma * std::sqrt(2.0));
    double below = std::erf((first - 0.5 - centre) * scale);
    for (int k = 0; k < count; ++k) {
      const double above = std::erf((first + k + 0.5 - centre) * scale);
      parts[static_cast<std::size_t>(k)] = 0.5 * (above - below);
      below = above;
    }
  }
};

}  // namespace

Optics::Optics(const OpticsOptions& options) : options_(options) {
  check("aperture_m", options.aperture_m, 1e-4, 1);
  check("throughput", options.throughput, 1e-6, 2);
  check("psf_sigma_px", options.psf_sigma_px, 0.3, 5);
  check("zero_point_ps_pm2", options.zero_point_ps_pm2, 1e6, 1e12);
  check("vignetting_power", options.vignetting_power, 0, 8);
  area_m2_ = kPi / 4 * options.aperture_m * options.aperture_m;
  sun_ps_ = electrons_ps(kSunMagnitude);
}

double Optics::electrons_ps(double magnitude) const {
  return options_.zero_point_ps_pm2 * area_m2_ * options_.throughput *
         std::pow(10.0, -0.4 * magnitude);
}

void add_point(ElectronImage& image, const Pixel& at, double electrons, double sigma_px) {
  const double reach = kWindow_sigma * sigma_px + 1;
  if (!(at.u > -reach && at.v > -reach && at.u < image.width_px + reach &&
        at.v < image.height_px + reach)) {
    return;
  }
  const Profile across(at.u, sigma_px, image.width_px), down(at.v, sigma_px, image.height_px);
  for (int j = 0; j < down.count; ++j) {
    float* row = image.row(down.first + j) + across.first;
    const double part = electrons * down.parts[static_cast<std::size_t>(j)];
    for (int i = 0; i < across.count; ++i) {
      row[i] += static_cast<float>(part * across.parts[static_cast<std::size_t>(i)]);
    }
  }
}

Vignetting::Vignetting(const PinholeCamera& camera, double power) {
  if (power == 0) return;
  factor_ = Image<float>(camera.width_px(), camera.height_px());
  for (int v = 0; v < factor_.height_px; ++v) {
    for (int u = 0; u < factor_.width_px; ++u) {
      const double cosine = camera.direction_C({double(u), double(v)}).z;
      factor_.at(u, v) = static_cast<float>(power == 1 ? cosine : std::pow(cosine, power));
    }
  }
}

void Vignetting::apply(ElectronImage& image, int threads) const {
  if (factor_.values.empty()) return;
  for_bands_of_rows(threads, image.height_px, [this, &image](int first, int end) {
    for (std::size_t k = image.index(0, first); k < image.index(0, end); ++k) {
      image.values[k] *= factor_.values[k];
    }
  });
}

}  // namespace orrery
