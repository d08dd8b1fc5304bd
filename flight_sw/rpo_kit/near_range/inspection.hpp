/// Near range on board: keypoints of one image after the other become poses, poses a track of the
/// tumbling target, and places for the filter of the whole range.
///
/// Time        Images come by ascending time of exposure; burns are told ahead and count when the
///             next image lies behind them.
/// Health      A covariance without Cholesky factor is no covariance: the track is dropped, the
///             case counted (`lost`), and the next pose starts it anew.
/// Checked by  test_suites/unit/flight_sw/rpo_kit/inspection_test.cpp
#pragma once

#include <cstdint>
#include <vector>

#include "rpo_kit/far_range/relative_orbit.hpp"
#include "rpo_kit/far_range/relative_orbit_filter.hpp"
#include "rpo_kit/near_range/pose_filter.hpp"
#include "rpo_kit/near_range/wireframe.hpp"

namespace rpo_kit {

constexpr int kMostPoints = 32;

struct InspectionOptions {
  Camera camera = {};
  flight_support::Vec3 points_B[kMostPoints];  ///< the target's keypoints [m]
  int points = 0;                              ///< how many; 0: the target's shape is not known
  WireframeFace faces[kMostFaces];             ///< between them, to find them in images
  int face_count = 0;
  PoseOptions pose = {};
  PoseFilterOptions filter = {};
  /// 1-sigma of the velocity below which the track may start the filter of the whole range [m/s].
  double settled_mps = 0.005;
};

/// Keypoints of one image, with the camera's attitude then.
struct Sighting {
  std::int64_t t_ns = 0;  ///< GPS time, of the middle of the exposure
  flight_support::Mat3 R_CI = flight_support::identity<3>();
  double attitude_sigma_rad = 0.0;  ///< 1-sigma per axis
  std::vector<Keypoint> seen;
  const Camera* camera = nullptr;  ///< that it comes from; null: that of the options
};

/// What a camera should see.
struct ExpectedPose {
  Pose pose;                                         ///< without covariance
  double rotation_sigma_rad = 0.0;                   ///< root of the sum of three axes
  double across_sigma_m = 0.0, along_sigma_m = 0.0;  ///< of the place, to the line of sight
};

/// What a sighting gave.
struct Sighted {
  bool pose = false;   ///< one was found
  bool place = false;  ///< and its place is to be believed
  PlaceMeasurement measurement;
};

class Inspection {
 public:
  explicit Inspection(const InspectionOptions& options = {});

  /// @param own  The chaser's orbit at the sighting.
  Sighted look(const Sighting& sighting, const Observer& own);
  /// @param R_CI  The camera's attitude at `t_ns`. @return false: there is no track.
  bool expect(std::int64_t t_ns, const flight_support::Mat3& R_CI, const Observer& own,
              ExpectedPose* expected) const;
  /// A burn of the chaser that will be, or was.
  void burn(std::int64_t t_ns, const flight_support::Vec3& dv_RTN,
            const flight_support::Mat3& covariance_RTN);

  bool tracking() const { return filter_.started(); }
  /// The track's velocity is known to `settled_mps`.
  bool settled() const;
  const PoseFilter& filter() const { return filter_; }
  /// Target less chaser in ECI, and the covariance of position and (inertial) velocity in RTN.
  /// @param own  The chaser's orbit at the track's time.
  StateMeasurement state(const Observer& own, flight_support::Matrix6* covariance_RTN) const;
  int poses() const { return poses_; }
  int lost() const { return lost_; }

 private:
  struct PendingBurn {
    std::int64_t t_ns = 0;
    flight_support::Vec3 dv_RTN;
    flight_support::Mat3 covariance_RTN;
  };

  void burn_until(std::int64_t t_ns, double orbital_rate_radps);

  InspectionOptions options_;
  std::vector<flight_support::Vec3> points_B_;
  PoseFilter filter_;
  std::vector<PendingBurn> burns_;
  int poses_ = 0, lost_ = 0;
};

}  // namespace rpo_kit
