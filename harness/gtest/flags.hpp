/// Flags of every test program. Each --orrery_x is also the environment variable ORRERY_X; the flag
/// wins.
#pragma once

#include <orrery/harness/kernel/simulator_only.hpp>
#include <orrery/harness/kernel/time.hpp>
#include <orrery/harness/remote/pace.hpp>
#include <orrery/harness/remote/target_address.hpp>

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace orrery {

/// What --orrery_record asks for.
struct RecordSetting {
  enum class Mode { kOff, kEvents, kPeriodic };
  Mode mode = Mode::kPeriodic;
  std::optional<Duration> period = {};  // empty: 1 s in runs up to 24 h, then 10 s
};

/// Levels are those of the flight ABI: 0 debug, 1 info, 2 warning, 3 error; 4 prints nothing.
struct LogSetting {
  int level = 4;
  std::string spacecraft = {};  // empty: all
};

struct Flags {
  std::uint64_t seed = 1;        // --orrery_seed=N, below 2^53
  std::optional<int> runs = {};  // --orrery_runs=N: n of every Seeds()
  /// --orrery_run=I: run I alone, in this process, of a fly_campaign(), a Seeds(), or with seed
  /// base + I.
  std::optional<std::uint32_t> run = {};
  std::optional<int> jobs = {};  // --orrery_jobs=N: runs at a time of a fly_campaign()
  /// --orrery_set=NAME=VALUE: in place of what World::draw and disperse draw; repeatable.
  std::map<std::string, double> set = {};
  std::string campaign = {};  // --orrery_campaign=DIR: judge these results instead of flying
  std::string out = {};       // --orrery_out=DIR; empty: write nothing
  std::optional<Duration> break_at = {};  // --orrery_break_at=SECONDS since the world's start
  RecordSetting record = {};              // --orrery_record=off|events|PERIOD (1s, 500ms, 10)
  LogSetting log = {};                    // --orrery_log=LEVEL[,SPACECRAFT]
  bool verify_determinism = false;  // --orrery_verify_determinism: run each test twice, compare
  bool shrink = false;              // --orrery_shrink: reduce a failing test's faults, print them
  std::uint64_t shuffle_ties = 0;  // --orrery_shuffle_ties=N: ties in another order, seeded; 0: not
  /// --orrery_target=SPACECRAFT=HOW, or SPACECRAFT/PROCESS=HOW, once for each; in ORRERY_TARGET
  /// separated by "; ". HOW as in parse_target_address().
  struct Target {
    std::string process;
    TargetAddress address;
  };
  std::vector<Target> targets = {};
  std::optional<PaceSetting> pace = {};  // --orrery_pace=RATE[,DEADLINE] (1, or 0.5,20ms); 0: none
  /// --orrery_progress: a line per twentieth of a run, and a result table. Empty: one line that
  /// changes, on a terminal alone; false: never.
  std::optional<bool> progress = {};
};

/// Reads and removes the --orrery_* flags. Call it before testing::InitGoogleTest, which evaluates
/// Seeds(n). A flag that is unknown, malformed or not available ends the program with exit code 2
/// and one line that says so.
void Init(int* argc, char** argv);

/// As read by Init, else by the environment alone.
const Flags& flags();
/// False until Init has run.
bool initialised();
/// How this program was started, for replay commands.
const std::string& program_name();
/// The --orrery_* flags that it was given.
const std::vector<std::string>& given_flags();

/// Parses arguments (without the program's name) over an environment ("ORRERY_SEED=3").
/// @throws std::invalid_argument  with the text that Init prints.
Flags parse_flags(const std::vector<std::string>& arguments,
                  const std::vector<std::string>& environment);

}  // namespace orrery
