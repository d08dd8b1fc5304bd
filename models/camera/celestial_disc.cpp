#include <orrery/models/camera/celestial_disc.hpp>
#include <orrery/models/camera/lighting.hpp>

#include <algorithm>
#include <cmath>

namespace orrery {

namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr int kSamples = 4;

// Brightness in the direction d, of a disc whose integral of it is known.
double brightness(const CelestialDisc& disc, const Vec3& d, double sine) {
  const double along = dot(d, disc.direction_C);
  const double off2 = 1 - along * along;
  if (along <= 0 || off2 > sine * sine) return 0;
  if (!disc.is_lit) return 1;
  // On a sphere of radius `sine` about the end of the unit vector to its centre.
  const double t = along - std::sqrt(sine * sine - off2);
  return std::max(0.0, dot((t * d - disc.direction_C) / sine, disc.to_sun_C));
}

double integral_sr(const CelestialDisc& disc, double sine) {
  if (!disc.is_lit) return kPi * sine * sine;
  const double phase = std::acos(std::clamp(-dot(disc.direction_C, disc.to_sun_C), -1.0, 1.0));
  return 2.0 / 3.0 * kPi * sine * sine * lambert_phase(phase);
}

}  // namespace

double moon_magnitude(const Vec3& r_moon, const Vec3& r_sun, const Vec3& r_observer) {
  const Vec3 to_sun = r_sun - r_moon, to_observer = r_observer - r_moon;
  const double cosine = dot(to_sun, to_observer) / (norm(to_sun) * norm(to_observer));
  const double a = std::acos(std::clamp(cosine, -1.0, 1.0)) * 180 / kPi;
  return -12.73 + 0.026 * a + 4e-9 * a * a * a * a +
         5 * std::log10(norm(to_observer) / 384400e3 * norm(to_sun) / kAstronomicalUnit_m);
}

void add_disc(Image<float>& suns, const PinholeCamera& camera, const CelestialDisc& disc,
              float weight) {
  const std::optional<Pixel> centre = camera.project(disc.direction_C);
  if (!centre) return;
  const double sine = std::sin(disc.radius_rad);
  // Off the boresight and with distortion a disc is drawn out; twice its radius holds it.
  const double reach = 2 + 2 * disc.radius_rad * std::max(camera.fx_px(), camera.fy_px()) /
                               std::max(0.1, disc.direction_C.z * disc.direction_C.z);
  const int left = std::max(0, static_cast<int>(std::max(centre->u - reach, 0.0)));
  const int top = std::max(0, static_cast<int>(std::max(centre->v - reach, 0.0)));
  const int right = static_cast<int>(std::min(centre->u + reach, camera.width_px() - 1.0));
  const int bottom = static_cast<int>(std::min(centre->v + reach, camera.height_px() - 1.0));
  const double whole = integral_sr(disc, sine);
  if (!(whole > 0)) return;
  for (int v = top; v <= bottom; ++v) {
    for (int u = left; u <= right; ++u) {
      double sum = 0;
      for (int k = 0; k < kSamples * kSamples; ++k) {
        const Pixel at{u - 0.5 + (k % kSamples + 0.5) / kSamples,
                       v - 0.5 + (k / kSamples + 0.5) / kSamples};
        sum += brightness(disc, camera.direction_C(at), sine);
      }
      if (sum == 0) continue;
      const double part = camera.solid_angle_sr({double(u), double(v)}) / whole;
      suns.at(u, v) += weight * static_cast<float>(disc.suns * part * sum / (kSamples * kSamples));
    }
  }
}

}  // namespace orrery
