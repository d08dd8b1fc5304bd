#include <orrery/models/camera/exposure.hpp>

#include <cmath>

namespace orrery {

// Rodrigues' formula, of the transpose: R = 1 - sin a [n] + (1 - cos a) [n]^2.
Mat3 rotation_by(const Vec3& angle) {
  const double a = norm(angle);
  if (a == 0) return {};
  const Vec3 n = angle / a;
  const double s = std::sin(a), c = std::cos(a), d = 1 - c;
  return {{c + d * n.x * n.x, d * n.x * n.y + s * n.z, d * n.x * n.z - s * n.y},
          {d * n.y * n.x - s * n.z, c + d * n.y * n.y, d * n.y * n.z + s * n.x},
          {d * n.z * n.x + s * n.y, d * n.z * n.y - s * n.x, c + d * n.z * n.z}};
}

Mat3 CameraPose::R_CI_after(double dt_s) const {
  return rotation_by(dt_s * omega_CI_C) * R_CI;
}

}  // namespace orrery
