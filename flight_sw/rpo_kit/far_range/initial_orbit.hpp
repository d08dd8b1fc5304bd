/// A first relative orbit from directions alone.
///
/// Method      The range is what directions hardly show, so it is sampled: for distances a*dl
///             spread evenly in logarithm, on the side where the target is seen, the other five
///             elements are fitted by Gauss-Newton; from the best, all six by Levenberg-Marquardt
///             (the batch of ARTMS, Kruger, Koenig & D'Amico). Burns of the observer within the arc
///             are solved for with what is known of them as prior, so that their errors are in the
///             covariance.
/// Range       Shows by the curvature of the orbit (30 km: 2 mrad), by a*da that lets the scale of
///             the pattern grow, and, best, by burns.
///             With directions of a second observer it shows at once.
/// Valid for   arcs of half a revolution and more, 200 m to 200 km, two burns of the observer.
/// Checked by  test_suites/unit/flight_sw/rpo_kit/relative_orbit_filter_test.cpp
#pragma once

#include "rpo_kit/far_range/relative_orbit.hpp"

namespace rpo_kit {

struct BatchOptions {
  double nearest_m = 200.0, farthest_m = 200e3;  ///< of |a*dl| that are tried
  int samples = 16;
  int iterations = 20;      ///< of the last fit
  double prior_da_m = 500;  ///< 1-sigma: spiralling is slow
  double prior_m = 5000;    ///< 1-sigma of the e and i vectors
};

struct BatchMeasurement {
  Bearing bearing;
  Observer observer;  ///< at the bearing's time
};

struct InitialOrbit {
  std::int64_t t_ns = 0;  ///< of the last bearing
  flight_support::RelativeElements a_roe;
  flight_support::Matrix6 covariance;  ///< [m^2]
  double residual = 0.0;               ///< root mean square over 1-sigma, near 1 if all is well
};

constexpr int kMostBatchBurns = 2;

/// @param measurements  By ascending time, the observer's own first; those of a second observer
/// with
///                      a sigma that has its place's in it. @param burns  Of the observer within
///                      the arc, ascending.
/// @return false: fewer than six bearings, more burns than kMostBatchBurns, or no fit.
bool solve_initial_orbit(const BatchMeasurement* measurements, int count, const ObserverBurn* burns,
                         int burn_count, const BatchOptions& options, InitialOrbit* result);

}  // namespace rpo_kit
