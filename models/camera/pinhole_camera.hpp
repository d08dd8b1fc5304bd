/// Where a direction falls on a camera's detector, and the direction that a pixel sees.
#pragma once

#include <orrery/models/frames/vector.hpp>

#include <cstddef>
#include <optional>
#include <vector>

namespace orrery {

/// A point of the image [px]: u to the right, v down; (0, 0) is the CENTRE of the first pixel, as
/// in OpenCV.
struct Pixel {
  double u = 0, v = 0;
};

/// Brown-Conrady, in OpenCV's order (k1, k2, p1, p2, k3).
struct LensDistortion {
  double k1 = 0, k2 = 0, p1 = 0, p2 = 0, k3 = 0;
};

struct PinholeOptions {
  int width_px = 1024, height_px = 1024;  // each 16 to 4096
  double fx_px = 4000, fy_px = 4000;      // focal length, 10 to 1e6
  std::optional<double> cx_px = {};       // principal point; none: the middle of the detector
  std::optional<double> cy_px = {};
  LensDistortion distortion = {};
};

/// Pinhole with lens distortion.
///
/// Frame       C: origin at the pinhole, z along the boresight, x right, y down.
/// Method      x = X/Z, y = Y/Z, r2 = x^2 + y^2, q = 1 + k1 r2 + k2 r2^2 + k3 r2^3,
///             xd = x q + 2 p1 x y + p2 (r2 + 2 x^2), yd = y q + p1 (r2 + 2 y^2) + 2 p2 x y,
///             u = fx xd + cx, v = fy yd + cy: cv::projectPoints. Back: Newton, to 1e-13.
/// Valid for   Distortions under which image and field correspond one to one, up to 1.1 times the
///             radius of the farthest corner. Beyond that the distortion is held at its value there
///             (the direction from the middle kept), so that nothing far outside folds back into
///             the image; that part is not OpenCV's.
/// Checked by  test_suites/unit/models/camera/pinhole_camera_test.cpp, against OpenCV.
class PinholeCamera {
 public:
  /// @throws std::invalid_argument  an option outside its range, or a distortion that folds.
  explicit PinholeCamera(const PinholeOptions& options = {});

  int width_px() const { return options_.width_px; }
  int height_px() const { return options_.height_px; }
  double fx_px() const { return options_.fx_px; }
  double fy_px() const { return options_.fy_px; }
  double cx_px() const { return cx_; }
  double cy_px() const { return cy_; }
  const LensDistortion& distortion() const { return options_.distortion; }

  /// Of a direction or a point, of any length; none where it is not in front (Z <= 0).
  std::optional<Pixel> project(const Vec3& p_C) const;
  /// Unit vector that the point of the image sees. The point at most 1.1 times as far from the
  /// principal point as the farthest corner. @throws std::domain_error  it is farther.
  Vec3 direction_C(const Pixel& pixel) const;
  /// Solid angle [sr] per px^2 at that point of the image.
  double solid_angle_sr(const Pixel& pixel) const;

  /// Within the image, or at most `margin_px` outside of it.
  bool is_inside(const Pixel& pixel, double margin_px = 0) const;
  /// Largest angle from the boresight to what the image shows [rad].
  double half_field_rad() const { return half_field_; }

 private:
  struct Plane {
    double x, y;
  };
  struct Jacobian {
    double xx, xy, yy;  // symmetric
    double determinant() const { return xx * yy - xy * xy; }
  };
  Plane distorted(const Plane& at) const;
  Jacobian derivative(const Plane& at) const;
  std::optional<Plane> undistorted(const Plane& at) const;
  void find_field();

  PinholeOptions options_;
  double cx_ = 0, cy_ = 0;
  double largest_r_ = 0;  // undistorted radius up to which the distortion holds
  double half_field_ = 0;
};

}  // namespace orrery
