/// The clock of one spacecraft, as its flight software reads it.
#pragma once

#include <orrery/harness/kernel/time.hpp>

#include <cstdint>

namespace orrery {

/// Onboard time = truth + offset, both in ns since the GPS epoch. Drift and jumps go here.
class OnboardClock {
 public:
  std::int64_t onboard_ns(SimTime truth) const { return to_ns(truth) + to_ns(offset_); }
  /// The instant at which the clock shows `onboard_ns`; times beyond the range of SimTime are its
  /// last instant.
  SimTime truth(std::int64_t onboard_ns) const {
    const std::int64_t offset = to_ns(offset_);
    if (offset < 0 && onboard_ns > INT64_MAX + offset) return from_ns(INT64_MAX);
    return from_ns(onboard_ns - offset);
  }
  Duration offset() const { return offset_; }
  void set_offset(Duration offset) { offset_ = offset; }

 private:
  Duration offset_{0};
};

}  // namespace orrery
