#include "formation_gnc/control/transfer_model.hpp"

#include <cmath>

#include "support/orbit/constants.hpp"

namespace formation_gnc {

using namespace flight_support;

Window burn_window(const TransferStart& start, const TransferGoal& goal,
                   const TransferOptions& options) {
  const std::int64_t soon = start.orbit.t_ns + nanoseconds(options.limits.spacing_s);
  return {options.first_ns != 0 ? options.first_ns : soon,
          options.last_ns != 0 ? options.last_ns : goal.end_ns};
}

OrbitElements chief_at(const TransferStart& start, std::int64_t t_ns) {
  return propagate_mean(start.orbit.chief, seconds(t_ns - start.orbit.t_ns));
}

std::vector<Candidate> transfer_candidates(const TransferStart& start, const TransferGoal& goal,
                                           const TransferOptions& options) {
  const Window window = burn_window(start, goal, options);
  const double span_s = seconds(window.last_ns - window.first_ns);
  if (!(span_s >= 0.0)) return {};
  const double spacing_s =
      std::fmax(options.limits.spacing_s, span_s / (options.max_candidates - 1));
  // The last one lies on the border to rounding.
  const int count = static_cast<int>(std::floor(span_s / spacing_s + 1e-9)) + 1;
  std::vector<Candidate> candidates(static_cast<std::size_t>(count));
  for (int k = 0; k < count; ++k) {
    Candidate& candidate = candidates[static_cast<std::size_t>(k)];
    candidate.t_ns = window.first_ns + nanoseconds(k * spacing_s);
    const OrbitElements at = chief_at(start, candidate.t_ns);
    candidate.effect =
        state_transition(at, seconds(goal.end_ns - candidate.t_ns)) * control_input(at);
  }
  return candidates;
}

// A steady change of a*da counts, at the end, half of what it would count had it all been there
// from the beginning: the column of a*da grows linearly with time.
RelativeElements coast(const TransferStart& start, std::int64_t t_ns) {
  const double dt_s = seconds(t_ns - start.orbit.t_ns);
  const Matrix6 Phi = state_transition(start.orbit.chief, dt_s);
  RelativeElements later = Phi * start.orbit.a_roe;
  const double da_m = start.a_da_rate_mps * dt_s;
  later[kDa] += da_m;
  for (int k = kDl; k <= kDiy; ++k) later[k] += 0.5 * Phi(k, kDa) * da_m;
  return later;
}

RelativeElements transfer_miss(const TransferStart& start, const TransferGoal& goal) {
  RelativeElements miss = goal.a_roe - coast(start, goal.end_ns);
  if (goal.along_track_free) miss[kDl] = 0.0;
  return miss;
}

RelativeElements total_effect(const std::vector<Candidate>& candidates,
                              const std::vector<Vec3>& dv_RTN) {
  RelativeElements sum;
  for (std::size_t k = 0; k < candidates.size(); ++k) {
    sum = sum + candidates[k].effect * dv_RTN[k];
  }
  return sum;
}

}  // namespace formation_gnc
