#include <orrery/harness/gtest/run_trace.hpp>
#include <orrery/harness/kernel/event_loop.hpp>
#include <orrery/harness/kernel/text.hpp>

#include <algorithm>
#include <istream>
#include <iterator>
#include <ostream>
#include <stdexcept>
#include <utility>

namespace orrery {
namespace {

thread_local TraceCollector* current_collector = nullptr;

[[noreturn]] void malformed(const std::string& line) {
  throw std::runtime_error("a trace of a run cannot be read: \"" + line + "\"");
}

// "<word> <rest>"; the rest.
std::string value_of(std::istream& in, const std::string& word) {
  std::string line;
  if (!std::getline(in, line) || line.compare(0, word.size() + 1, word + " ") != 0) {
    malformed(line);
  }
  return line.substr(word.size() + 1);
}

std::uint64_t number_of(std::istream& in, const std::string& word, int base = 10) {
  const std::string text = value_of(in, word);
  std::size_t used = 0;
  std::uint64_t number = 0;
  try {
    number = std::stoull(text, &used, base);
  } catch (const std::logic_error&) {
    malformed(text);
  }
  if (used != text.size()) malformed(text);
  return number;
}

std::string on_run(std::size_t run, const RunTrace& trace) {
  return (run == 0 ? "the run" : "run " + std::to_string(run + 1) + " of the test") + " (seed " +
         std::to_string(trace.seed) + ")";
}

}  // namespace

void write_traces(const std::vector<RunTrace>& traces, std::ostream& out) {
  out << "runs " << traces.size() << '\n';
  for (const RunTrace& trace : traces) {
    out << "seed " << trace.seed << "\nevents " << trace.events << "\nfingerprint "
        << trace.fingerprint << "\nrandom " << trace.random_fingerprint << "\ncheckpoints "
        << trace.checkpoints.size() << '\n';
    for (const std::uint64_t hash : trace.checkpoints)
      out << "hash " << hex_digits(hash, 16) << '\n';
    out << "instants " << trace.instants.size() << '\n';
    for (const auto& [events, hash] : trace.instants) {
      out << "at " << events << "\nhash " << hex_digits(hash, 16) << '\n';
    }
    out << "unordered " << trace.unordered << '\n';
    out << "log " << trace.log.size() << '\n';
    for (const std::string& line : trace.log) out << "event " << line << '\n';
  }
  out << "end of traces\n";
}

std::vector<RunTrace> read_traces(std::istream& in) {
  std::vector<RunTrace> traces;
  const std::uint64_t runs = number_of(in, "runs");
  for (std::uint64_t run = 0; run < runs; ++run) {
    RunTrace trace;
    trace.seed = number_of(in, "seed");
    trace.events = number_of(in, "events");
    trace.fingerprint = value_of(in, "fingerprint");
    trace.random_fingerprint = value_of(in, "random");
    const std::uint64_t checkpoints = number_of(in, "checkpoints");
    for (std::uint64_t i = 0; i < checkpoints; ++i) {
      trace.checkpoints.push_back(number_of(in, "hash", 16));
    }
    const std::uint64_t instants = number_of(in, "instants");
    for (std::uint64_t i = 0; i < instants; ++i) {
      const std::uint64_t at = number_of(in, "at");
      trace.instants.emplace_back(at, number_of(in, "hash", 16));
    }
    trace.unordered = value_of(in, "unordered");
    const std::uint64_t lines = number_of(in, "log");
    for (std::uint64_t i = 0; i < lines; ++i) trace.log.push_back(value_of(in, "event"));
    traces.push_back(std::move(trace));
  }
  if (value_of(in, "end") != "of traces") malformed("end");
  return traces;
}

std::optional<TraceDifference> first_difference(const std::vector<RunTrace>& a,
                                                const std::vector<RunTrace>& b) {
  for (std::size_t run = 0; run < std::min(a.size(), b.size()); ++run) {
    const RunTrace &x = a[run], &y = b[run];
    if (x.fingerprint == y.fingerprint && x.random_fingerprint == y.random_fingerprint &&
        x.events == y.events && x.seed == y.seed) {
      continue;
    }
    const auto [at_x, at_y] = std::mismatch(x.checkpoints.begin(), x.checkpoints.end(),
                                            y.checkpoints.begin(), y.checkpoints.end());
    const auto checkpoint = static_cast<std::uint64_t>(at_x - x.checkpoints.begin());
    const std::uint64_t from = checkpoint * EventLoop::kCheckpointEvents;
    return TraceDifference{run, from, from + EventLoop::kCheckpointEvents,
                           on_run(run, x) + ": fingerprint " + x.fingerprint + ", random " +
                               x.random_fingerprint + ", " + std::to_string(x.events) +
                               " events; repeated: " + y.fingerprint + ", " + y.random_fingerprint +
                               ", " + std::to_string(y.events)};
  }
  if (a.size() == b.size()) return {};
  const std::size_t run = std::min(a.size(), b.size());
  return TraceDifference{
      run, 0, 0,
      "the test made " + std::to_string(a.size()) + " runs; repeated, " + std::to_string(b.size())};
}

std::optional<TraceDifference> first_unordered_difference(const std::vector<RunTrace>& a,
                                                          const std::vector<RunTrace>& b) {
  for (std::size_t run = 0; run < std::min(a.size(), b.size()); ++run) {
    const RunTrace &x = a[run], &y = b[run];
    if (x.unordered == y.unordered && x.random_fingerprint == y.random_fingerprint) continue;
    const auto [at_x, at_y] =
        std::mismatch(x.instants.begin(), x.instants.end(), y.instants.begin(), y.instants.end());
    const std::uint64_t from = at_x == x.instants.begin() ? 0 : std::prev(at_x)->first;
    // One checkpoint comes up to an instant's events late.
    return TraceDifference{run, from, from + 2 * EventLoop::kCheckpointEvents,
                           on_run(run, x) + " depends on tie order"};
  }
  if (a.size() == b.size()) return {};
  return TraceDifference{std::min(a.size(), b.size()), 0, 0,
                         "the number of the test's runs depends on tie order"};
}

std::string describe_log_difference(const RunTrace& a, const RunTrace& b) {
  const auto [at_a, at_b] = std::mismatch(a.log.begin(), a.log.end(), b.log.begin(), b.log.end());
  if (at_a == a.log.end() && at_b == b.log.end()) return "";
  const auto line = [](auto at, auto end) { return at == end ? std::string("(no event)") : *at; };
  return "  first run: " + line(at_a, a.log.end()) + "\n  repeated:  " + line(at_b, b.log.end());
}

TraceCollector::TraceCollector(const RunVariation& variation)
    : variation_(variation), outer_(current_collector) {
  current_collector = this;
}

TraceCollector::~TraceCollector() {
  current_collector = outer_;
}

TraceCollector* TraceCollector::current() {
  return current_collector;
}

void TraceCollector::end_run(std::size_t number, RunTrace trace) {
  if (traces_.size() <= number) traces_.resize(number + 1);
  traces_[number] = std::move(trace);
}

}  // namespace orrery
