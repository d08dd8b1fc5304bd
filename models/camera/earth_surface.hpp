/// What the Earth's surface reflects, and what it emits by night.
#pragma once

#include <orrery/models/camera/image.hpp>

#include <string>

namespace orrery {

/// Equirectangular maps: longitude -180 to 180 deg from left to right, latitude 90 to -90 deg
/// downwards.
class EarthSurface {
 public:
  /// The same everywhere, dark by night. @throws std::invalid_argument  albedo outside 0 to 1.
  static EarthSurface uniform(double albedo = 0.3);
  /// The maps of Debian's package xplanet-images (2048 x 1024), read with libturbojpeg: sRGB made
  /// linear, and luminance scaled to a mean reflectance of 0.3 over the sphere, at most 1: the
  /// Earth's with its clouds, which are not in the map. Night lights at full brightness are 1e-6 of
  /// the radiance of a white surface in full sunlight.
  /// @throws std::runtime_error  one of the two is not installed; says what to install.
  static EarthSurface xplanet();

  struct Sample {
    float albedo = 0, night = 0;  // night: radiance over that of a white surface in full sunlight
  };
  /// Of the nearest point of the map. @param longitude_rad -pi to pi; latitude_rad -pi/2 to pi/2.
  Sample at(float longitude_rad, float latitude_rad) const;

 private:
  Image<Sample> map_;
};

}  // namespace orrery
