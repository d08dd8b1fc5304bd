/// A burn by which the range shows.
///
/// Directions alone give a relative orbit up to its scale. A burn of known size moves the chaser
/// across the line of sight by a known distance, so that the angle by which the target moves says
/// how far away it is.
///
/// Method      One burn along the track at the phase of the eccentricity vector: it moves the
///             chaser across the line of sight by up to 4/n of itself, four times as much as one
///             across the track, and lets the eccentricity vector grow along itself, so that the
///             spiral stays parallel and wider. Where there is no drift it starts one towards the
///             target, which is on the way; otherwise it ends it.
/// Size        The least of four whose predicted error of the range is small enough; of these that
///             are safe, the largest if none is.
/// Predicted   From linear relative motion: displacement across the line of sight at each direction
///             until the end, divided by the range and by the noise of a direction, in squares; and
///             the burn's own error, which the scale takes over whole.
/// Checked by  test_suites/unit/flight_sw/rpo_kit/observability_test.cpp
#pragma once

#include "rpo_kit/guidance/transfer.hpp"

namespace rpo_kit {

struct ObservabilityOptions {
  double range_known = 0.03;    ///< 1-sigma of the range, of the range, that is good enough
  double aim = 0.5;             ///< of that: what a burn is sized for
  double direction_rad = 1e-4;  ///< 1-sigma per axis
  double period_s = 200.0;      ///< between directions, eclipses and blinding counted in
  double watch_rev = 2.0;       ///< after the burn
  double lead_s = 120.0;        ///< from now to the burn, at least
  int most = 3;                 ///< burns, without a leg between them
};

/// 1-sigma of the range, of the range, from the elements' covariance. 0 where the target is no
/// longer far: less than five radii of the spiral along the track.
double range_fraction(const flight_support::RelativeOrbit& now,
                      const flight_support::Matrix6& covariance);

/// What directions until `end_ns` would tell of the range after these burns, 1-sigma, of the range.
double predicted_range_fraction(const flight_support::RelativeOrbit& now, const Transfer& burns,
                                double burn_error, const ObservabilityOptions& options);

/// @param keep_out_m  Across the track, at any time and if the burn is lost.
/// @return false: no such burn is safe.
bool plan_observation(const flight_support::RelativeOrbit& now, double keep_out_m,
                      double burn_error, const ObservabilityOptions& options, Transfer* burns);

}  // namespace rpo_kit
