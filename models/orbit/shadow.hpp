/// The Earth's shadow: umbra and penumbra of a spherical Earth without an atmosphere.
#pragma once

#include <orrery/models/frames/vector.hpp>

namespace orrery {

constexpr double kRadiusSun_m = 6.957e8;  // nominal, IAU 2015 resolution B3

/// The Sun's and the Earth's discs as seen from a spacecraft.
struct ShadowGeometry {
  double sun_rad = 0;         // apparent radius of the Sun, a
  double earth_rad = 0;       // apparent radius of the Earth, b
  double separation_rad = 0;  // of their centres, c
};
/// Both positions geocentric, in one frame [m]; r outside the Earth, or it is taken as on the
/// ground.
ShadowGeometry shadow_geometry(const Vec3& r, const Vec3& r_sun);

enum class Illumination { kUmbra, kPenumbra, kSunlight };

/// Sunlight for c >= a + b, umbra for c <= b - a; a ring of Sun around a small Earth is penumbra.
Illumination illumination(const ShadowGeometry& geometry);

/// Angle [rad] to the nearest edge of that region: positive inside, negative beyond.
double margin_rad(const ShadowGeometry& geometry, Illumination region);

/// Part of the Sun's disc that is not covered, 0 to 1: Montenbruck & Gill, Satellite Orbits (2000),
/// 3.4.2, discs taken as flat. Continuous, with the slope of a square root at neither edge: a
/// circle's segment grows with the power 3/2 of its height.
double sunlit_fraction(const ShadowGeometry& geometry);

}  // namespace orrery
