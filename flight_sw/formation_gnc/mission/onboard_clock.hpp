/// What the onboard clock shows against GPS time, from the receiver's epochs.
///
/// Method      Each epoch comes to flight software at the instant it speaks of, or later by what
///             the computer had to do; so of the last eight differences the largest is the best.
/// Error       The receiver's own (below 1 us when it steers) plus the least delay of the eight.
///             After a step of the onboard clock ahead, wrong by the step for eight epochs; back,
///             for one.
#pragma once

#include <cstdint>

namespace formation_gnc {

class OnboardClock {
 public:
  void compare(std::int64_t epoch_GPS_ns, std::int64_t now_onboard_ns) {
    difference_[count_ % kEpochs] = epoch_GPS_ns - now_onboard_ns;
    ++count_;
    offset_ns_ = difference_[0];
    for (std::uint32_t k = 1; k < kEpochs && k < count_; ++k) {
      if (difference_[k] > offset_ns_) offset_ns_ = difference_[k];
    }
  }
  bool known() const { return count_ > 0; }
  /// Before the first epoch the onboard clock is taken as it is.
  std::int64_t gps_ns(std::int64_t onboard_ns) const { return onboard_ns + offset_ns_; }
  std::int64_t onboard_ns(std::int64_t gps_ns) const { return gps_ns - offset_ns_; }

 private:
  static constexpr std::uint32_t kEpochs = 8;
  std::int64_t difference_[kEpochs] = {};
  std::int64_t offset_ns_ = 0;
  std::uint32_t count_ = 0;
};

}  // namespace formation_gnc
