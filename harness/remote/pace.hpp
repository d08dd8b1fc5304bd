/// Simulated time that goes with the host's clock, for processors that cannot wait.
#pragma once

#include <orrery/harness/kernel/time.hpp>

#include <cstdint>
#include <string>

namespace orrery {

/// --orrery_pace=RATE[,DEADLINE]: simulated seconds per host second; 0: as fast as it goes. An
/// event that begins later than DEADLINE behind its host time has missed it.
struct PaceSetting {
  double rate = 0;
  Duration deadline = std::chrono::milliseconds(10);
};

/// How late events began, in host time.
struct PaceFigures {
  std::uint64_t events = 0;  // waited for
  std::uint64_t missed = 0;  // of them later than the deadline
  Duration mean_lateness{0}, most_lateness{0};
};

/// Holds events back to their host time; never makes one earlier. What a run computes does not
/// depend on it, so the fingerprint is that of a run without.
class Pace {
 public:
  /// @throws std::invalid_argument  a rate that is negative or not finite, a negative deadline.
  explicit Pace(const PaceSetting& setting);
  bool on() const { return setting_.rate > 0; }
  /// From the first call on: sleeps until the host time of `t`. How much later it is then.
  Duration wait_for(SimTime t);
  bool missed(Duration lateness) const { return lateness > setting_.deadline; }
  PaceFigures figures() const;
  const PaceSetting& setting() const { return setting_; }

 private:
  PaceSetting setting_;
  std::int64_t begin_host_ns_ = -1;
  SimTime begin_;
  PaceFigures figures_;
  Duration sum_{0};
};

/// "1 x real time: 1204 events, 0.06 ms late on average, 2.1 ms at most; 0 missed 10 ms"
std::string to_string(const Pace& pace);

}  // namespace orrery
