/// Where a known target is and how it is turned, from keypoints in one image.
///
/// Method      RANSAC (Fischler & Bolles 1981) over triples of keypoints: the three-point problem
///             in Grunert's form (Haralick, Lee, Ottenberg & Nolle, IJCV 13(3), 1994), all
///             solutions scored by the keypoints that they explain; then Gauss-Newton on SE(3) over
///             those. All triples up to 12 keypoints, beyond that a fixed sequence of them.
/// Covariance  (J^T W J)^-1, widened where residuals are larger than their 1-sigma.
/// Frames      p_C = r_BC_C + R_CB p_B. Order of the covariance: state_order.hpp.
/// Ambiguity   Of a flat set of keypoints far away a second pose explains the image nearly as
///             well: `rival_inliers` tells how well.
/// Valid for   four keypoints and more that agree; they need not be in general position.
/// Checked by  test_suites/unit/flight_sw/rpo_kit/near_range_test.cpp
#pragma once

#include <vector>

#include "rpo_kit/imaging/camera.hpp"
#include "rpo_kit/state_order.hpp"
#include "support/matrix.hpp"

namespace rpo_kit {

/// A keypoint of the target as seen.
struct Keypoint {
  int point = 0;  ///< which of the target's
  Pixel pixel;
  double sigma_px = 1.0;  ///< 1-sigma per axis, above 0
};

struct Pose {
  flight_support::Vec3 r_BC_C;  ///< target's origin less camera [m]
  flight_support::Mat3 R_CB = flight_support::identity<3>();
  flight_support::Matrix<kPoseStates, kPoseStates> covariance;
  int inliers = 0;
  double residual = 0.0;  ///< of those, root mean square over 1-sigma
  /// Inliers of the best pose that differs by more than 30 deg: near `inliers`, doubt it.
  int rival_inliers = 0;
};

struct PoseOptions {
  double gate_sigma = 4.0;    ///< of an inlier, at the end
  double consensus_px = 6.0;  ///< while scoring triples, whose noise is in it too
  int least_inliers = 5;
  int most_triples = 300;
};

/// @param points_B  The target's keypoints.
/// @return false: no pose explains enough of them.
bool estimate_pose(const Camera& camera, const std::vector<flight_support::Vec3>& points_B,
                   const std::vector<Keypoint>& seen, const PoseOptions& options, Pose* pose);

/// Up to four poses that put three points in three directions.
/// @param directions_C  Unit vectors. @return how many.
int solve_three_points(const flight_support::Vec3 points_B[3],
                       const flight_support::Vec3 directions_C[3], Pose poses[4]);

/// exp(-[d x]) R: R_CB after a turn of the target relative to the camera by d, in axes of C.
flight_support::Mat3 turned(const flight_support::Vec3& d, const flight_support::Mat3& R);

}  // namespace rpo_kit
