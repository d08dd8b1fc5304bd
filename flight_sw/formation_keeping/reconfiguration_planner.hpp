/// Plans few impulses, in closed form, from one set of relative orbital elements to another.
///
/// In plane    Three tangential burns half revolutions apart reach a*da, a*dl and a*de at the end:
///             3x3 linear solve (Gaias & D'Amico 2015). With two opportunities left a*dl is let go
///             (D'Amico & Montenbruck 2006), with one a*de too.
/// Out of      Normal burns at the phase of the change of a*di, shared among the tangential burns
/// in plane       proportion, so that a*de and a*di shrink together and stay parallel. Joint Where
/// both phases agree, or nearly, one vector impulse does both, and costs the root of
///             the squares rather than the sum. The phase is then that of a*di, and what remains of
///             a*de across it is done by a radial part. Burns apart are tried too; the cheaper plan
///             wins.
/// Drift       All burns are mapped to the end by the J2 state transition matrix: a goal is met at
/// its
///             end epoch, not at the last burn.
/// Choice      Every triple of opportunities inside the window is solved. Among those within 2 % of
/// the
///             least delta-v, the one that ends first and is passively safe.
/// Safety      Radial and cross-track distance at every stage of the plan, and for two revolutions
/// after
///             the loss of any one burn, with the later burns going on and without them.
/// Checked by  test_suites/unit/flight_sw/reconfiguration_planner_test.cpp
#pragma once

#include <cstdint>

#include "relative_navigation.hpp"

namespace formation_keeping {

struct PlannerOptions {
  double min_radial_normal_m = 60.0;  ///< what "passively safe" means
  double max_impulse_mps = 0.0;       ///< of one burn; 0: unlimited
  double min_impulse_mps = 1e-4;      ///< smaller burns are left out
};

/// Be at `a_roe` [m] at `end_ns`.
struct Goal {
  RelativeElements a_roe;
  std::int64_t end_ns = 0;
};

/// No burn before `first_ns` or after `last_ns`.
struct BurnWindow {
  std::int64_t first_ns = 0, last_ns = 0;
};

struct Plan {
  static constexpr int kMaxBurns = 24;
  Burn burns[kMaxBurns];  ///< by ascending time
  int count = 0;
  double delta_v_mps = 0.0;      ///< sum of the burns' magnitudes
  double safe_distance_m = 0.0;  ///< smallest radial/cross-track distance, see Safety
};

/// What a_roe will lack at the goal's end if nothing is done: goal less prediction [m].
RelativeElements predicted_miss(const FormationState& now, const Goal& goal);

/// The goal's elements, and those of every stage of the plan with and without each burn, seen from
/// `now`.
double plan_safe_distance_m(const FormationState& now, const Plan& plan);

class ReconfigurationPlanner {
 public:
  explicit ReconfigurationPlanner(const PlannerOptions& options) : options_(options) {}

  /// @param miss  What to make up at the goal's end [m]: predicted_miss(), or zero in elements that
  ///              shall be left alone.
  /// @return false if the window has no opportunity, the impulse limit cannot be kept, or no plan
  /// is as
  ///         safe as the options ask or, where that is already lost, as the present state.
  bool plan(const FormationState& now, const Goal& goal, const RelativeElements& miss,
            const BurnWindow& window, Plan* plan) const;

 private:
  PlannerOptions options_;
};

}  // namespace formation_keeping
