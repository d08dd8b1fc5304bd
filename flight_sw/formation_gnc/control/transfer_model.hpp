/// The linear model of a transfer: instants at which a burn may be, and what one there does.
#pragma once

#include <vector>

#include "formation_gnc/control/reconfiguration_planner.hpp"
#include "support/orbit/closed_form_impulses.hpp"

namespace formation_gnc {

/// Instant `t_ns` and the effect at the goal's end, [m per m/s].
using Candidate = flight_support::Opportunity;

struct Window {
  std::int64_t first_ns, last_ns;
};
/// Where burns may be: options, with their defaults put in.
Window burn_window(const TransferStart& start, const TransferGoal& goal,
                   const TransferOptions& options);

std::vector<Candidate> transfer_candidates(const TransferStart& start, const TransferGoal& goal,
                                           const TransferOptions& options);

/// The chief's mean elements at `t_ns`.
flight_support::OrbitElements chief_at(const TransferStart& start, std::int64_t t_ns);

/// Goal less what comes of itself [m]; a*dl is zero if it is free.
flight_support::RelativeElements transfer_miss(const TransferStart& start,
                                               const TransferGoal& goal);

/// What impulses add up to at the goal's end [m].
flight_support::RelativeElements total_effect(const std::vector<Candidate>& candidates,
                                              const std::vector<flight_support::Vec3>& dv_RTN);

}  // namespace formation_gnc
