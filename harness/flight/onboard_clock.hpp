/// The clock of one spacecraft, as its flight software reads it.
#pragma once

#include <orrery/harness/kernel/time.hpp>

#include <cmath>
#include <cstdint>

namespace orrery {

/// Onboard time = truth + offset + drift * (truth - reference), in ns since the GPS epoch. What has
/// drifted is rounded to whole ns: between two jumps the clock never runs backwards.
class OnboardClock {
 public:
  static constexpr double kMostDrift_sps = 0.01;

  std::int64_t onboard_ns(SimTime truth) const {
    return to_ns(truth) + to_ns(offset_) + drifted_ns(truth);
  }
  /// The first instant at which the clock shows `onboard_ns` or more; times beyond the range of
  /// SimTime are its last instant.
  SimTime truth(std::int64_t onboard_ns) const {
    const std::int64_t offset = to_ns(offset_);
    if (offset < 0 && onboard_ns > INT64_MAX + offset) return from_ns(INT64_MAX);
    const SimTime undrifted = from_ns(onboard_ns - offset);
    return drift_sps_ == 0 ? undrifted : drifting_truth(undrifted, onboard_ns);
  }

  /// Onboard time less truth at that instant.
  Duration offset(SimTime at) const { return Duration(onboard_ns(at) - to_ns(at)); }
  double drift_sps() const { return drift_sps_; }
  /// From that instant on; the drift stays.
  void set_offset(Duration offset, SimTime at) {
    offset_ = offset;
    reference_ = at;
  }
  void jump(Duration by) { offset_ += by; }
  /// Seconds per second, of at most kMostDrift_sps either way; what the clock shows at that instant
  /// stays.
  void set_drift(double drift_sps, SimTime at) {
    set_offset(offset(at), at);
    drift_sps_ = drift_sps;
  }

 private:
  std::int64_t drifted_ns(SimTime truth) const {
    if (drift_sps_ == 0) return 0;
    // A double holds 104 days of ns exactly; beyond, its steps of 2 ns are nothing when multiplied.
    return std::llround(drift_sps_ * static_cast<double>(to_ns(truth) - to_ns(reference_)));
  }
  SimTime drifting_truth(SimTime undrifted, std::int64_t onboard_ns) const {
    constexpr double kFar_ns = 4e18;  // 127 years, when a tick has been asked for that never comes
    const double shown_ns =
        static_cast<double>(to_ns(undrifted)) - static_cast<double>(to_ns(reference_));
    if (std::fabs(shown_ns) > kFar_ns) return undrifted;
    const auto shown = [this](std::int64_t t) { return this->onboard_ns(from_ns(t)); };
    // Right to some ns; then to the first.
    std::int64_t t = to_ns(reference_) + std::llround(shown_ns / (1 + drift_sps_));
    while (shown(t) < onboard_ns) t += onboard_ns - shown(t);
    while (shown(t - 1) >= onboard_ns) --t;
    return from_ns(t);
  }

  Duration offset_{0};
  SimTime reference_{};
  double drift_sps_ = 0;
};

}  // namespace orrery
