/// The part of a run that a matcher looks at.
#pragma once

#include <orrery/harness/kernel/when.hpp>
#include <orrery/harness/record/channel.hpp>

#include <optional>
#include <string>

namespace orrery {

/// [from, until) since the channel's start: always(), from(10min), until(1h), between(10min, 1h),
/// or after an event, after(channel("dsc/mode").only("SAFE")) && until(2h).
class TimeWindow {
 public:
  /// @throws std::invalid_argument  an instant, a number of packets or a probability.
  TimeWindow(const When& window);  // NOLINT: from(10min) is a window

  Duration from() const { return from_; }
  const std::optional<Duration>& until() const { return until_; }
  bool contains(Duration elapsed) const {
    return elapsed >= from_ && (!until_ || elapsed < *until_);
  }
  /// "", " from 600 s", " after \"dsc/mode SAFE\" at 12.5 s"
  const std::string& text() const { return text_; }
  /// The event that it begins with did not happen: matchers fail.
  bool waits_in_vain() const { return waits_in_vain_; }

  friend TimeWindow operator&&(const TimeWindow& a, const TimeWindow& b);
  friend TimeWindow after(const Channel& event, Duration later);

 private:
  Duration from_{};
  std::optional<Duration> until_;
  std::string text_;
  bool waits_in_vain_ = false;
};

TimeWindow operator&&(const TimeWindow& a, const TimeWindow& b);

/// From `later` after the first sample of `event` on, as the channel is now. If it has none, what
/// is asked of the window fails. @throws std::invalid_argument  later < 0.
TimeWindow after(const Channel& event, Duration later = Duration::zero());

}  // namespace orrery
