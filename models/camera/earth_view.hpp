/// The Earth as a camera in orbit sees it: day, night, limb.
#pragma once

#include <orrery/models/camera/earth_surface.hpp>
#include <orrery/models/camera/image.hpp>
#include <orrery/models/camera/pixel_rays.hpp>
#include <orrery/models/frames/vector.hpp>

namespace orrery {

class GlRenderer;

struct EarthViewOptions {
  EarthSurface surface = EarthSurface::uniform();
  double radius_m = 6378137;              // equatorial, WGS84
  double flattening = 1 / 298.257223563;  // 0 to 0.01
  bool atmosphere = true;
  double scale_height_m = 8000;    // of the limb's brightness, 1000 to 30000
  double limb_reflectance = 0.25;  // of the limb at the surface, 0 to 1
  bool glint = false;              // of the Sun on dark surfaces, taken as water
};

/// At one instant.
struct EarthPose {
  Mat3 R_CI{}, R_EI{};
  Vec3 r_ECI{}, v_ECI{};     // of the camera; the velocity for aberration
  Vec3 to_sun_ECI{1, 0, 0};  // unit vector
  double sun = 1;            // irradiance [suns]
};

/// Method      Each pixel's ray against the ellipsoid; Lambert times the map's albedo, night lights
///             where the Sun is down. The edge of the solid Earth covers a pixel by the distance of
///             its tangent from the pixel's centre. Above it the atmosphere: brightness of the limb
///             under the Sun's height there, falling by e per scale height. Glint: a lobe of
///             half-width 12 deg about the mirror direction, at 2 % reflectance, in full on albedos
///             below 0.06, none on 0.10 and above.
/// Not there   Clouds, haze above the disc, refraction, colour.
/// Checked by  test_suites/unit/models/camera/scene_test.cpp: limb, flux of the whole disc.
class EarthView {
 public:
  /// @throws std::invalid_argument  an option outside its range.
  explicit EarthView(const EarthViewOptions& options = {});

  /// Whether the Earth, with its atmosphere up to 10 scale heights, may reach the image.
  bool is_in_view(const PinholeCamera& camera, const EarthPose& pose) const;
  /// Whether the solid Earth stands in the way of what is seen in direction `u_ECI`.
  bool hides(const Vec3& u_ECI, const EarthPose& pose) const;
  /// @param suns     To which the irradiance at the camera by each pixel's part is added [suns].
  /// @param covered  Likewise the part of each pixel that the solid Earth covers.
  /// @param gl       By which to draw; null: on the CPU.
  void add(Image<float>& suns, Image<float>& covered, const Image<PixelRay>& rays,
           const EarthPose& pose, float weight = 1, int threads = 1,
           GlRenderer* gl = nullptr) const;

 private:
  EarthViewOptions options_;
};

}  // namespace orrery
