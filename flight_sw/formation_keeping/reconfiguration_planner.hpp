/// Plans few impulses, in closed form, from one set of relative orbital elements to another.
///
/// Burns       support/orbit/closed_form_impulses.hpp, at passages of one phase, half revolutions
/// apart. Joint       Where the changes of a*de and a*di have the same phase, or nearly, one vector
///             impulse does both, and costs the root of the squares rather than the sum. The phase
///             is then that of a*di. Burns apart, each at its own phase, are tried too; the cheaper
///             plan wins.
/// Choice      Every triple of opportunities is solved. Among those within 2 % of the least
///             delta-v, the one that ends first and is passively safe
///             (support/orbit/passive_safety.hpp). More burns than three only where a limit on the
///             single impulse asks for them.
/// Checked by  test_suites/unit/flight_sw/reconfiguration_planner_test.cpp
#pragma once

#include <cstdint>

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

/// The same for an estimate: support/orbit/passive_safety.hpp.
double plan_safe_distance_m(const FormationState& now, const Plan& plan);

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

/// What a_roe will lack at the goal's end if nothing is done: goal less prediction [m].
RelativeElements predicted_miss(const FormationState& now, const Goal& goal);

class ReconfigurationPlanner {
 public:
  explicit ReconfigurationPlanner(const PlannerOptions& options) : options_(options) {}

  /// @param miss  What to make up at the goal's end [m]: predicted_miss(), or zero in elements that
  ///              shall be left alone.
  /// @return false if the window has no opportunity, the impulse limit cannot be kept, or no plan
  ///         is as safe as the options ask (or as the present state, where that is less).
  bool plan(const FormationState& now, const Goal& goal, const RelativeElements& miss,
            const BurnWindow& window, Plan* plan) const;

 private:
  PlannerOptions options_;
};

}  // namespace formation_keeping
