/// Modelled execution time: how long a call keeps its processor in simulated time.
#pragma once

#include <orrery/harness/kernel/random.hpp>
#include <orrery/harness/kernel/time.hpp>

#include <chrono>
#include <concepts>
#include <cstdint>

namespace orrery {

/// `.execution_time = 30us`, or one of the functions below. All throw std::invalid_argument for
/// what is negative, not finite, or the wrong way round.
class ExecutionTime {
 public:
  ExecutionTime() = default;  // none
  template <class Rep, class Period>
  requires std::convertible_to<std::chrono::duration<Rep, Period>, Duration> ExecutionTime(
      std::chrono::duration<Rep, Period> constant)
      : ExecutionTime(Duration(constant)) {}
  ExecutionTime(Duration constant);

  /// Evenly between the two.
  static ExecutionTime uniform(Duration low, Duration high);
  /// Half of the calls take less than `median`; the logarithm has this standard deviation.
  static ExecutionTime log_normal(Duration median, double sigma);
  /// base + edges x time per edge, for libraries that were built with COUNT_WORK. Repeats exactly
  /// for one binary of the library.
  static ExecutionTime counted_work(double ns_per_edge, Duration base = Duration{0});

  bool draws() const { return kind_ == Kind::kUniform || kind_ == Kind::kLogNormal; }
  bool counts_work() const { return kind_ == Kind::kWork; }
  /// One draw from `stream` if draws(). At most a year.
  Duration of_call(RandomStream* stream, std::uint64_t work) const;

 private:
  enum class Kind : std::uint8_t { kConstant, kUniform, kLogNormal, kWork };
  Kind kind_ = Kind::kConstant;
  Duration a_{0}, b_{0};
  double x_ = 0;
};

}  // namespace orrery
