#include "opencv_projection.hpp"

#include <opencv2/calib3d.hpp>

namespace orrery {

std::vector<Pixel> opencv_projection(const PinholeCamera& camera,
                                     const std::vector<Vec3>& points_C) {
  std::vector<cv::Point3d> points;
  for (const Vec3& p : points_C) points.emplace_back(p.x, p.y, p.z);
  const cv::Matx33d matrix(camera.fx_px(), 0, camera.cx_px(), 0, camera.fy_px(), camera.cy_px(), 0,
                           0, 1);
  const LensDistortion& d = camera.distortion();
  const cv::Vec<double, 5> distortion(d.k1, d.k2, d.p1, d.p2, d.k3);
  std::vector<cv::Point2d> seen;
  cv::projectPoints(points, cv::Vec3d(0, 0, 0), cv::Vec3d(0, 0, 0), matrix, distortion, seen);
  std::vector<Pixel> pixels;
  for (const cv::Point2d& p : seen) pixels.push_back({p.x, p.y});
  return pixels;
}

}  // namespace orrery
