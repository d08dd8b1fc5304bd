#include <orrery/models/orbit/earth.hpp>
#include <orrery/models/orbit/shadow.hpp>

#include <algorithm>
#include <cmath>

namespace orrery {
namespace {

constexpr double kPi = 3.141592653589793;

double apparent_radius_rad(double radius_m, double distance_m) {
  return std::asin(std::min(1.0, radius_m / distance_m));
}

}  // namespace

ShadowGeometry shadow_geometry(const Vec3& r, const Vec3& r_sun) {
  const Vec3 to_sun = r_sun - r;
  return {apparent_radius_rad(kRadiusSun_m, norm(to_sun)),
          apparent_radius_rad(kRadiusEarth_m, norm(r)),
          std::atan2(norm(cross(to_sun, r)), -dot(to_sun, r))};
}

Illumination illumination(const ShadowGeometry& g) {
  if (g.separation_rad >= g.sun_rad + g.earth_rad) return Illumination::kSunlight;
  if (g.separation_rad <= g.earth_rad - g.sun_rad) return Illumination::kUmbra;
  return Illumination::kPenumbra;
}

double margin_rad(const ShadowGeometry& g, Illumination region) {
  const double outside_penumbra = g.separation_rad - (g.earth_rad + g.sun_rad);
  const double outside_umbra = g.separation_rad - (g.earth_rad - g.sun_rad);
  switch (region) {
    case Illumination::kSunlight:
      return outside_penumbra;
    case Illumination::kPenumbra:
      return std::min(-outside_penumbra, outside_umbra);
    case Illumination::kUmbra:
      return -outside_umbra;
  }
  return 0;
}

double sunlit_fraction(const ShadowGeometry& g) {
  const double a = g.sun_rad, b = g.earth_rad, c = g.separation_rad;
  if (c >= a + b) return 1;
  if (c <= b - a) return 0;
  if (c <= a - b) return 1 - (b / a) * (b / a);
  // The discs' common chord is at x from the Sun's centre, 2 y long; atan2 where the book has acos,
  // which loses half the digits near the edges.
  const double x = (c * c + a * a - b * b) / (2 * c);
  const double y = std::sqrt(std::max(0.0, a * a - x * x));
  const double covered = a * a * std::atan2(y, x) + b * b * std::atan2(y, c - x) - c * y;
  return std::clamp(1 - covered / (kPi * a * a), 0.0, 1.0);
}

}  // namespace orrery
