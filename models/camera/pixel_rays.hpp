/// The direction and solid angle of every pixel, computed once.
#pragma once

#include <orrery/models/camera/image.hpp>
#include <orrery/models/camera/pinhole_camera.hpp>

namespace orrery {

struct PixelRay {
  float x = 0, y = 0, z = 1;  // unit vector in camera axes
  float solid_angle_sr = 0;
};

inline Image<PixelRay> pixel_rays(const PinholeCamera& camera) {
  Image<PixelRay> rays(camera.width_px(), camera.height_px());
  for (int v = 0; v < rays.height_px; ++v) {
    for (int u = 0; u < rays.width_px; ++u) {
      const Pixel at{double(u), double(v)};
      const Vec3 d = camera.direction_C(at);
      rays.at(u, v) = {static_cast<float>(d.x), static_cast<float>(d.y), static_cast<float>(d.z),
                       static_cast<float>(camera.solid_angle_sr(at))};
    }
  }
  return rays;
}

}  // namespace orrery
