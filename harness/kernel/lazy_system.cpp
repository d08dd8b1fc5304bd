#include <orrery/harness/kernel/lazy_system.hpp>

#include <algorithm>
#include <stdexcept>
#include <string>

namespace orrery::internal {

LazyGrid::LazyGrid(SimTime start, Duration step) : start_(start), step_(step) {
  if (step <= Duration(0)) {
    throw std::invalid_argument("LazySystem: step = " + to_string(step) + ", accepted: above 0 s");
  }
}

SimTime LazyGrid::next(SimTime t) const {
  return start_ + ((t - start_) / step_ + 1) * step_;
}

SimTime LazyGrid::next(SimTime t, std::optional<SimTime> discontinuity) const {
  if (!discontinuity) return next(t);
  if (*discontinuity <= t) {
    throw std::logic_error("LazySystem: the model's next_discontinuity(" + to_string(t) +
                           ") is not after it, " + to_string(*discontinuity));
  }
  return std::min(next(t), *discontinuity);
}

void LazyGrid::require_not_past(const char* function, SimTime t, SimTime committed) {
  if (t >= committed) return;
  throw std::logic_error(std::string("LazySystem::") + function + ": t = " + to_string(t) +
                         " is before the last committed point, " + to_string(committed));
}

SimTime LazyGrid::require_within(SimTime from, SimTime edge, SimTime to) {
  if (from < edge && edge <= to) return edge;
  throw std::logic_error("LazySystem: the model's crossing at " + to_string(edge) +
                         " is not in the step from " + to_string(from) + " to " + to_string(to));
}

}  // namespace orrery::internal
