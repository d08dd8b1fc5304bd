#include <orrery/harness/gtest/child_process.hpp>
#include <orrery/harness/gtest/determinism.hpp>
#include <orrery/harness/gtest/flags.hpp>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

// A child learns from one environment variable where to write its traces and how to vary:
// "<file>\n<scatter 0|1> <heap seed> <log run> <log from> <log until>".
namespace orrery {
namespace {

namespace fs = std::filesystem;

constexpr const char* kChildVariable = "ORRERY_REPEATED_RUN";
constexpr std::uint64_t kOtherHeapSeed = 0x5ca77e4;

struct Child {
  std::string file;
  RunVariation variation;
};

std::optional<Child> this_child() {
  const char* text = std::getenv(kChildVariable);
  if (text == nullptr) return {};
  std::istringstream in(text);
  Child child;
  RunVariation& v = child.variation;
  std::getline(in, child.file);
  in >> v.scatter_heaps >> v.heap_seed >> v.log_run >> v.log_from_event >> v.log_until_event;
  if (!in) throw std::runtime_error(std::string(kChildVariable) + " is malformed");
  return child;
}

std::string to_variable(const Child& child) {
  const RunVariation& v = child.variation;
  std::ostringstream out;
  out << kChildVariable << '=' << child.file << '\n'
      << v.scatter_heaps << ' ' << v.heap_seed << ' ' << v.log_run << ' ' << v.log_from_event << ' '
      << v.log_until_event;
  return out.str();
}

class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string pattern = (fs::temp_directory_path() / "orrery_repeat_XXXXXX").string();
    if (mkdtemp(pattern.data()) == nullptr) {
      throw std::runtime_error("no folder can be made in " + fs::temp_directory_path().string());
    }
    path_ = pattern;
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  fs::path operator/(const char* name) const { return path_ / name; }

 private:
  fs::path path_;
};

struct Repeat {
  ChildOutcome outcome;
  std::vector<RunTrace> traces;
};

// The same test as a child. `other`: under conditions that must not matter.
Repeat repeat(const testing::TestInfo& test, const RunVariation& variation, bool other) {
  const TemporaryFolder folder;
  const std::string traces = (folder / "traces").string();
  ChildCommand command;
  command.arguments = {"--gtest_filter=" + std::string(test.test_suite_name()) + "." + test.name(),
                       "--orrery_seed=" + std::to_string(flags().seed)};
  if (flags().runs) command.arguments.push_back("--orrery_runs=" + std::to_string(*flags().runs));
  command.environment = {to_variable({traces, variation}), "ORRERY_VERIFY_DETERMINISM=0"};
  command.removed = {"ORRERY_OUT", "ORRERY_RECORD", "ORRERY_LOG", "ORRERY_PROGRESS"};
  if (other) {
    command.other_addresses = true;
    command.environment.push_back("ORRERY_PADDING=" + std::string(8192, 'x'));
    command.arguments.push_back("--orrery_log=debug");
    if (flags().out.empty()) {
      command.arguments.push_back("--orrery_out=" + (folder / "out").string());
    }
  }
  Repeat result{run_child(command), {}};
  std::ifstream in(traces);
  if (in) result.traces = read_traces(in);
  return result;
}

// Where the runs part, to the event: both once more, with a log of the stretch in question.
std::string first_event(const testing::TestInfo& test, const TraceDifference& difference) {
  RunVariation plain{.log_run = difference.run,
                     .log_from_event = difference.from_event,
                     .log_until_event = difference.until_event};
  RunVariation varied = plain;
  varied.scatter_heaps = true;
  varied.heap_seed = kOtherHeapSeed;
  const Repeat a = repeat(test, plain, false), b = repeat(test, varied, true);
  if (a.traces.size() <= difference.run || b.traces.size() <= difference.run) return "";
  const std::string text =
      describe_log_difference(a.traces[difference.run], b.traces[difference.run]);
  if (!text.empty()) return "\nThe first event that differs:\n" + text;
  return "\nRun twice more, the events " + std::to_string(difference.from_event + 1) + " to " +
         std::to_string(difference.until_event) +
         " were equal: what differs changes from run to run, as the wall clock does, or lies in "
         "random draws alone.";
}

std::unique_ptr<TraceCollector>& collector() {
  thread_local std::unique_ptr<TraceCollector> the_collector;
  return the_collector;
}

void write_child_traces(const Child& child, const std::vector<RunTrace>& traces) {
  std::ofstream out(child.file);
  write_traces(traces, out);
}

void verify(const testing::TestInfo& test, const std::vector<RunTrace>& first) {
  const Repeat second =
      repeat(test, {.scatter_heaps = true, .heap_seed = kOtherHeapSeed}, /*other=*/true);
  if (const auto difference = first_difference(first, second.traces)) {
    ADD_FAILURE() << "the same seed gave another run: " << difference->text
                  << first_event(test, *difference);
  } else if (!second.outcome.passed()) {
    ADD_FAILURE() << "the same seed gave another result: the test passed, and repeated "
                  << second.outcome.describe() << "; the end of its output:\n"
                  << second.outcome.tail;
  }
}

}  // namespace

testing::AssertionResult flies_equally(const std::function<void()>& fly) {
  const auto traces = [&fly](const RunVariation& variation) {
    const TraceCollector collected(variation);
    fly();
    return collected.traces();
  };
  RunVariation plain, varied{.scatter_heaps = true, .heap_seed = kOtherHeapSeed};
  const auto difference = first_difference(traces(plain), traces(varied));
  if (!difference) return testing::AssertionSuccess();
  for (RunVariation* v : {&plain, &varied}) {
    v->log_run = difference->run;
    v->log_from_event = difference->from_event;
    v->log_until_event = difference->until_event;
  }
  const std::vector<RunTrace> a = traces(plain), b = traces(varied);
  std::string where;
  if (difference->run < std::min(a.size(), b.size())) {
    where = describe_log_difference(a[difference->run], b[difference->run]);
  }
  return testing::AssertionFailure()
         << "the same seed gave another run: " << difference->text
         << (where.empty() ? "" : "\nThe first event that differs:\n") << where;
}

namespace internal {

void begin_determinism_check() {
  const std::optional<Child> child = this_child();
  if (child) {
    collector() = std::make_unique<TraceCollector>(child->variation);
  } else if (flags().verify_determinism) {
    collector() = std::make_unique<TraceCollector>();
  }
}

void end_determinism_check(const testing::TestInfo& test) {
  if (!collector()) return;
  const std::vector<RunTrace> traces = collector()->traces();
  collector().reset();
  if (const std::optional<Child> child = this_child()) return write_child_traces(*child, traces);
  // A test that failed or was skipped has nothing to repeat; one without a world nothing to
  // compare.
  if (test.result()->Failed() || test.result()->Skipped() || traces.empty()) return;
  verify(test, traces);
}

}  // namespace internal
}  // namespace orrery
