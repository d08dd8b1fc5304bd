#include "rpo_kit/guidance/approach.hpp"

#include <algorithm>
#include <cmath>

#include "support/orbit/constants.hpp"

namespace rpo_kit {

using namespace flight_support;

namespace {

std::int64_t revolutions_ns(const OrbitElements& chief, double rev) {
  return nanoseconds(rev * kTwoPi / secular_rates(chief).u_radps);
}

}  // namespace

RelativeElements Approach::goal(const RelativeOrbit& now) const {
  const Waypoint& waypoint = options_.plan.waypoints[waypoint_];
  const double phase = has_phase_ ? phase_rad_ : common_phase_rad(now.a_roe);
  return safe_orbit(waypoint.along_track_m, waypoint.radius_m, phase);
}

bool Approach::reached(const RelativeOrbit& now) const {
  const Waypoint& waypoint = options_.plan.waypoints[waypoint_];
  const RelativeElements miss = now.a_roe - goal(now);
  const double across = options_.tolerance * waypoint.radius_m;
  const double along = std::max(across, 0.05 * std::fabs(waypoint.along_track_m));
  return std::fabs(miss[kDl]) < along && std::fabs(miss[kDa]) < across &&
         std::hypot(miss[kDex], miss[kDey]) < across && std::hypot(miss[kDix], miss[kDiy]) < across;
}

// Nearer than the waypoint, and not yet at the next one.
bool Approach::passed(const RelativeOrbit& now) const {
  if (waypoint_ + 1 >= options_.plan.count) return false;
  const double here = std::fabs(now.a_roe[kDl]);
  return here < std::fabs(options_.plan.waypoints[waypoint_].along_track_m) &&
         here > std::fabs(options_.plan.waypoints[waypoint_ + 1].along_track_m);
}

// A burn's error moves e and i vectors by up to 2/n of itself.
bool Approach::plan_leg(const RelativeOrbit& now, std::int64_t end_ns, double spread_m) {
  TransferOptions options = options_.transfer;
  options.keep_out_m += spread_m;
  if (!plan_transfer(now, goal(now), end_ns, options, &transfer_)) {
    return plan_transfer(now, goal(now), end_ns, options_.transfer, &transfer_);
  }
  const double m_per_mps =
      2.0 * options_.go_sigmas * options_.burn_error / mean_motion_radps(now.chief.a_m);
  for (int again = 0; again < 2; ++again) {
    double largest_mps = 0.0;
    for (int k = 0; k < transfer_.count; ++k) {
      largest_mps = std::max(largest_mps, norm(transfer_.burns[k].dv_RTN));
    }
    options.keep_out_m = options_.transfer.keep_out_m + spread_m + m_per_mps * largest_mps;
    Transfer safer;
    if (transfer_.safe_m >= options.keep_out_m ||
        !plan_transfer(now, goal(now), end_ns, options, &safer)) {
      break;
    }
    transfer_ = safer;
  }
  return true;
}

// With the range as badly known as that a leg would miss: its burns are in proportion to it.
bool Approach::observe(const RelativeOrbit& now, const Matrix6& covariance, double spread_m) {
  const ObservabilityOptions& options = options_.observability;
  if (observed_ == options.most || !(range_fraction(now, covariance) > options.range_known)) {
    return false;
  }
  const double keep_out_m = options_.transfer.keep_out_m + spread_m;
  if (!plan_observation(now, keep_out_m, options_.burn_error, options, &transfer_)) return false;
  phase_ = ApproachPhase::kObserving;
  next_burn_ = 0;
  ++observations_;
  ++observed_;
  return true;
}

void Approach::begin_leg(const RelativeOrbit& now, const Matrix6& covariance) {
  const Waypoint& waypoint = options_.plan.waypoints[waypoint_];
  const double margin_m = uncertain_safe_m(now, covariance, options_.go_sigmas);
  if (margin_m < options_.transfer.keep_out_m) return;
  const std::int64_t end_ns = now.t_ns + revolutions_ns(now.chief, waypoint.leg_rev);
  const double spread_m = std::max(0.0, uncertain_safe_m(now, Matrix6(), 0.0) - margin_m);
  if (observe(now, covariance, spread_m)) return;
  if (!plan_leg(now, end_ns, spread_m)) return;
  phase_ = ApproachPhase::kLeg;
  next_burn_ = observed_ = 0;
  ++legs_;
}

void Approach::end_leg(const RelativeOrbit& now) {
  if (phase_ == ApproachPhase::kAborting) {
    phase_ = ApproachPhase::kAborted;
    return;
  }
  const bool observed = phase_ == ApproachPhase::kObserving;
  phase_ = ApproachPhase::kWaiting;
  if (observed) return;
  if (!reached(now)) {
    if (passed(now)) ++waypoint_;
    return;
  }
  const Waypoint& waypoint = options_.plan.waypoints[waypoint_];
  if (waypoint_ + 1 == options_.plan.count) {
    phase_ = ApproachPhase::kArrived;
    return;
  }
  ++waypoint_;
  phase_ = ApproachPhase::kHolding;
  hold_until_ns_ = now.t_ns + revolutions_ns(now.chief, waypoint.hold_rev);
}

bool Approach::flying() const {
  return phase_ == ApproachPhase::kLeg || phase_ == ApproachPhase::kObserving ||
         phase_ == ApproachPhase::kAborting;
}

bool Approach::decide(const RelativeOrbit& now, const Matrix6& covariance, double lead_s,
                      Burn* burn) {
  if (flying() && next_burn_ == transfer_.count && now.t_ns >= transfer_.end_ns) end_leg(now);
  if (phase_ == ApproachPhase::kHolding && now.t_ns >= hold_until_ns_) {
    phase_ = ApproachPhase::kWaiting;
  }
  // Arrived, it stays: J2 and errors move it off, and the last leg brings it back.
  if (phase_ == ApproachPhase::kArrived && !reached(now)) phase_ = ApproachPhase::kWaiting;
  if (phase_ == ApproachPhase::kWaiting && !held_) begin_leg(now, covariance);
  if (!flying()) return false;
  if (next_burn_ == transfer_.count) return false;
  const Burn& next = transfer_.burns[next_burn_];
  if (next.t_ns - now.t_ns > nanoseconds(lead_s)) return false;
  ++next_burn_;
  // Too late to be commanded, it is a lost burn, and the plan is safe without it.
  if (next.t_ns <= now.t_ns) return false;
  *burn = next;
  delta_v_mps_ += norm(next.dv_RTN);
  return true;
}

bool Approach::abort(const RelativeOrbit& now) {
  if (!plan_abort(now, options_.abort_radius_m, options_.abort_drift_m, options_.transfer.lead_s,
                  &transfer_)) {
    return false;
  }
  phase_ = ApproachPhase::kAborting;
  next_burn_ = 0;
  held_ = true;
  return true;
}

void Approach::hold() {
  held_ = true;
  if (phase_ == ApproachPhase::kLeg || phase_ == ApproachPhase::kObserving) {
    phase_ = ApproachPhase::kWaiting;
  }
}

void Approach::resume(const RelativeOrbit& now) {
  held_ = false;
  phase_ = ApproachPhase::kWaiting;
  waypoint_ = 0;
  while (waypoint_ + 1 < options_.plan.count &&
         std::fabs(options_.plan.waypoints[waypoint_].along_track_m) > std::fabs(now.a_roe[kDl])) {
    ++waypoint_;
  }
}

}  // namespace rpo_kit
