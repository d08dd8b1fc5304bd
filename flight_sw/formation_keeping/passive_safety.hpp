/// How near a plan may bring the deputy when something in it fails.
///
/// Radial and cross-track distance only: the along-track distance is what drifts when a burn is
/// lost, so nothing may rest on it. D'Amico & Montenbruck (2006); with a*da, Gaias & Ardaens
/// (2018).
///
/// Checked by  test_suites/unit/flight_sw/reconfiguration_planner_test.cpp
#pragma once

#include "relative_navigation.hpp"

namespace formation_keeping {

/// Impulses in the order of their times.
struct Plan {
  static constexpr int kMaxBurns = 48;
  Burn burns[kMaxBurns];
  int count = 0;
  double delta_v_mps = 0.0;      ///< sum of the burns' magnitudes
  double safe_distance_m = 0.0;  ///< see plan_safe_distance_m()
};

/// Smallest radial/cross-track distance [m] at any stage of the plan; and for two revolutions after
/// the loss of any one burn, both if the later ones are still flown and if none is.
double plan_safe_distance_m(const FormationState& now, const Plan& plan);

}  // namespace formation_keeping
