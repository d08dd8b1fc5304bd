/// The target's corners in a camera's image: the keypoints that the pose estimator takes.
///
/// Method      A pose is made to agree with the image's edges (edge_fit.hpp), from a guess, or from
///             candidates of all attitudes (attitude_search.hpp). Then a straight line through what
///             was found of each edge; a corner is where the lines of its edges meet, so that one
///             that is itself hidden or blurred is found, too. On one line alone it is where the
///             fitted pose puts it along that.
/// Flips       Without a guess, candidates that are turned from the best are fitted as well: where
///             one of them agrees with the image nearly as well, there are no keypoints. With a
///             guess the half turns of the pose about the axes of the body are: where one of them
///             agrees better, the guess was wrong, and all attitudes are searched.
/// Light       What edges leave open (seen from far, a box and the same turned inside out have the
///             same edges) the brightness of the faces mostly shows, as the Sun's direction and the
///             faces' albedos are known.
/// Noise       Of a line: that of its points and `floor_px`, which stands for what all points of an
///             edge share. Corners of one edge are correlated; `floor_px` is chosen so that poses
///             say of themselves what they are.
/// Checked by  test_suites/unit/flight_sw/rpo_kit/keypoint_finder_test.cpp
#pragma once

#include <vector>

#include "rpo_kit/near_range/attitude_search.hpp"
#include "rpo_kit/near_range/edge_fit.hpp"

namespace rpo_kit {

struct KeypointFinderOptions {
  double point_px = 0.4, floor_px = 0.15;  ///< 1-sigma of a point of an edge, and of an edge
  /// Of where the fitted pose has a corner that is on one line only; the same for all of them.
  double open_px = 1.0;
  double least_support = 0.5;   ///< part of the edges' points that the image has, with a guess
  double first_support = 0.8;   ///< the same without
  double least_acquired = 0.4;  ///< times what edges and light explain of the image
  double rival = 0.9;           ///< a candidate as good as that is as good
  double flip_margin = 0.05;    ///< by which the support of a half turn must be better
};

/// What led to keypoints, or why there are none.
enum class Finding { kNothing, kTracked, kAcquired, kAmbiguous };

class KeypointFinder {
 public:
  /// @param wireframe  Outlives this object.
  explicit KeypointFinder(const Wireframe& wireframe, const KeypointFinderOptions& options = {})
      : wireframe_(wireframe), options_(options), search_(wireframe) {}

  /// @param to_sun_C  Unit vector to the Sun.
  /// @param guess     Of the pose; null: none. @param reach_px  1-sigma of where it has an edge.
  /// @param keypoints  Empty if nothing was found.
  Finding find(const Camera& camera, const ImageView& image, const PixelNoise& noise,
               const flight_support::Vec3& to_sun_C, const Pose* guess, double reach_px,
               std::vector<Keypoint>* keypoints);
  /// The pose of the last finding, which the lines were fitted from; no covariance.
  const Pose& pose() const { return pose_; }
  /// Part of the last pose's edge points that the image has.
  double support() const { return support_; }

 private:
  Finding track(EdgeFit& fit, const Pose& guess, double reach_px);
  Finding acquire(EdgeFit& fit, const Camera& camera, const ImageView& image,
                  const PixelNoise& noise);
  double agreement(EdgeFit& fit, const Pose& pose) const;
  double best_half_turn(EdgeFit& fit) const;
  void corners(EdgeFit& fit, const Camera& camera, std::vector<Keypoint>* keypoints);

  const Wireframe& wireframe_;
  KeypointFinderOptions options_;
  AttitudeSearch search_;
  flight_support::Vec3 to_sun_C_;
  Pose pose_;
  double support_ = 0.0;
  std::vector<EdgeSight> sights_;
};

}  // namespace rpo_kit
