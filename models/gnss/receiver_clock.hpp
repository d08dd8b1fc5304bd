/// The clock of a GNSS receiver, free or steered to GPS time by its own solution.
#pragma once

#include <orrery/harness/kernel/random.hpp>
#include <orrery/harness/kernel/time.hpp>

namespace orrery {

struct ReceiverClockOptions {
  double h0_s = 2e-20;        // white frequency noise; 0 for none
  double h_2_ps = 1e-22;      // random walk of frequency [1/s]
  bool steered = true;        // |bias| stays below 100 ns; false: jumps by 1 ms at 0.5 ms
  double initial_bias_s = 0;  // at the first power-on, below 1 ms
  double initial_drift_sps = 0;
  double sigma_bias_s = 5e-9;  // of the receiver's own estimates, which steer it
  double sigma_drift_sps = 1e-10;
  double steering_time_s = 20;  // the bias falls by e in this time
};

/// Two states, bias b and drift f, moved from epoch to epoch.
///
/// Method   b += f dt + w_b, f += w_f; variances h0/2 dt + 2 pi^2 h-2 dt^3 / 3 and 2 pi^2 h-2 dt
///          (Brown & Hwang; correlation between the two neglected). Steering sets f, as estimated,
///          to -(1 - exp(-dt/T)) b/dt. With the default values a steered bias stays within 20 ns
///          (1 sigma) at any rate from 10 Hz to 1/60 Hz.
class ReceiverClock {
 public:
  /// @throws std::invalid_argument  an option out of range.
  explicit ReceiverClock(const ReceiverClockOptions& options);

  /// To the next epoch, `dt_s` later: free motion since the last, then the correction for the next
  /// interval. Two normal_triples().
  void advance(double dt_s, RandomStream& noise);
  /// A jump of the bias [s]; beyond 1 ms the whole milliseconds are taken out again.
  void jump(double by_s);
  /// As after the first solution: what is left is the error of that solution.
  void set_to_gps_time(RandomStream& noise);

  double bias_s() const { return bias_s_; }  // receiver's time minus GPS time
  double drift_sps() const { return drift_sps_; }
  const ReceiverClockOptions& options() const { return options_; }

 private:
  void take_out_milliseconds();

  ReceiverClockOptions options_;
  double bias_s_, drift_sps_;
};

}  // namespace orrery
