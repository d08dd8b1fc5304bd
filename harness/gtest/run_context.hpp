/// What a failure message needs to know of the runs that are alive.
#pragma once

#include <orrery/harness/kernel/time.hpp>

#include <cstdint>
#include <functional>
#include <string>

namespace orrery {

struct RunSnapshot {
  std::uint64_t seed = 0;
  SimTime now;
  Duration elapsed{};
  std::uint64_t events = 0;
  std::string fingerprint;
  std::string last_event;  // "delivery to deputy from chief-deputy at 3610 s", or empty
  std::string spacecraft;  // one line on each: "deputy: flight code alive, heap 12 kB"
};

/// While one of these lives, failures print its snapshot. Worlds hold one.
class LiveRun {
 public:
  explicit LiveRun(std::function<RunSnapshot()> snapshot);
  ~LiveRun();
  LiveRun(const LiveRun&) = delete;
  LiveRun& operator=(const LiveRun&) = delete;

 private:
  friend std::string describe_live_runs();
  std::function<RunSnapshot()> snapshot_;
};

/// Text on all live runs of this thread, oldest first; empty if there is none.
std::string describe_live_runs();
/// The listener says which test runs: GoogleTest itself cannot be asked while it reports a failure
/// (it holds a lock). Empty: none.
void set_current_test(const std::string& suite_and_name);
/// "./x_test --gtest_filter=A.B --orrery_seed=3", for the running test; empty outside of one.
std::string replay_command();
/// The same under gdb, stopping just before `elapsed`.
std::string debug_command(Duration elapsed);

}  // namespace orrery
