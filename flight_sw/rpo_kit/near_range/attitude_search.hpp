/// How a known target is turned, from one image and without a guess: candidates for EdgeFit.
///
/// Method      The brightest cluster of steep pixels is the target. On a grid of at most 96 cells
///             across it: edges by the gradient, thinned, in eight directions; of each direction a
///             map of how near the next edge of about that direction is (directional chamfer
///             matching, Gavrila & Philomin 1999; Liu et al. 2010). Some 600 directions of view by
///             36 turns about it, each scaled and shifted until its visible edges fill the
///             rectangle that the image's edges fill, are rated by the mean of these maps.
/// Valid for   A target that is inside the image, whose outline is lit for the most part, before a
///             background smoother than itself.
/// Checked by  test_suites/unit/flight_sw/rpo_kit/keypoint_finder_test.cpp
#pragma once

#include <cstdint>
#include <vector>

#include "rpo_kit/near_range/edge_fit.hpp"

namespace rpo_kit {

class AttitudeSearch {
 public:
  explicit AttitudeSearch(const Wireframe& wireframe) : wireframe_(wireframe) {}

  /// @param poses  The best candidates, the best first. @return false: nothing like a target.
  bool look(const Camera& camera, const ImageView& image, const PixelNoise& noise,
            std::vector<Pose>* poses);
  /// Of the last image: the part of its edges that are within 1.5 cells of an edge that the pose
  /// shows.
  double explained(const Camera& camera, const Pose& pose) const;
  /// Of the target in the last image [px].
  double size_px() const { return size_px_; }

 private:
  struct Cell {
    int u, v;
  };
  struct Guess {
    double score = 0.0, scale = 0.0, u = 0.0, v = 0.0;  // cells to the metre, and of the origin
    flight_support::Mat3 R_SB;                          // S: z along the line of sight
  };
  bool find_region(const ImageView& image, const PixelNoise& noise);
  void find_edges(const ImageView& image, const PixelNoise& noise);
  void spread_edges();
  void try_view(const flight_support::Vec3& towards_B, std::vector<Guess>* best);

  const Wireframe& wireframe_;
  int left_ = 0, top_ = 0, cell_ = 1, columns_ = 0, rows_ = 0;  // the grid
  double size_px_ = 0.0;
  std::vector<Cell> edges_;
  std::vector<int> bins_;  // of those
  double low_u_ = 0, high_u_ = 0, low_v_ = 0, high_v_ = 0;
  std::vector<float> nearness_;  // by direction, row, column
  std::vector<EdgePoint> points_;
};

}  // namespace rpo_kit
