#include <orrery/harness/kernel/text.hpp>
#include <orrery/models/camera/earth_surface.hpp>
#include <orrery/models/camera/jpeg_file.hpp>
#include <orrery/models/camera/lighting.hpp>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace orrery {

namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr int kCells = 512;
constexpr float kNightLights = 1e-6f;

// Over the sphere.
double mean_of(const Image<float>& map) {
  double sum = 0, weights = 0;
  for (int v = 0; v < map.height_px; ++v) {
    const double weight = std::sin(kPi * (v + 0.5) / map.height_px);
    for (int u = 0; u < map.width_px; ++u) sum += weight * double(map.at(u, v));
    weights += weight * map.width_px;
  }
  return sum / weights;
}

// Faces +x, -x, +y, -y, +z, -z; a and b, 0 to 1, along the next two axes in turn.
Vec3 direction_of(int face, double a, double b) {
  const double main = face % 2 == 0 ? 1 : -1, p = 2 * a - 1, q = 2 * b - 1;
  if (face / 2 == 0) return {main, p, q};
  return face / 2 == 1 ? Vec3{q, main, p} : Vec3{p, q, main};
}

// Equirectangular: longitude -180 to 180 deg to the right, latitude 90 to -90 deg downwards.
std::size_t cell_of_map(const Image<float>& map, const Vec3& d) {
  const double longitude = std::atan2(d.y, d.x), latitude = std::atan2(d.z, std::hypot(d.x, d.y));
  const int u = static_cast<int>((longitude / kPi + 1) * 0.5 * map.width_px);
  const int v = static_cast<int>((0.5 - latitude / kPi) * map.height_px);
  return map.index(std::clamp(u, 0, map.width_px - 1), std::clamp(v, 0, map.height_px - 1));
}

}  // namespace

EarthSurface EarthSurface::uniform(double albedo) {
  if (!(albedo >= 0 && albedo <= 1)) {
    throw std::invalid_argument("EarthSurface: albedo = " + to_text(albedo) + "; accepted: 0 to 1");
  }
  EarthSurface surface;
  surface.faces_.assign(6, {static_cast<float>(albedo), 0});
  return surface;
}

EarthSurface EarthSurface::xplanet() {
  const Image<float> day = read_jpeg_luminance("/usr/share/xplanet/images/earth.jpg");
  const Image<float> night = read_jpeg_luminance("/usr/share/xplanet/images/night.jpg");
  if (day.width_px != night.width_px || day.height_px != night.height_px) {
    throw std::runtime_error("EarthSurface: earth.jpg and night.jpg differ in size");
  }
  const float scale = static_cast<float>(kEarthAlbedo / mean_of(day));
  EarthSurface surface;
  surface.cells_ = kCells;
  surface.faces_.reserve(6u * kCells * kCells);
  for (int face = 0; face < 6; ++face) {
    for (int row = 0; row < kCells; ++row) {
      for (int column = 0; column < kCells; ++column) {
        const Vec3 d = direction_of(face, (column + 0.5) / kCells, (row + 0.5) / kCells);
        const std::size_t at = cell_of_map(day, d);
        surface.faces_.push_back(
            {std::min(1.0f, scale * day.values[at]), kNightLights * night.values[at]});
      }
    }
  }
  return surface;
}

EarthSurface::Sample EarthSurface::at(const Vec3& n) const {
  if (cells_ == 1) return faces_[0];
  const double ax = std::abs(n.x), ay = std::abs(n.y), az = std::abs(n.z);
  const int axis = ax >= ay && ax >= az ? 0 : ay >= az ? 1 : 2;
  const double main = axis == 0 ? n.x : axis == 1 ? n.y : n.z;
  const double a = axis == 0 ? n.y : axis == 1 ? n.z : n.x;
  const double b = axis == 0 ? n.z : axis == 1 ? n.x : n.y;
  // From the middle of the first cell, in cells.
  const double scale = 0.5 * cells_ / std::abs(main), origin = 0.5 * (cells_ - 1);
  const double x = std::clamp(a * scale + origin, 0.0, cells_ - 1.001);
  const double y = std::clamp(b * scale + origin, 0.0, cells_ - 1.001);
  const int column = static_cast<int>(x), row = static_cast<int>(y);
  const int face = 2 * axis + (main < 0 ? 1 : 0);
  const Sample* above = &faces_[static_cast<std::size_t>((face * cells_ + row) * cells_ + column)];
  const Sample* below = above + cells_;
  const float p = static_cast<float>(x - column), q = static_cast<float>(y - row);
  const auto mixed = [p, q](float s00, float s01, float s10, float s11) {
    return (1 - q) * ((1 - p) * s00 + p * s01) + q * ((1 - p) * s10 + p * s11);
  };
  return {mixed(above[0].albedo, above[1].albedo, below[0].albedo, below[1].albedo),
          mixed(above[0].night, above[1].night, below[0].night, below[1].night)};
}

}  // namespace orrery
