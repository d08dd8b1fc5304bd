/// Relative orbits to stay in, and the way out to one.
///
/// State       a_roe of the chaser relative to the target [m], mean.
/// Method      Eccentricity and inclination vectors parallel and of equal length r: seen along the
///             track the chaser circles the target at r (D'Amico & Montenbruck 2006), wherever
///             along the track it drifts. At a*dl = 0 its distance is r to sqrt(5) r.
/// Abort       To such an orbit of at least `safe_m`, a*da away from the target, a*dl let go: two
///             burns half a revolution apart; of all phases and both orders the plan that keeps the
///             largest distance, up to `safe_m`, and of those the cheapest.
/// Checked by  test_suites/unit/flight_sw/rpo_kit/guidance_test.cpp
#pragma once

#include "rpo_kit/guidance/transfer.hpp"

namespace rpo_kit {

/// @param radius_m  Of the circle across the track. @param phase_rad  Of both vectors.
flight_support::RelativeElements safe_orbit(double along_track_m, double radius_m,
                                            double phase_rad);

/// The phase that both vectors should have if they are to change least: that of the longer one.
double common_phase_rad(const flight_support::RelativeElements& a_roe);

/// @param safe_m  Radius of the ellipse. @param drift_m  a*da with which it leaves, away from the
///                target on the side where it is.
/// @return false only if `now` is not finite.
bool plan_abort(const flight_support::RelativeOrbit& now, double safe_m, double drift_m,
                double lead_s, Transfer* transfer);

}  // namespace rpo_kit
