/// Light that falls on a spacecraft, in units of the Sun's irradiance at 1 au ("suns").
#pragma once

#include <orrery/models/frames/vector.hpp>
#include <orrery/models/orbit/radiation_force.hpp>

namespace orrery {

constexpr double kEarthAlbedo = 0.3;  // Bond albedo, as that of a Lambert sphere

struct Lighting {
  Vec3 to_sun_ECI{1, 0, 0};  // unit vector
  double sun = 1;            // irradiance of the Sun [suns]: 0 in the Earth's shadow
  Vec3 to_earth_ECI{0, 0, 1};
  double earth = 0;        // irradiance of the Earth on a surface that faces it [suns]
  double earth_width = 0;  // (R/r)^2: 0 a point, 1 half the sky
};

/// At a place outside the Earth; both positions geocentric [m].
///
/// Method   Sun: inverse square, penumbra and umbra of shadow.hpp. Earth: a Lambert sphere of
/// albedo
///          0.3 at its phase, 2/3 A (R/r)^2 Phi: exact far away; near it a mean, as it does not
///          know which part of the lit Earth is in sight.
Lighting lighting_at(const Vec3& r_ECI, const Vec3& r_sun_ECI);

/// [sin p + (pi - p) cos p] / pi: brightness of a Lambert sphere at phase angle p [rad] over that
/// at 0.
double lambert_phase(double phase_rad);

/// Irradiance of a Lambert sphere under `sun` [suns] at the camera [suns]: 2/3 albedo (R/d)^2 Phi.
double lambert_sphere_suns(double radius_m, double albedo, double distance_m, double phase_rad,
                           double sun);

}  // namespace orrery
