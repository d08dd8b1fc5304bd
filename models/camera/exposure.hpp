/// Where a camera is and how it turns while its shutter is open.
#pragma once

#include <orrery/harness/kernel/time.hpp>
#include <orrery/models/frames/vector.hpp>

namespace orrery {

/// At the middle of the exposure (of the middle row, with a rolling shutter). Over the exposure
/// velocity and angular velocity are taken as constant.
struct CameraPose {
  SimTime t{};
  Vec3 r_ECI{}, v_ECI{};
  Mat3 R_CI{};        // f_C = R_CI f_ECI
  Vec3 omega_CI_C{};  // angular velocity of the camera relative to ECI [rad/s]

  /// Attitude `dt_s` later.
  Mat3 R_CI_after(double dt_s) const;
};

struct ExposureTime {
  double duration_s = 0.1;  // of each row
  double row_period_s = 0;  // rolling shutter: from row to row, downwards; 0: global
};

/// The matrix that turns components into those of axes turned by `angle` (vector, [rad]).
Mat3 rotation_by(const Vec3& angle);

}  // namespace orrery
