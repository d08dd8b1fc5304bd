/// From a frame of the camera to the direction of the target: the imaging chain as a whole.
///
/// Method      Detection and centroids; stars by tracking from the last attitude, held in RTN, and
///             lost in space where that fails; attitude; what is no star goes to the target
///             tracker, and the source that it holds for the target becomes a direction among the
///             stars.
/// Noise       Of a direction: the centroid's and the attitude's, which are independent, a
///             systematic part (lens, catalogue), and where on the target its light comes from.
/// Time        Of a direction: the middle of the exposure. Rows of a rolling shutter are taken as
///             one instant, that of the middle row.
/// Valid for   a camera that is nearly fixed in RTN, frames up to a tenth of an orbit apart.
/// Memory      Taken once, with this object: 7 bytes a pixel, and the star catalogue.
/// Checked by  test_suites/unit/flight_sw/rpo_kit/frame_processor_test.cpp
#pragma once

#include <vector>

#include "rpo_kit/far_range/relative_orbit.hpp"
#include "rpo_kit/imaging/camera.hpp"
#include "rpo_kit/imaging/detection.hpp"
#include "rpo_kit/imaging/star_identification.hpp"
#include "rpo_kit/imaging/target_tracker.hpp"

namespace rpo_kit {

struct ImagingOptions {
  int width = 0, height = 0;  ///< of the frames [px]; 0: there is no camera
  double field_radius_rad = 0.2;
  DetectionOptions detection = {};
  IdentificationOptions identification = {};  ///< field_radius_rad is taken from above
  TrackerOptions tracker = {};
  double pair_magnitude = 5.3;  ///< fainter stars are in no pair
  int most_stars = 60;          ///< sources that are looked at as stars, the brightest
  double pointing_rad = 0.003;  ///< by which the camera may turn in RTN between two frames
  /// What the orbits' model leaves of a direction, 1-sigma per axis: neighbouring orbits share most
  /// of what it lacks, so it goes with the distance. Added to what navigation is told.
  double model_rad = 3e-5;
  double target_size_m = 0.1;    ///< 1-sigma of where its light comes from
  double systematic_rad = 5e-6;  ///< of a direction, 1-sigma per axis
  double blend_px = 6.0;         ///< nearer to a star of the catalogue, no direction is given
  /// How fast the target may move in RTN, over the orbit's rate: while nothing is known of it, at
  /// most; in between as if it went round on a circle of `swing_m`.
  double search_rate = 0.05, most_rate = 0.25, swing_m = 1000.0;
};

/// What the camera says with its pixels.
struct FrameHeader {
  std::int64_t t_ns = 0;  ///< of the middle of the exposure, GPS
  Camera camera;
  double electrons_per_dn = 1.0, saturation_dn = 65535.0;
};

/// Where the target should be.
struct ExpectedTarget {
  flight_support::Vec3 direction_ECI;  ///< unit vector
  double reach_rad = 0.0, range_m = 0.0;
};

struct FrameReport {
  std::int64_t t_ns = 0;
  int sources = 0, identified = 0;
  bool attitude_known = false;
  bool lost_in_space = false;  ///< and found again without a prediction
  Attitude attitude;
  bool target = false;
  Bearing bearing;
  Pixel pixel;  ///< of the target
};

class FrameProcessor {
 public:
  FrameProcessor(const ImagingOptions& options, std::vector<Star> stars);
  FrameProcessor(const FrameProcessor&) = delete;
  FrameProcessor& operator=(const FrameProcessor&) = delete;

  /// @param own       This spacecraft's orbit at the frame's time.
  /// @param expected  Null: the target may be anywhere.
  /// @return false, and nothing done: the frame is not of the size that was announced.
  bool process(const FrameHeader& header, const ImageView& image, const Observer& own,
               const ExpectedTarget* expected, FrameReport* report);

  const StarCatalogue& catalogue() const { return catalogue_; }

 private:
  bool find_attitude(const flight_support::Vec3& v_ECI, const flight_support::Mat3& R_HI,
                     FrameReport* report);
  void find_target(const FrameHeader& header, const flight_support::Mat3& R_HI,
                   const ExpectedTarget* expected, FrameReport* report);
  bool is_blended(const Camera& camera, const flight_support::Vec3& direction_ECI) const;
  double direction_sigma(const SeenSource& source, const Attitude& attitude) const;

  ImagingOptions options_;
  StarCatalogue catalogue_;
  StarIdentifier identifier_;
  PointSourceDetector detector_;
  TargetTracker tracker_;
  std::vector<Detection> found_;
  std::vector<SeenSource> seen_, stars_;
  std::vector<UnknownSource> unknown_;
  Identification identification_;
  bool has_attitude_ = false;
  flight_support::Mat3 R_CH_ = flight_support::identity<3>();  // of the last attitude
};

}  // namespace rpo_kit
