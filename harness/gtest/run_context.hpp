/// What a failure message needs to know of the runs that are alive.
#pragma once

#include <orrery/harness/kernel/time.hpp>

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace orrery {

struct RunSnapshot {
  std::uint64_t seed = 0;
  SimTime now;
  Duration elapsed{};
  std::uint64_t events = 0;
  std::string fingerprint;
  std::vector<std::string> last_events;  // "delivery to deputy from chief-deputy at 3610 s"
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
  friend std::optional<Duration> live_run_elapsed();
  std::function<RunSnapshot()> snapshot_;
};

/// Text on all live runs of this thread, oldest first; empty if there is none.
std::string describe_live_runs();
/// Simulated time of the youngest live run.
std::optional<Duration> live_run_elapsed();
/// A world is about to be made in the running test, which then has something to replay, be it that
/// the world cannot be made.
void note_world();
bool world_was_noted();
/// The listener says which test runs: GoogleTest itself cannot be asked while it reports a failure
/// (it holds a lock). Empty: none.
void set_current_test(const std::string& suite_and_name);
/// "./x_test --gtest_filter=A.B --orrery_seed=3", for the running test; empty outside of one.
std::string replay_command();
/// The same under gdb, stopping just before `elapsed`; without one, where an exception is thrown.
std::string debug_command(std::optional<Duration> elapsed);

}  // namespace orrery
