#include <orrery/harness/gtest/flags.hpp>
#include <orrery/harness/gtest/run_context.hpp>
#include <orrery/harness/heap/simulated_heap.hpp>

#include <algorithm>
#include <cstdio>
#include <utility>
#include <vector>

/// For debuggers (orrery.gdb), which may have stopped within flight code.
extern "C" __attribute__((noinline, used)) void orrery_debug_state() {
  const orrery::HeapGuard none(nullptr);
  std::fputs(orrery::describe_live_runs().c_str(), stdout);
  std::fflush(stdout);
}

namespace orrery {
namespace {

std::vector<LiveRun*>& live_runs() {
  thread_local std::vector<LiveRun*> runs;
  return runs;
}

std::string describe(const RunSnapshot& s) {
  std::string text = "  seed " + std::to_string(s.seed) + ", simulated " + to_string(s.elapsed) +
                     " (" + to_string(s.now) + "), " + std::to_string(s.events) +
                     " events, fingerprint " + s.fingerprint + "\n";
  if (!s.last_events.empty()) text += "  last events:\n";
  for (const std::string& event : s.last_events) text += "    " + event + "\n";
  return text + s.spacecraft;
}

bool& world_noted() {
  thread_local bool noted = false;
  return noted;
}

std::string& current_test() {
  static std::string name;
  return name;
}

}  // namespace

LiveRun::LiveRun(std::function<RunSnapshot()> snapshot) : snapshot_(std::move(snapshot)) {
  live_runs().push_back(this);
}

LiveRun::~LiveRun() {
  auto& runs = live_runs();
  runs.erase(std::remove(runs.begin(), runs.end(), this), runs.end());
}

std::string describe_live_runs() {
  std::string text;
  for (const LiveRun* run : live_runs()) text += describe(run->snapshot_());
  return text;
}

std::optional<Duration> live_run_elapsed() {
  if (live_runs().empty()) return {};
  return live_runs().back()->snapshot_().elapsed;
}

void note_world() {
  world_noted() = true;
}
bool world_was_noted() {
  return world_noted();
}

void set_current_test(const std::string& suite_and_name) {
  current_test() = suite_and_name;
  world_noted() = false;
}

std::string replay_command() {
  if (current_test().empty()) return {};
  std::string command = program_name() + " --gtest_filter='" + current_test() +
                        "' --orrery_seed=" + std::to_string(flags().seed);
  if (flags().shuffle_ties != 0) {
    command += " --orrery_shuffle_ties=" + std::to_string(flags().shuffle_ties);
  }
  for (const Flags::Target& target : flags().targets) {
    command += " --orrery_target='" + target.process + "=" + to_string(target.address) + "'";
  }
  if (flags().run) command += " --orrery_run=" + std::to_string(*flags().run);
  if (flags().runs) command += " --orrery_runs=" + std::to_string(*flags().runs);
  return command;
}

std::string debug_command(std::optional<Duration> elapsed) {
  const std::string replay = replay_command();
  if (replay.empty()) return {};
  if (!elapsed) return "gdb -ex 'catch throw' -ex run --args " + replay;
  std::string seconds = std::to_string(*elapsed / 1s);
  if (const auto rest_ns = (*elapsed % 1s).count(); rest_ns != 0)
    seconds += "." + std::to_string(1'000'000'000 + rest_ns).substr(1);
  return "gdb -ex 'break sim_debug_break' -ex run --args " + replay +
         " --orrery_break_at=" + seconds;
}

}  // namespace orrery
