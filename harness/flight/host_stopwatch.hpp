/// Host time, for reports only: nothing in a run may depend on it.
#pragma once

#include <orrery/harness/kernel/time.hpp>

#include <chrono>
#include <cstdint>
#if defined(__x86_64__)
#include <x86intrin.h>
#endif

namespace orrery::internal {

/// Sums up spans of some 100 ns, at a few ns each: counts cycles, and learns their length from the
/// system's clock when it is asked.
class HostStopwatch {
 public:
  void start() { started_ = ticks(); }
  void stop() {
    last_ = ticks() - started_;
    sum_ += last_;
  }
  /// In place of the span just measured: another processor told how long it took there.
  void replace_last(Duration span) {
    const std::chrono::duration<double, std::nano> elapsed =
        std::chrono::steady_clock::now() - first_time_;
    sum_ -= last_;
    last_ =
        static_cast<std::uint64_t>(static_cast<double>(to_ns(span)) *
                                   static_cast<double>(ticks() - first_ticks_) / elapsed.count());
    sum_ += last_;
  }
  std::uint64_t last_ticks() const { return last_; }
  Duration total() const { return duration(sum_); }
  /// Of so many ticks of any stopwatch, by what this one has seen since it was made.
  Duration duration(std::uint64_t of_ticks) const {
    const double elapsed_ticks = static_cast<double>(ticks() - first_ticks_);
    if (elapsed_ticks <= 0.0) return Duration{0};
    const std::chrono::duration<double, std::nano> elapsed =
        std::chrono::steady_clock::now() - first_time_;
    return Duration(
        static_cast<std::int64_t>(elapsed.count() * static_cast<double>(of_ticks) / elapsed_ticks));
  }

 private:
  static std::uint64_t ticks() {
#if defined(__x86_64__)
    return __rdtsc();
#else
    return static_cast<std::uint64_t>(std::chrono::steady_clock::now().time_since_epoch().count());
#endif
  }
  std::chrono::steady_clock::time_point first_time_ = std::chrono::steady_clock::now();
  std::uint64_t first_ticks_ = ticks();
  std::uint64_t started_ = 0, last_ = 0, sum_ = 0;
};

}  // namespace orrery::internal
