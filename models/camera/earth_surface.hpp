/// What the Earth's surface reflects, and what it emits by night.
#pragma once

#include <orrery/models/frames/vector.hpp>

#include <vector>

namespace orrery {

/// Kept on the six faces of a cube, so that a look-up needs no angles: cells of 0.09 to 0.22 deg.
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
  /// In a direction of any length above 0: the normal of the ellipsoid there, ECEF. Linear between
  /// the cells of a face.
  Sample at(const Vec3& normal_ECEF) const;
  /// All cells, face by face, and how many along an edge of one: for other renderers.
  const std::vector<Sample>& samples() const { return faces_; }
  int cells() const { return cells_; }

 private:
  int cells_ = 1;  // along an edge of a face
  std::vector<Sample> faces_;
};

}  // namespace orrery
