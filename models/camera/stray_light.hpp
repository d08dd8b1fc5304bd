/// Light that reaches the detector from sources outside the field, by scattering in the lens and
/// baffle.
#pragma once

#include <orrery/models/camera/image.hpp>
#include <orrery/models/camera/pinhole_camera.hpp>

namespace orrery {

struct StrayLightOptions {
  double sun_electrons_ps =
      0;  // per pixel, from the Sun at 30 deg from the pixel's direction; 0 to 1e9
  double earth_electrons_ps = 0;  // likewise from a full Earth whose limb is 30 deg off; 0 to 1e9
  double exponent = 2.5;          // of the angle, with which it falls; 0 to 6
};

/// A source: the angle between it and a direction counts from its edge.
struct StraySource {
  Vec3 direction_C{0, 0, 1};  // unit vector
  double radius_rad = 0;
  double electrons_ps = 0;  // at 30 deg
};

/// Adds B (angle / 30 deg)^-exponent times `exposure_s`, the angle taken as at least 1 deg; nothing
/// beyond 90 deg. Evaluated every 16 px, linear between.
/// @throws std::invalid_argument  an option outside its range.
void add_stray_light(ElectronImage& image, const PinholeCamera& camera, const StraySource& source,
                     double exponent, double exposure_s);
void check(const StrayLightOptions& options);

}  // namespace orrery
