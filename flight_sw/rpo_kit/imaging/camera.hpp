/// The camera as flight software knows it: pixels to directions and back.
///
/// Model       Pinhole with Brown-Conrady distortion, in OpenCV's order of coefficients
///             (k1, k2, p1, p2, k3) and with its pixel convention:
///             (0, 0) is the centre of the first pixel.
/// Frame       C: z along the boresight, x to the right, y down; R_CI turns ECI into C.
/// Valid for   distortion that is one to one over the field: the inverse is by Newton's method from
///             the undistorted point, and says so where it does not converge.
/// Checked by  test_suites/unit/flight_sw/rpo_kit/detection_test.cpp
#pragma once

#include "support/matrix.hpp"

namespace rpo_kit {

struct Camera {
  int width = 1024, height = 1024;                          ///< [px]
  double fx = 3000.0, fy = 3000.0, cx = 511.5, cy = 511.5;  ///< [px]
  double k1 = 0.0, k2 = 0.0, p1 = 0.0, p2 = 0.0, k3 = 0.0;  ///< of coordinates x/z, y/z
};

struct Pixel {
  double u = 0.0, v = 0.0;
};

/// @param direction_C  Any length. @return false at or behind the camera's plane.
bool project(const Camera& camera, const flight_support::Vec3& direction_C, Pixel* pixel);

/// The same with its partials with respect to direction_C [px per unit of direction_C].
bool project(const Camera& camera, const flight_support::Vec3& direction_C, Pixel* pixel,
             flight_support::Matrix<2, 3>* partials);

/// Unit vector in C. @return false if the distortion cannot be undone there.
bool unproject(const Camera& camera, const Pixel& pixel, flight_support::Vec3* direction_C);

}  // namespace rpo_kit
