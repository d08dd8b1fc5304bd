/// A pose made to agree with the edges in an image, from a guess near it.
///
/// Method      Points of the edges that the guess would show; from each a line of pixels normal to
///             the edge, and on it the steepest place near the guess, to a part of a pixel
///             (RAPiD, Harris & Stennett 1990; Drummond & Cipolla, IEEE PAMI 24(7), 2002). Gauss-
///             Newton with Tukey's weights over their offsets, the lines shorter each time.
/// Why edges   Where an edge is does not depend on how bright its sides are, nor which is brighter.
/// Errors      A Gaussian PSF leaves the steepest place on a straight edge; another edge within
///             2 px of it does not.
/// Checked by  test_suites/unit/flight_sw/rpo_kit/keypoint_finder_test.cpp
#pragma once

#include <vector>

#include "rpo_kit/imaging/camera.hpp"
#include "rpo_kit/imaging/detection.hpp"
#include "rpo_kit/near_range/pose_estimator.hpp"
#include "rpo_kit/near_range/wireframe.hpp"

namespace rpo_kit {

/// What an edge has to stand out from.
struct PixelNoise {
  double electrons_per_dn = 1.0, offset_dn = 0.0;
  double read_electrons = 10.0;
  double response = 0.01;  ///< 1-sigma of the pixels' response
};

/// A point of an edge, where the pose puts it and where the image has it.
struct EdgeSight {
  EdgePoint at;
  Pixel pixel;            ///< predicted
  double du = 0, dv = 0;  ///< unit normal of the edge in the image
  bool found = false;
  double offset_px = 0.0;  ///< of the image's edge along the normal
};

class EdgeFit {
 public:
  EdgeFit(const Wireframe& wireframe, const Camera& camera, const ImageView& image,
          const PixelNoise& noise)
      : wireframe_(wireframe), camera_(camera), image_(image), noise_(noise) {}

  /// The points of edges that the pose shows inside the image, each with what the image has within
  /// `reach_px` of it. @param step_px  Between points.
  void look(const Pose& pose, double reach_px, double step_px, std::vector<EdgeSight>* sights);
  /// Gauss-Newton. @param reach_px  At first. @return false: too few edges.
  bool refine(double reach_px, double step_px, int iterations, Pose* pose);
  /// Part of the points that the image has within `reach_px`.
  double support(const Pose& pose, double reach_px, double step_px);
  /// How much of the brightness of the faces the Sun and a light from everywhere explain, each of a
  /// strength that fits: 1 all of it. @param to_sun_C  Unit vector.
  double shading(const Pose& pose, const flight_support::Vec3& to_sun_C) const;

 private:
  double pixel_at(double u, double v) const;
  bool steepest(const Pixel& at, double du, double dv, int reach, double* offset_px) const;
  bool step(double gate_px, Pose* pose, double* moved);

  const Wireframe& wireframe_;
  Camera camera_;
  ImageView image_;
  PixelNoise noise_;
  std::vector<EdgePoint> points_;
  std::vector<EdgeSight> sights_;
};

}  // namespace rpo_kit
