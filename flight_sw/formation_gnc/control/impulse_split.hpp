/// The transfer as a second-order cone program.
///
/// Unknowns v_k (3) and s_k, for each candidate: min sum s_k subject to |v_k| <= s_k <= max, the
/// goal, and e and i vectors at the waypoints.
#pragma once

#include "formation_gnc/control/transfer_model.hpp"

namespace formation_gnc {

struct ImpulseSplit {
  bool found = false;
  std::vector<flight_support::Vec3> dv_RTN = {};  ///< of each candidate [m/s]; zero if unused
  int iterations = 0;                             ///< of the solver, in all
};

/// @param waypoints  Instead of options.waypoints.
ImpulseSplit split_by_cone_program(const TransferStart& start, const TransferGoal& goal,
                                   const TransferOptions& options, int waypoints,
                                   const std::vector<Candidate>& candidates);

/// Closed-form impulses at the passages of the phases of e and i vector, split and corrected.
ImpulseSplit split_closed_form(const TransferStart& start, const TransferGoal& goal,
                               const TransferOptions& options,
                               const std::vector<Candidate>& candidates);

/// max lambda' miss subject to |E_k' lambda| <= 1 for all candidates: the dual of splitting without
/// limits, [m/s]. Negative if it could not be solved.
double joint_bound_mps(const TransferGoal& goal, const flight_support::RelativeElements& miss,
                       const std::vector<Candidate>& candidates);

}  // namespace formation_gnc
