#include <orrery/harness/gtest/child_process.hpp>
#include <orrery/harness/gtest/determinism.hpp>
#include <orrery/harness/gtest/flags.hpp>
#include <orrery/harness/gtest/run_context.hpp>

#include <algorithm>
#include <charconv>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

// A child learns from one environment variable where to write its traces and how to vary:
// "<file>\n" and the members of RunVariation in order.
namespace orrery {
namespace {

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
  in >> v.scatter_heaps >> v.fill_heaps >> v.own_globals >> v.strict_services >> v.heap_seed >>
      v.tie_seed >> v.unordered >> v.log_run >> v.log_from_event >> v.log_until_event;
  if (!in) throw std::runtime_error(std::string(kChildVariable) + " is malformed");
  return child;
}

std::string to_variable(const Child& child) {
  const RunVariation& v = child.variation;
  std::ostringstream out;
  out << kChildVariable << '=' << child.file << '\n'
      << v.scatter_heaps << ' ' << v.fill_heaps << ' ' << v.own_globals << ' ' << v.strict_services
      << ' ' << v.heap_seed << ' ' << v.tie_seed << ' ' << v.unordered << ' ' << v.log_run << ' '
      << v.log_from_event << ' ' << v.log_until_event;
  return out.str();
}

struct Repeat {
  ChildOutcome outcome;
  std::vector<RunTrace> traces;
};

// Everything about flight software that must not matter, at once.
RunVariation varied() {
  return {.scatter_heaps = true,
          .fill_heaps = true,
          .own_globals = true,
          .heap_seed = kOtherHeapSeed,
          .tie_seed = flags().shuffle_ties};
}

RunVariation plain() {
  return {.tie_seed = flags().shuffle_ties};
}

RunVariation with_log(RunVariation variation, const TraceDifference& difference) {
  variation.log_run = difference.run;
  variation.log_from_event = difference.from_event;
  variation.log_until_event = difference.until_event;
  return variation;
}

// The same test as a child. `other`: under conditions of the program that must not matter.
Repeat repeat(const testing::TestInfo& test, const RunVariation& variation, bool other) {
  const TemporaryFolder folder("repeat");
  const std::string traces = (folder / "traces").string();
  ChildCommand command;
  command.arguments = {"--gtest_filter=" + std::string(test.test_suite_name()) + "." + test.name(),
                       "--orrery_seed=" + std::to_string(flags().seed)};
  if (flags().run) command.arguments.push_back("--orrery_run=" + std::to_string(*flags().run));
  if (flags().runs) command.arguments.push_back("--orrery_runs=" + std::to_string(*flags().runs));
  command.environment = {to_variable({traces, variation}), "ORRERY_VERIFY_DETERMINISM=0"};
  command.removed = {"ORRERY_OUT", "ORRERY_RECORD", "ORRERY_LOG", "ORRERY_PROGRESS",
                     "ORRERY_SHUFFLE_TIES"};
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

// "tick of chief at 60.5 s, chain 0123": when that was. Empty: the line says no time in seconds.
std::optional<Duration> time_of_event(const std::string& line) {
  const std::size_t end = line.rfind(" s, chain "), begin = line.rfind(" at ", end);
  if (end == std::string::npos || begin == std::string::npos) return {};
  double seconds = 0;
  const char* const last = line.data() + end;
  const auto parsed = std::from_chars(line.data() + begin + 4, last, seconds);
  if (parsed.ec != std::errc() || parsed.ptr != last) return {};
  return from_seconds(seconds);
}

// The command that verifies again, and one that stops where the runs part, if that is known.
std::string commands(std::optional<Duration> parting) {
  std::string text = "\n  replay: " + replay_command();
  if (flags().verify_determinism) text += " --orrery_verify_determinism";
  if (parting) text += "\n  debug: " + debug_command(parting);
  return text;
}

// Where the runs part, to the event: both once more, with a log of the stretch in question.
std::string first_event(const testing::TestInfo& test, const TraceDifference& difference,
                        const RunVariation& one, const RunVariation& other) {
  const Repeat a = repeat(test, with_log(one, difference), false),
               b = repeat(test, with_log(other, difference), false);
  if (a.traces.size() <= difference.run || b.traces.size() <= difference.run) return commands({});
  const RunTrace &x = a.traces[difference.run], &y = b.traces[difference.run];
  if (const std::string text = describe_log_difference(x, y); !text.empty()) {
    const auto parts = std::mismatch(x.log.begin(), x.log.end(), y.log.begin(), y.log.end()).first;
    const auto t = parts == x.log.end() ? std::nullopt : time_of_event(*parts);
    return "\nThe first event that differs:\n" + text + commands(t);
  }
  return "\nRun twice more, the events " + std::to_string(difference.from_event + 1) + " to " +
         std::to_string(difference.until_event) +
         " were equal: what differs changes from run to run, as the wall clock does, or lies in "
         "random draws alone." +
         commands({});
}

// The line of a child's output that holds the word, and those after it that are indented: the stack
// of a crash, without the command that debugs the child.
std::string lines_with(const std::string& output, const std::string& word) {
  const std::size_t at = output.find(word);
  if (at == std::string::npos) return "";
  std::istringstream lines(output.substr(output.rfind('\n', at) + 1));
  std::string text, line;
  std::getline(lines, line);
  do {
    text += "\n" + line;
  } while (std::getline(lines, line) && line.starts_with("  ") && !line.starts_with("  debug"));
  return text;
}

constexpr const char* kUnwritten =
    "flight code reads memory that it has not written (an uninitialised variable)";

// Nothing was varied but what the system varies itself: its clock, its entropy, the addresses at
// which the loader places libraries, which earlier calls leave on the stack.
std::string cause_from_run_to_run(const testing::TestInfo& test) {
  const std::string forbidden =
      lines_with(repeat(test, {.strict_services = true}, false).outcome.tail,
                 "called, which this test forbids");
  if (!forbidden.empty()) {
    return "it changes from run to run with nothing varied: flight code reads the wall clock, or "
           "random numbers without a seed" +
           forbidden;
  }
  const RunVariation filled{
      .fill_heaps = true, .heap_seed = kOtherHeapSeed, .tie_seed = flags().shuffle_ties};
  if (!first_difference(repeat(test, filled, false).traces, repeat(test, filled, false).traces)) {
    return std::string("it changes from run to run, but not when memory is filled alike: ") +
           kUnwritten;
  }
  return "it changes from run to run with nothing varied, and asks the C library for neither time "
         "nor chance: the processor's own counters, or addresses that the loader draws anew";
}

// What is it that must not matter and does: one thing varied at a time.
std::string cause(const testing::TestInfo& test, const std::vector<RunTrace>& first) {
  const auto differs = [&](RunVariation variation, bool other = false) {
    variation.tie_seed = flags().shuffle_ties;
    variation.heap_seed = kOtherHeapSeed;
    return first_difference(first, repeat(test, variation, other).traces).has_value();
  };
  if (differs({})) return cause_from_run_to_run(test);
  std::string causes;
  const auto add = [&causes](const std::string& text) {
    causes += (causes.empty() ? "" : "; and ") + text;
  };
  if (differs({.fill_heaps = true})) {
    add(std::string("it changes with what fresh memory of heap and stack holds: ") + kUnwritten);
  }
  if (differs({.scatter_heaps = true})) {
    add(causes.empty()
            ? "it changes with the addresses of heap blocks: a container ordered or "
              "hashed by pointers, or an address that is sent"
            : "it changes with the addresses of heap blocks, which may follow from that");
  }
  if (differs({.own_globals = true})) {
    const std::string output = repeat(test, {}, true).outcome.tail;
    add("it changes when each instance has globals of its own (Isolation::kCopy): a static that "
        "all instances share" +
        lines_with(output, "writes its own globals"));
  }
  if (causes.empty() && differs({}, true)) {
    add("it changes with the environment's size, the program's addresses, recording or the log "
        "level");
  }
  return causes.empty() ? "only several changes together show it" : causes;
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
  const Repeat second = repeat(test, varied(), /*other=*/true);
  if (const auto difference = first_difference(first, second.traces)) {
    ADD_FAILURE() << "the same seed gave another run: " << difference->text
                  << first_event(test, *difference, plain(), varied())
                  << "\nCause: " << cause(test, first);
  } else if (!second.outcome.passed()) {
    ADD_FAILURE() << "the same seed gave another result: the test passed, and repeated "
                  << second.outcome.describe() << "; the end of its output:\n"
                  << second.outcome.tail << commands({});
  }
}

// The test ran with its ties shuffled; again in the defined order.
void verify_ties(const testing::TestInfo& test, const std::vector<RunTrace>& shuffled) {
  const RunVariation defined{.unordered = true};
  RunVariation other = defined;
  other.tie_seed = flags().shuffle_ties;
  const Repeat second = repeat(test, defined, false);
  const std::string by =
      "events of equal time and different origin in another order "
      "(--orrery_shuffle_ties=" +
      std::to_string(flags().shuffle_ties) + ")";
  if (test.result()->Failed()) {
    if (second.outcome.passed()) {
      ADD_FAILURE() << "depends on tie order: in the defined order the test passes; with " << by
                    << " it fails";
    }
    return;
  }
  if (const auto difference = first_unordered_difference(shuffled, second.traces)) {
    ADD_FAILURE() << difference->text << ": another result with " << by
                  << first_event(test, *difference, other, defined);
  } else if (!second.outcome.passed()) {
    ADD_FAILURE() << "depends on tie order: the test passes with " << by
                  << ", and in the defined order " << second.outcome.describe()
                  << "; the end of its output:\n"
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
  const RunVariation one,
      other{.scatter_heaps = true, .fill_heaps = true, .heap_seed = kOtherHeapSeed};
  const auto difference = first_difference(traces(one), traces(other));
  if (!difference) return testing::AssertionSuccess();
  const std::vector<RunTrace> a = traces(with_log(one, *difference)),
                              b = traces(with_log(other, *difference));
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
  } else if (flags().verify_determinism || flags().shuffle_ties != 0) {
    collector() = std::make_unique<TraceCollector>(
        RunVariation{.tie_seed = flags().shuffle_ties, .unordered = flags().shuffle_ties != 0});
  }
}

void end_determinism_check(const testing::TestInfo& test) {
  if (!collector()) return;
  const std::vector<RunTrace> traces = collector()->traces();
  collector().reset();
  if (const std::optional<Child> child = this_child()) return write_child_traces(*child, traces);
  // A test that failed or was skipped has nothing to repeat; one without a world nothing to
  // compare.
  if (test.result()->Skipped() || traces.empty()) return;
  if (flags().shuffle_ties != 0) verify_ties(test, traces);
  if (test.result()->Failed()) return;
  if (flags().verify_determinism) verify(test, traces);
}

}  // namespace internal
}  // namespace orrery
