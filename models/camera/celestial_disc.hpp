/// The Sun and the Moon as discs.
#pragma once

#include <orrery/models/camera/image.hpp>
#include <orrery/models/camera/pinhole_camera.hpp>
#include <orrery/models/frames/vector.hpp>

namespace orrery {

struct CelestialDisc {
  Vec3 direction_C{0, 0, 1};  // of its centre as seen, unit vector
  double radius_rad = 0;      // apparent, below 0.1
  double suns = 0;            // irradiance at the camera [suns]
  bool is_lit = false;        // a Lambert sphere lit from to_sun_C; else of even brightness
  Vec3 to_sun_C{0, 0, 1};
};

constexpr double kRadiusMoon_m = 1737400;  // IAU mean

/// V of the Moon: -12.73 + 0.026 |a| + 4e-9 a^4 with a the phase angle in degrees, at 384,400 km
/// and 1 au (Allen, Astrophysical Quantities, 3rd ed., 66), by the inverse squares of both
/// distances.
double moon_magnitude(const Vec3& r_moon, const Vec3& r_sun, const Vec3& r_observer);

/// Adds the disc's irradiance [suns] by pixel, 4 x 4 samples to each, at once for all of it: the
/// sum over a disc that is whole in the image is `suns` within 1 % at a radius of 4 px.
void add_disc(Image<float>& suns, const PinholeCamera& camera, const CelestialDisc& disc,
              float weight = 1);

}  // namespace orrery
