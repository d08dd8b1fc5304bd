/// How near a plan may bring the deputy when something in it fails.
///
/// Radial and cross-track distance only: the along-track distance is what drifts when a burn is
/// lost, so nothing may rest on it. D'Amico & Montenbruck (2006); with a*da, Gaias & Ardaens
/// (2018).
///
/// Checked by  test_suites/unit/flight_sw/reconfiguration_planner_test.cpp
#pragma once

#include <cstdint>

#include "burn.hpp"
#include "relative_elements.hpp"

namespace flight_support {

/// A mean relative orbit at an instant.
struct RelativeOrbit {
  std::int64_t t_ns = 0;   ///< GPS time, ns since 1980-01-06
  OrbitElements chief;     ///< mean
  RelativeElements a_roe;  ///< [m], mean
};

/// Smallest radial/cross-track distance [m] at any stage of a plan; and for two revolutions after
/// the loss of any one burn, both if the later ones are still flown and if none is.
/// @param burns  `count` of them, by ascending time, none before `now`.
double plan_safe_distance_m(const RelativeOrbit& now, const Burn* burns, int count);

}  // namespace flight_support
