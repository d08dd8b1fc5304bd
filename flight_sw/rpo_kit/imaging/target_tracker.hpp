/// Which of the sources that are no catalogue star is the target.
///
/// Method      By motion. Directions are kept in the observer's RTN, where a target drifts slowly
///             and nearly on a straight line, whereas stars, known or not, turn at the orbital
///             rate: what was at the same inertial direction in one of the last frames is a star.
///             A track that ended on such a star was none.
///             A hot pixel is sharper than the optics allow, or stays on its pixel's centre from
///             frame to frame. Several tracks are followed at a time; one is confirmed by 3 hits in
///             5 frames that fit one rate.
/// Valid for   frames up to a tenth of an orbit apart; targets slower than `max_rate` of n.
/// Checked by  test_suites/unit/flight_sw/rpo_kit/star_identification_test.cpp
#pragma once

#include <cstdint>
#include <vector>

#include "rpo_kit/imaging/detection.hpp"
#include "support/matrix.hpp"

namespace rpo_kit {

struct TrackerOptions {
  double orbital_rate_radps = 1.1e-3;
  double max_rate = 0.25;   ///< of the orbital rate, of a target in RTN
  double sigmas = 4.0;      ///< of association
  double curvature = 1.0;   ///< acceleration, as a part of n times `max_rate` times n
  double flux_ratio = 3.0;  ///< by which a target may become brighter or fainter from hit to hit
  int confirm_hits = 3, confirm_frames = 5;
  int lost_frames = 6;     ///< without a hit, then a track ends
  double stuck_px = 0.06;  ///< from a pixel's centre and from frame to frame
  int stuck_frames = 4;
};

/// A source that no catalogue star explains.
struct UnknownSource {
  Detection detection;
  flight_support::Vec3 direction_ECI;  ///< unit vector
  double sigma_rad = 0.0;              ///< 1-sigma per axis, attitude included
};

struct Track {
  int id = 0;
  flight_support::Vec3 direction_H, rate_H;  ///< unit vector in RTN and its derivative [1/s]
  std::int64_t t_ns = 0;                     ///< of the last hit
  double sigma_rad = 0.0;
  double flux_dn = 0.0;
  int hits = 0;
  std::uint32_t history = 0;  ///< a bit per frame, the newest lowest
  bool confirmed = false;
  int source = -1;  ///< in the last frame, or -1
};

class TargetTracker {
 public:
  explicit TargetTracker(const TrackerOptions& options = {}, double hot_sharpness = 0.47)
      : options_(options), hot_sharpness_(hot_sharpness) {}

  /// Of a target in RTN, from the next frame on.
  void set_max_rate(double max_rate) { options_.max_rate = max_rate; }

  /// A frame. @param R_HI  Turns ECI into the observer's RTN at `t_ns`.
  void frame(std::int64_t t_ns, const flight_support::Mat3& R_HI,
             const std::vector<UnknownSource>& sources);

  const std::vector<Track>& tracks() const { return tracks_; }
  /// The confirmed track nearest to a predicted direction in RTN, within `reach_rad`; without a
  /// prediction (null) the one with the most hits. Null: none.
  const Track* target(const flight_support::Vec3* predicted_H = nullptr,
                      double reach_rad = 0.0) const;
  /// Sources of the last frame that were set aside.
  int stars_set_aside() const { return stars_; }
  int hot_set_aside() const { return hot_; }

 private:
  struct Stuck {
    double u, v;
    int frames;
    bool seen;
  };
  bool is_hot(const Detection& detection);
  bool is_star(const UnknownSource& source);
  double gate_rad(const Track& track, double dt_s, double sigma_rad) const;
  void hit(Track* track, const UnknownSource& source, const flight_support::Vec3& direction_H,
           std::int64_t t_ns);
  void associate(std::int64_t t_ns, const flight_support::Mat3& R_HI,
                 const std::vector<UnknownSource>& sources);
  void begin_tracks(std::int64_t t_ns, const flight_support::Mat3& R_HI,
                    const std::vector<UnknownSource>& sources);

  TrackerOptions options_;
  double hot_sharpness_;
  std::vector<Track> tracks_;
  std::vector<Stuck> stuck_;
  std::vector<UnknownSource> before_[3];  // inertial, of the last frames, the newest first
  std::vector<bool> usable_;
  std::vector<bool> was_star_;  // of the frame before
  int next_id_ = 1, stars_ = 0, hot_ = 0;
};

}  // namespace rpo_kit
