/// Runs as child processes, several at a time.
#pragma once

#include <orrery/harness/gtest/run_record.hpp>
#include <orrery/harness/kernel/time.hpp>

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace orrery {

/// One run of a test program.
struct RunCommand {
  std::string program;  // a path; /proc/self/exe for this one
  std::string test;     // "Suite.Test": the filter is exact
  std::uint64_t base_seed = 1;
  std::uint32_t run = 0;
  std::vector<std::string> flags = {};  // further --orrery_* flags
  std::string name = {};                // argv[0], for replay commands; empty: program
};

/// Of each run, on the host.
struct RunLimits {
  Duration time = 10min;  // above 0
  /// Resident, looked at 50 times a second: what grows by a gigabyte in between goes that far. Of
  /// the run's own process. 0: none.
  std::uint64_t memory_bytes = 0;
};

/// The command that repeats a run in the shell, on one line.
std::string replay_command_of(const RunCommand& command);

/// Starts each run as fork and exec, without GTEST_* in its environment, in a process group of its
/// own, and ends it with this process. A run counts as passed only if it has left a record that
/// says so and names this test, this run and this seed, and its program returned 0: what runs
/// nothing does not pass.
class RunPool {
 public:
  /// @param jobs  Runs at a time, at least 1.
  /// @throws std::invalid_argument  either outside its range.
  RunPool(int jobs, const RunLimits& limits);
  /// Ends those that are going on.
  ~RunPool();
  RunPool(const RunPool&) = delete;
  RunPool& operator=(const RunPool&) = delete;

  bool has_room() const { return children_.size() < jobs_; }
  bool is_idle() const { return children_.empty(); }
  std::size_t in_flight() const { return children_.size(); }
  /// A program that cannot be started gives a record with the outcome `error`.
  /// @throws std::runtime_error  the system gives no process or no pipe.
  void start(const RunCommand& command);
  /// Records of those that ended, waiting at most that long for one; may be none.
  std::vector<RunRecord> finished(Duration at_most);
  /// Ends those that are going on; they leave no record.
  void kill_all();

 private:
  struct Child;
  void listen(Duration at_most);
  bool may_go_on(Child& child) const;
  bool has_ended(Child& child);

  std::size_t jobs_;
  RunLimits limits_;
  std::vector<std::unique_ptr<Child>> children_;
};

}  // namespace orrery
