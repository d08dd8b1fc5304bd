/// What one run of a campaign leaves for whoever started it: a line of JSON.
#pragma once

#include <orrery/harness/kernel/simulator_only.hpp>

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace testing {
class TestInfo;
}

namespace orrery {

/// Passed, failed and crashed are results of the run: final, and the same whenever it is repeated.
/// The others are what its host did to it, and say nothing about it.
enum class RunOutcome : std::uint8_t {
  kPassed,
  kFailed,   // an assertion, or flight code crashed and the test did not allow it
  kCrashed,  // the test program itself ended amid the test: by a signal, or a sanitizer's exit
  kTimeout,  // passed its time limit on the host
  kMemory,   // passed its memory limit on the host
  kKilled,   // by a signal that others send: SIGKILL, SIGTERM ...
  kError     // ended without having run anything, or could not be started
};
constexpr std::size_t kRunOutcomes = 7;
const char* to_string(RunOutcome outcome);
std::optional<RunOutcome> outcome_of(std::string_view word);
constexpr bool is_result(RunOutcome outcome) {
  return outcome <= RunOutcome::kCrashed;
}

/// A model parameter as this run had it.
struct DrawnDispersion {
  std::string name;          // "deputy/mass_kg"
  double value = 0;          // in the unit that the name ends in
  std::string distribution;  // "Normal(11, 0.11)"

  friend bool operator==(const DrawnDispersion&, const DrawnDispersion&) = default;
};

struct RunRecord {
  std::string test;        // "Suite.Test"
  std::uint32_t run = 0;   // index
  std::uint64_t seed = 0;  // base + index
  std::uint32_t runs = 0;  // that the test declares by Runs{n}; 0: not a fly_campaign()
  RunOutcome outcome = RunOutcome::kError;
  int exit_code = -1;  // -1: ended by a signal
  int signal = 0;
  std::string fingerprint = {};  // of its worlds, in the order of their ends, joined by ','
  double simulated_s = 0;        // of all worlds
  std::uint64_t events = 0;
  std::vector<std::pair<std::string, double>> metrics = {};  // each once, the last value
  std::vector<DrawnDispersion> dispersions = {};
  std::string failure_site = {};  // "transfer_test.cpp:31", or where flight code crashed
  std::string failure_text = {};
  std::map<std::string, std::string> flight_libraries = {};  // name -> file; what the child says
  std::map<std::string, std::string> hashes = {};  // name -> SHA-256, the runner's; "program" too
  double wall_s = 0, cpu_s = 0;  // of the process, from start to end; these repeat in no run
  std::uint64_t peak_kB = 0;

  const double* metric(std::string_view name) const;
  /// What must be the same whenever this run is repeated, as text: outcome, fingerprint, metrics,
  /// dispersions, failure site. Names what differs in the words of a report.
  std::string difference_from(const RunRecord& other) const;
};

/// One line without its end.
std::string to_json_line(const RunRecord& record);
/// Empty: not a whole record.
std::optional<RunRecord> parse_run_record(std::string_view line);

/// For tests without a world; World::record_metric is the same. The name ends in its unit.
void record_metric(std::string_view name_with_unit, double value);

/// What parts of the harness and fixtures tell about the run that is going on; kept if this program
/// is a child of a campaign, or not at all.
namespace internal {

/// What a child says first, on a line of its own: from here on its end is that of a run.
constexpr std::string_view kRunBegun = "begun\n";

/// Takes over the pipe that ORRERY_RUN_RECORD names. Init does it.
void adopt_run_record();
bool leaves_run_record();
void begin_run_record(const testing::TestInfo& test);
void note_metric(std::string_view name, double value);
void note_dispersion(const DrawnDispersion& drawn);
void note_world_end(const std::string& fingerprint, double simulated_s, std::uint64_t events,
                    const std::map<std::string, std::string>& flight_libraries);
/// Where flight code crashed; the next failure is about it.
void note_crash_site(const std::string& site);
/// The first failure counts. @param file  null or empty: not known.
void note_failure(const char* file, int line, std::string_view text);
/// The runs of this test are flown by others: by its children, or they have been.
void note_runs_elsewhere();
/// A value of --orrery_set that no dispersion of this test has taken fails it, and names those
/// there are.
void check_settings(const testing::TestInfo& test);
/// fly_campaign() says which run this is, and of how many.
void note_campaign_run(std::uint32_t run, std::uint64_t seed, std::uint32_t runs);
/// Writes the line, unless the test was skipped.
void end_run_record(const testing::TestInfo& test);

}  // namespace internal
}  // namespace orrery
