/// A sky and a camera made by hand, with nothing of the flight code in it: what the tests of image
/// processing compare with.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <string>
#include <vector>

#include "../flight_test_support.hpp"
#include "rpo_kit/imaging/camera.hpp"
#include "rpo_kit/imaging/detection.hpp"
#include "rpo_kit/imaging/star_catalogue.hpp"

namespace flight_test {

using flight_support::Mat3;
using flight_support::vec3;

/// Uniform on the sphere.
inline Vec3 random_direction(Noise* noise) {
  const Vec3 v = noise->normal3(1.0);
  return (1.0 / norm(v)) * v;
}

/// The rotation by `angle_rad` of the axes about `axis` (Rodrigues), as R_CI turns components.
inline Mat3 axis_rotation(const Vec3& axis, double angle_rad) {
  const double c = std::cos(angle_rad), s = std::sin(angle_rad);
  const Mat3 outer = axis * transpose(axis);
  const Mat3 hat{{{0, -axis[2], axis[1]}, {axis[2], 0, -axis[0]}, {-axis[1], axis[0], 0}}};
  return c * flight_support::identity<3>() + (1.0 - c) * outer - s * hat;
}

/// Looks along `boresight`, turned by `roll_rad` about it.
inline Mat3 looking_along(const Vec3& boresight, double roll_rad) {
  const Vec3 other = std::fabs(boresight[2]) < 0.9 ? vec3(0, 0, 1) : vec3(1, 0, 0);
  Vec3 x = cross(other, boresight);
  x = (1.0 / norm(x)) * x;
  const Vec3 y = cross(boresight, x);
  Mat3 R;
  for (int k = 0; k < 3; ++k) {
    R(0, k) = std::cos(roll_rad) * x[k] + std::sin(roll_rad) * y[k];
    R(1, k) = -std::sin(roll_rad) * x[k] + std::cos(roll_rad) * y[k];
    R(2, k) = boresight[k];
  }
  return R;
}

/// The turn that leads from one attitude to the other [rad], small, about the axes of C.
inline Vec3 small_turn(const Mat3& from_CI, const Mat3& to_CI) {
  const Mat3 D = to_CI * transpose(from_CI);
  return 0.5 * vec3(D(1, 2) - D(2, 1), D(2, 0) - D(0, 2), D(0, 1) - D(1, 0));
}

/// Stars all over the sky, their number growing by 10^(0.5 m), as the real one's does.
inline std::vector<rpo_kit::Star> random_sky(int count, double faintest, std::uint64_t seed) {
  Noise noise(seed);
  std::vector<rpo_kit::Star> sky;
  for (int k = 0; k < count; ++k) {
    rpo_kit::Star star;
    star.direction_ECI = random_direction(&noise);
    star.magnitude = std::max(-1.0, faintest + 2.0 * std::log10(1.0 - noise.uniform()));
    sky.push_back(star);
  }
  return sky;
}

/// A camera of 20 deg with 70 arcsec per pixel and the distortion of a good lens.
inline rpo_kit::Camera wide_camera() {
  rpo_kit::Camera camera;
  camera.fx = 2904.0, camera.fy = 2903.0, camera.cx = 510.3, camera.cy = 513.8;
  camera.k1 = -0.08, camera.k2 = 0.02, camera.p1 = 3e-4, camera.p2 = -2e-4, camera.k3 = 0.01;
  return camera;
}

/// As OpenCV's manual prints it; false outside the image.
inline bool pinhole(const rpo_kit::Camera& c, const Vec3& direction_C, double* u, double* v) {
  if (direction_C[2] <= 0.0) return false;
  const double x = direction_C[0] / direction_C[2], y = direction_C[1] / direction_C[2];
  const double r2 = x * x + y * y;
  const double radial = 1 + c.k1 * r2 + c.k2 * r2 * r2 + c.k3 * r2 * r2 * r2;
  *u = c.cx + c.fx * (x * radial + 2 * c.p1 * x * y + c.p2 * (r2 + 2 * x * x));
  *v = c.cy + c.fy * (y * radial + c.p1 * (r2 + 2 * y * y) + 2 * c.p2 * x * y);
  return *u > -0.5 && *v > -0.5 && *u < c.width - 0.5 && *v < c.height - 0.5;
}

/// Electrons, pixel by pixel; read out with Gaussian noise of the right variance.
class Exposure {
 public:
  Exposure(int width, int height, double background_e)
      : width_(width),
        height_(height),
        electrons_(static_cast<std::size_t>(width * height), background_e) {}

  /// The integral of a Gaussian over each pixel within 6 sigma.
  void add_source(double u, double v, double electrons, double sigma_px) {
    const int reach = static_cast<int>(std::ceil(6.0 * sigma_px));
    const int x0 = static_cast<int>(std::lround(u)), y0 = static_cast<int>(std::lround(v));
    for (int y = std::max(0, y0 - reach); y <= std::min(height_ - 1, y0 + reach); ++y) {
      for (int x = std::max(0, x0 - reach); x <= std::min(width_ - 1, x0 + reach); ++x) {
        add(x, y, electrons * share(x - u, sigma_px) * share(y - v, sigma_px));
      }
    }
  }
  void add(int x, int y, double electrons) {
    electrons_[static_cast<std::size_t>(y * width_ + x)] += electrons;
  }
  /// @param noise  Null: none, and no rounding beyond that to DN.
  void read_out(double electrons_per_dn, double read_noise_e, Noise* noise) {
    pixels_.clear();
    for (double mean : electrons_) {
      double value = mean;
      if (noise != nullptr) {
        value += std::sqrt(std::max(mean, 0.0) + read_noise_e * read_noise_e) * noise->normal();
      }
      const double dn = std::floor(value / electrons_per_dn + 100.5);
      pixels_.push_back(static_cast<std::uint16_t>(std::clamp(dn, 0.0, 65535.0)));
    }
  }
  rpo_kit::ImageView view() const { return {pixels_.data(), width_, height_}; }

 private:
  static double share(double offset, double sigma) {
    const double scale = 1.0 / (std::sqrt(2.0) * sigma);
    return 0.5 * (std::erf((offset + 0.5) * scale) - std::erf((offset - 0.5) * scale));
  }
  int width_, height_;
  std::vector<double> electrons_;
  std::vector<std::uint16_t> pixels_;
};

/// Yale Bright Star Catalogue, if it is there.
inline std::vector<rpo_kit::Star> bright_stars(const std::string& path) {
  std::vector<rpo_kit::Star> stars;
  std::ifstream file(path);
  std::string line;
  std::getline(file, line);
  while (std::getline(file, line)) {
    std::vector<std::string> field;
    for (std::size_t at = 0; field.size() < 8;) {
      const std::size_t comma = line.find(',', at);
      field.push_back(line.substr(at, comma - at));
      if (comma == std::string::npos) break;
      at = comma + 1;
    }
    if (field.size() < 8 || field[7].empty()) continue;
    const double degree = flight_support::kPi / 180.0;
    const double ra = std::stod(field[2]) * degree, dec = std::stod(field[3]) * degree;
    rpo_kit::Star star;
    star.direction_ECI =
        vec3(std::cos(dec) * std::cos(ra), std::cos(dec) * std::sin(ra), std::sin(dec));
    star.magnitude = std::stod(field[7]);
    stars.push_back(star);
  }
  return stars;
}

}  // namespace flight_test
