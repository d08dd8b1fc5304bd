/// The approach as a sequence of safe orbits, each nearer and narrower than the one before.
///
/// Method      A leg is one transfer with a fixed end; its burns are flown as planned, and the next
///             leg starts from what navigation then says, so that errors of execution and of the
///             first order do not add up. A leg that misses its waypoint is flown again, unless it
///             has led past it: then the next one follows. Before each leg the estimate must be
///             good enough: otherwise it waits where it is, which is safe. Where only the range is
///             not, it first makes it observable (observability.hpp): a burn, and two revolutions
///             of watching what it did.
/// Checked by  test_suites/unit/flight_sw/rpo_kit/guidance_test.cpp
#pragma once

#include "rpo_kit/guidance/observability.hpp"
#include "rpo_kit/guidance/safe_orbits.hpp"

namespace rpo_kit {

/// A safe orbit on the way.
struct Waypoint {
  double along_track_m = 0.0;  ///< a*dl, below 0 behind the target
  double radius_m = 0.0;       ///< of e and i vectors
  double leg_rev = 0.0;        ///< time for the leg that leads here
  double hold_rev = 0.0;       ///< and then here
};

constexpr int kMostWaypoints = 12;

/// From 30 km behind the target to 20 m around it, in 35 revolutions.
struct ApproachPlan {
  Waypoint waypoints[kMostWaypoints] = {{-15000, 250, 8, 0}, {-6000, 200, 8, 0}, {-2000, 150, 6, 0},
                                        {-600, 100, 4, 0},   {-200, 60, 3, 0},   {-60, 35, 3, 1},
                                        {0, 20, 3, 0}};
  int count = 7;
};

struct ApproachOptions {
  TransferOptions transfer = {};
  ObservabilityOptions observability = {};
  ApproachPlan plan = {};
  double tolerance = 0.25;  ///< of a waypoint, as a part of its radius or of 5 % of its distance
  double go_sigmas = 3.0;   ///< no leg begins below keep-out with that margin
  /// 1-sigma of a burn's execution as a part of it: a leg keeps `go_sigmas` of that, and of what is
  /// not known of the orbit, above keep-out wherever there is such a leg.
  double burn_error = 0.025;
  double abort_radius_m = 200.0, abort_drift_m = 20.0;
};

enum class ApproachPhase { kWaiting, kObserving, kLeg, kHolding, kArrived, kAborting, kAborted };

class Approach {
 public:
  explicit Approach(const ApproachOptions& options = {}) : options_(options) {}

  /// @param now  a_roe of the chaser relative to the target. @param lead_s  How long ahead a burn
  ///             is commanded.
  /// @return true, once per burn, if `burn` is to be commanded now.
  bool decide(const flight_support::RelativeOrbit& now, const flight_support::Matrix6& covariance,
              double lead_s, flight_support::Burn* burn);

  /// Leaves to a safe ellipse; what was planned is dropped. @return false if it finds no way.
  bool abort(const flight_support::RelativeOrbit& now);
  /// No further leg until resume(); burns of a leg that has begun are dropped: each stage is safe.
  void hold();
  /// On to the first waypoint that is nearer than `now`.
  void resume(const flight_support::RelativeOrbit& now);
  /// The phase of both vectors from the next leg on, e.g. for the Sun; without it, as it is.
  void set_phase(double phase_rad) { phase_rad_ = phase_rad, has_phase_ = true; }

  ApproachPhase phase() const { return phase_; }
  int waypoint() const { return waypoint_; }
  int legs() const { return legs_; }
  /// Burns for the range, in all.
  int observations() const { return observations_; }
  double delta_v_mps() const { return delta_v_mps_; }
  const Transfer& transfer() const { return transfer_; }

 private:
  flight_support::RelativeElements goal(const flight_support::RelativeOrbit& now) const;
  bool reached(const flight_support::RelativeOrbit& now) const;
  bool passed(const flight_support::RelativeOrbit& now) const;
  bool plan_leg(const flight_support::RelativeOrbit& now, std::int64_t end_ns, double spread_m);
  bool observe(const flight_support::RelativeOrbit& now, const flight_support::Matrix6& covariance,
               double spread_m);
  bool flying() const;
  void begin_leg(const flight_support::RelativeOrbit& now,
                 const flight_support::Matrix6& covariance);
  void end_leg(const flight_support::RelativeOrbit& now);

  ApproachOptions options_;
  ApproachPhase phase_ = ApproachPhase::kWaiting;
  Transfer transfer_;
  int next_burn_ = 0, waypoint_ = 0, legs_ = 0;
  int observations_ = 0, observed_ = 0;  // in all, and since the last leg
  std::int64_t hold_until_ns_ = 0;
  bool held_ = false, has_phase_ = false;
  double phase_rad_ = 0.0, delta_v_mps_ = 0.0;
};

}  // namespace rpo_kit
