/// Is the formation safe if nothing more is done, and what to do if not.
///
/// Measure     Radial/cross-track distance over the next revolutions, less k sigma of the estimate
///             along the direction in question: min over u of |r_RN(u)| - k sqrt(lambda_max
///             P_RN(u)). Relative elements and covariance drift under J2; a*da need not be zero.
///             Along-track distance counts for nothing.
/// Escape      Burns over one revolution to parallel e and i vectors of more than `escape_m` and no
///             a*da, at the phase at which that costs least of those that keep clear of the other
///             on the way. One burn cannot do it: radial and normal burns turn the vectors apart,
///             tangential ones leave a*da.
/// Accuracy    The map to RTN is of first order in e: 1e-3 of the elements, a*dl included. Samples
///             every 3 deg miss the minimum by 2.6 % of the vectors' length where it is zero, and
///             by less than 0.1 % where they are parallel.
/// Checked by  test_suites/unit/flight_sw/formation_gnc/separation_monitor_test.cpp
#pragma once

#include <cstdint>

#include "formation_gnc/control/reconfiguration_planner.hpp"

namespace formation_gnc {

struct SeparationOptions {
  double sigmas = 3.0;
  double horizon_rev = 2.0;
  double science_m = 10.0;    ///< escape below that, in science
  double elsewhere_m = 50.0;  ///< and below that, in any other mode
  double escape_m = 80.0;     ///< what an escape reaches at least
  double clear_m = 20.0;      ///< and what it keeps on the way, along-track included, if it can
  ImpulseLimits limits = {};
};

/// The estimate.
struct SeparationState {
  std::int64_t t_ns = 0;
  flight_support::StateEci chief, deputy;
  /// Of (r, v) deputy less chief in the chief's RTN, derivative taken in RTN.
  flight_support::Matrix6 relative_covariance_RTN;
};

struct SeparationForecast {
  double minimum_m = 0.0;                  ///< with the margin of `sigmas`; never below 0
  double nominal_minimum_m = 0.0;          ///< without
  std::int64_t when_ns = 0;                ///< of `minimum_m`
  flight_support::RelativeElements a_roe;  ///< mean, now
};

class SeparationMonitor {
 public:
  explicit SeparationMonitor(const SeparationOptions& options = {}) : options_(options) {}

  SeparationForecast forecast(const SeparationState& now) const;
  /// True if the forecast asks for an escape. Not finite counts as unsafe.
  bool must_escape(const SeparationForecast& forecast, bool in_science) const;
  /// The escape by the deputy, first burn not before `earliest_ns`.
  TransferPlan escape(const SeparationState& now, std::int64_t earliest_ns) const;

 private:
  SeparationOptions options_;
};

}  // namespace formation_gnc
