/// Impulses at given instants that make up a given difference of relative elements, in closed form.
///
/// In plane    Tangential impulses half revolutions apart. With three, a 3x3 system for a*da, a*de
///             along the burns' phase and a*dl (Gaias & D'Amico 2015); with two, a*dl is let go
///             (D'Amico & Montenbruck 2006), with one a*de too. With more, equal shares of a*de and
///             the smallest correction of them (least squares) that meets all three.
/// The rest    a*de across the phase by radial and a*di by normal impulses, shared among the burns
///             in proportion to their tangential parts: a*de and a*di then change together, step by
///             step, and stay parallel if they were.
/// Drift       An impulse counts by its effect at the end of the J2 drift behind it, not at once.
/// Checked by  test_suites/unit/flight_sw/reconfiguration_planner_test.cpp
#pragma once

#include <cstdint>

#include "relative_elements.hpp"

namespace flight_support {

/// An instant for a burn, and what one there does to a_roe at the end [m per m/s].
struct Opportunity {
  std::int64_t t_ns;
  Matrix<6, 3> effect;
};

constexpr int kMaxOpportunities = 24;

/// Burns of a plan: each has an in-plane part, and a normal part that may be at another instant.
struct BurnChoice {
  const Opportunity* in_plane[kMaxOpportunities];
  const Opportunity* normal[kMaxOpportunities];
  int count;
  double in_plane_phase_rad;  ///< argument of latitude, modulo pi, of all in-plane parts
  double normal_phase_rad;    ///< likewise of the normal parts
};

/// Delta-v per burn [m/s].
struct Impulses {
  double radial[kMaxOpportunities] = {};
  double tangential[kMaxOpportunities] = {};
  double normal[kMaxOpportunities] = {};
};

/// @param miss  What the impulses shall add up to at the end [m].
/// @return false if the burns cannot: no two of them may be at the same instant.
bool solve_impulses(const BurnChoice& choice, const RelativeElements& miss, Impulses* impulses);

/// What the impulses add up to at the end [m].
RelativeElements effect_of(const BurnChoice& choice, const Impulses& impulses);

/// Sum of the magnitudes; parts at one instant are one vector [m/s].
double delta_v_mps(const BurnChoice& choice, const Impulses& impulses);

}  // namespace flight_support
