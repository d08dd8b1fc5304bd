/// Plans a reconfiguration of the formation as many small impulses, passively safe on the way.
///
/// Model       Mean relative elements under J2 (Koenig, Guffanti & D'Amico 2017) with the rate of
///             a*da by differential drag as a seventh state; impulses by Gauss's equations.
/// Split       Candidate instants `spacing_s` apart; min sum |dv_k| subject to the goal, to
///             waypoints, and to |dv_k| <= max: a second-order cone program (socp_solver.hpp).
///             Impulses below the smallest possible are dropped and the rest is solved again.
/// Waypoints   e and i vectors are led from start to goal in proportion to time, both ends drifting
///             as they would anyway: vectors that are parallel at both ends stay so, which keeps
///             the formation passively safe (D'Amico & Montenbruck 2006).
/// Fallback    If the program cannot be solved: closed-form impulses (closed_form_impulses.hpp),
///             each split into equal parts symmetric in time about it.
/// Memory      operator new, 2.5 kB per candidate while planning.
/// Checked by  test_suites/unit/flight_sw/formation_gnc/transfer_planner_test.cpp
#pragma once

#include <cstdint>
#include <vector>

#include "formation_gnc/control/impulse.hpp"
#include "support/orbit/passive_safety.hpp"

namespace formation_gnc {

/// What is known when planning. `orbit.a_roe` is mean, of the deputy, which manoeuvres.
struct TransferStart {
  flight_support::RelativeOrbit orbit = {};
  double a_da_rate_mps = 0.0;  ///< d(a*da)/dt by differential drag [m/s]
};

struct TransferGoal {
  std::int64_t end_ns = 0;
  flight_support::RelativeElements a_roe = {};  ///< [m], mean, at `end_ns`
  bool along_track_free = false;                ///< a*dl is left to itself
};

struct TransferOptions {
  ImpulseLimits limits = {};
  std::int64_t first_ns = 0;  ///< no burn before; 0: `spacing_s` after the start
  std::int64_t last_ns = 0;   ///< no burn after; 0: the end
  int waypoints = 2;          ///< 0 to 8
  int max_candidates = 600;   ///< 8 to 2000; a longer window is sampled at wider spacing
  double budget_mps = 1.0;    ///< what propellant allows for this transfer
  /// Smallest radial/cross-track distance accepted [m], also for two revolutions after the loss of
  /// any one burn. Where start or goal have less themselves, 95 % of theirs counts.
  double min_radial_normal_m = 10.0;
  bool use_cone_program = true;  ///< false: the fallback at once
};

enum class PlanStatus {
  kPlanned,     ///< by the cone program
  kFallback,    ///< by splitting closed-form impulses
  kInfeasible,  ///< neither found a way within the impulse limits
  kUnsafe,      ///< there is one, but it is not passively safe
  kOverBudget,  ///< there is one, but it costs more than the budget
  kBadInput     ///< not finite, no time for a burn, or an option out of its range
};
const char* to_string(PlanStatus status);

struct TransferPlan {
  PlanStatus status = PlanStatus::kBadInput;
  std::vector<flight_support::Burn> burns = {};  ///< by ascending time, in the deputy's RTN
  double delta_v_mps = 0.0;                      ///< sum of the magnitudes
  double safe_distance_m = 0.0;                  ///< see TransferOptions::min_radial_normal_m
  flight_support::RelativeElements miss = {};    ///< of the goal, by the model [m]
  int candidates = 0, solver_iterations = 0;

  bool usable() const { return status == PlanStatus::kPlanned || status == PlanStatus::kFallback; }
};

class ReconfigurationPlanner {
 public:
  explicit ReconfigurationPlanner(const TransferOptions& options = {}) : options_(options) {}

  TransferPlan plan(const TransferStart& start, const TransferGoal& goal) const;

 private:
  TransferOptions options_;
};

/// Delta-v [m/s] with unlimited impulses.
struct DeltaVBounds {
  double joint_mps = 0.0;     ///< the least there is: one impulse may serve all elements
  double separate_mps = 0.0;  ///< n a (|ddi| + max(|dde|/2, |dda|/2, |ddl| / (3 n T)))
};
/// Of the same candidate instants; the joint one by the dual of the cone program.
DeltaVBounds delta_v_bounds(const TransferStart& start, const TransferGoal& goal,
                            const TransferOptions& options = {});

/// a_roe at `t_ns` if nothing is done [m].
flight_support::RelativeElements coast(const TransferStart& start, std::int64_t t_ns);

}  // namespace formation_gnc
