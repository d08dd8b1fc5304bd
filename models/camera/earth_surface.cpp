#include <orrery/harness/kernel/text.hpp>
#include <orrery/models/camera/earth_surface.hpp>
#include <orrery/models/camera/jpeg_file.hpp>
#include <orrery/models/camera/lighting.hpp>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace orrery {

namespace {

constexpr float kPi = 3.14159265f;
constexpr float kNightLights = 1e-6f;

// Over the sphere.
double mean_of(const Image<float>& map) {
  double sum = 0, weights = 0;
  for (int v = 0; v < map.height_px; ++v) {
    const double weight = std::sin(double(kPi) * (v + 0.5) / map.height_px);
    for (int u = 0; u < map.width_px; ++u) sum += weight * double(map.at(u, v));
    weights += weight * map.width_px;
  }
  return sum / weights;
}

}  // namespace

EarthSurface EarthSurface::uniform(double albedo) {
  if (!(albedo >= 0 && albedo <= 1)) {
    throw std::invalid_argument("EarthSurface: albedo = " + to_text(albedo) + "; accepted: 0 to 1");
  }
  EarthSurface surface;
  surface.map_ = Image<Sample>(1, 1, {static_cast<float>(albedo), 0});
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
  surface.map_ = Image<Sample>(day.width_px, day.height_px);
  for (std::size_t k = 0; k < day.values.size(); ++k) {
    surface.map_.values[k] = {std::min(1.0f, scale * day.values[k]),
                              kNightLights * night.values[k]};
  }
  return surface;
}

EarthSurface::Sample EarthSurface::at(float longitude_rad, float latitude_rad) const {
  const float across = static_cast<float>(map_.width_px), down = static_cast<float>(map_.height_px);
  const int u = static_cast<int>((longitude_rad + kPi) * (across / (2 * kPi)));
  const int v = static_cast<int>((kPi / 2 - latitude_rad) * (down / kPi));
  return map_.at(std::clamp(u, 0, map_.width_px - 1), std::clamp(v, 0, map_.height_px - 1));
}

}  // namespace orrery
