#include <orrery/models/camera/lighting.hpp>
#include <orrery/models/orbit/earth.hpp>
#include <orrery/models/orbit/shadow.hpp>

#include <algorithm>
#include <cmath>

namespace orrery {

double lambert_phase(double phase_rad) {
  constexpr double kPi = 3.14159265358979323846;
  return (std::sin(phase_rad) + (kPi - phase_rad) * std::cos(phase_rad)) / kPi;
}

double lambert_sphere_suns(double radius_m, double albedo, double distance_m, double phase_rad,
                           double sun) {
  const double size = radius_m / distance_m;
  return 2.0 / 3.0 * albedo * size * size * lambert_phase(phase_rad) * sun;
}

Lighting lighting_at(const Vec3& r_ECI, const Vec3& r_sun_ECI) {
  const Vec3 sun = r_sun_ECI - r_ECI;
  const double far = norm(sun), r = norm(r_ECI);
  Lighting light;
  light.to_sun_ECI = sun / far;
  const double au = kAstronomicalUnit_m / far;
  light.sun = au * au * sunlit_fraction(shadow_geometry(r_ECI, r_sun_ECI));
  light.to_earth_ECI = -r_ECI / r;
  const double size = std::min(1.0, kRadiusEarth_m / r);
  light.earth_width = size * size;
  const double cosine = std::clamp(dot(r_ECI, unit(r_sun_ECI)) / r, -1.0, 1.0);
  light.earth = lambert_sphere_suns(size, kEarthAlbedo, 1, std::acos(cosine), au * au);
  return light;
}

}  // namespace orrery
