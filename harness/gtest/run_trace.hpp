/// What runs did, short enough to keep, and where two of them differ.
#pragma once

#include <orrery/harness/kernel/simulator_only.hpp>

#include <cstdint>
#include <iosfwd>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace orrery {

/// One run of a world.
struct RunTrace {
  std::uint64_t seed = 0;
  std::uint64_t events = 0;
  std::string fingerprint, random_fingerprint;
  std::vector<std::uint64_t> checkpoints;  // the fingerprint's hash after every 4096 events
  std::vector<std::string> log;            // of a window of events, a line each
  // To which the order of ties does not matter, where that is asked for: the whole run's, and after
  // some events.
  std::string unordered = {};
  std::vector<std::pair<std::uint64_t, std::uint64_t>> instants = {};  // events, hash

  friend bool operator==(const RunTrace&, const RunTrace&) = default;
};

/// Text form, a line per item; read_traces() reads it back.
/// @throws std::runtime_error  text that write_traces() did not write.
void write_traces(const std::vector<RunTrace>& traces, std::ostream& out);
std::vector<RunTrace> read_traces(std::istream& in);

/// Where two sequences of runs part.
struct TraceDifference {
  std::size_t run = 0;
  std::uint64_t from_event = 0,
                until_event = 0;  // the first event that differs is in (from, until]
  std::string text;               // one line that says so
};
std::optional<TraceDifference> first_difference(const std::vector<RunTrace>& a,
                                                const std::vector<RunTrace>& b);

/// The same of runs whose ties came in another order.
std::optional<TraceDifference> first_unordered_difference(const std::vector<RunTrace>& a,
                                                          const std::vector<RunTrace>& b);

/// The first lines of two logs that differ, side by side; empty if none does.
std::string describe_log_difference(const RunTrace& a, const RunTrace& b);

/// What a second run does differently, and what is asked of it. None of it may change a result.
struct RunVariation {
  bool scatter_heaps = false;    // each block anywhere in its arena
  bool fill_heaps = false;       // fresh memory filled otherwise
  bool own_globals = false;      // Isolation::kCopy where the test has kShared
  bool strict_services = false;  // HostServices::kStrict where the test has kHost
  std::uint64_t heap_seed = 0;
  std::uint64_t tie_seed = 0;  // order of events at one instant; 0: the defined one
  bool unordered = false;      // leave RunTrace::unordered
  std::size_t log_run = 0;     // number of the world of which a log is kept, for these events
  std::uint64_t log_from_event = 0, log_until_event = 0;  // none if equal
};

/// While one lives, the worlds of this thread vary as it says, and leave their traces here when
/// they are destroyed. The latest one counts.
class TraceCollector {
 public:
  explicit TraceCollector(const RunVariation& variation = {});
  ~TraceCollector();
  TraceCollector(const TraceCollector&) = delete;
  TraceCollector& operator=(const TraceCollector&) = delete;

  /// Null outside of any.
  static TraceCollector* current();

  const RunVariation& variation() const { return variation_; }
  /// The number of a world that begins, from 0.
  std::size_t begin_run() { return begun_++; }
  /// Traces stand in the order in which their worlds began.
  void end_run(std::size_t number, RunTrace trace);
  const std::vector<RunTrace>& traces() const { return traces_; }

 private:
  RunVariation variation_;
  std::size_t begun_ = 0;
  std::vector<RunTrace> traces_;
  TraceCollector* outer_;
};

}  // namespace orrery
