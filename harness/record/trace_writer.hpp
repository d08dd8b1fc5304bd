/// A timeline of events in the Chrome trace-event format, which Perfetto and chrome://tracing open.
#pragma once

#include <orrery/harness/kernel/time.hpp>
#include <orrery/harness/record/json_text.hpp>
#include <orrery/harness/record/output_file.hpp>

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace orrery {

/// Writes events as they come; what is kept in memory is one entry per track.
///
/// Format  {"traceEvents":[...]}, an event per line, in the order of their times. `ts` is in
///         microseconds since the start with three decimals: exact, so equal runs give equal bytes.
///         Host times have no place in it.
/// Tracks  pid: a spacecraft, tid: a process or device of it, both named by metadata (M).
/// Slices  B and E where something takes time, since a reset may cut it short; one at a time on a
///         track. Both have the name, which some readers want of an end, too. X without duration
///         where it takes none: Perfetto reads an E before the B of the same instant, so that such
///         a slice would have no end. A B is therefore written when time goes on.
/// Flows   s and f of one id, each within an X of the same instant, which it binds to. Such an X
///         has 1 ns, the resolution, or there would be nothing to bind to, and the flow's category,
///         by which Chrome's DevTools find it; slices that take time could overlap it in part, so
///         a track has the ones or the others.
/// Errors  Times must not go back, nor a track have both: std::logic_error. Failures to write:
///         std::runtime_error.
class TraceWriter {
 public:
  struct Track {
    int process = 0, thread = 0;  // pid, tid
    friend bool operator==(const Track&, const Track&) = default;
  };

  TraceWriter(const std::filesystem::path& path, SimTime start);

  /// The same names give the same track; shown in the order of first use.
  Track track(std::string_view process, std::string_view thread);

  /// Something without extent.
  void instant(Track track, SimTime t, std::string_view name, const JsonObject& args = {});
  /// A slice of 1 ns, for flows to bind to, on a track that has no other slices.
  void moment(Track track, SimTime t, std::string_view name, const JsonObject& args = {});
  /// A slice that ends by itself after `length`, or by end(), or when another one begins.
  void slice(Track track, SimTime t, Duration length, std::string_view name,
             const JsonObject& args = {});
  /// A slice that only end(), another one or close() ends.
  void begin(Track track, SimTime t, std::string_view name, const JsonObject& args = {});
  /// Ends the open slice of the track; nothing if there is none.
  void end(Track track, SimTime t);
  /// A line chart, one line per member. It belongs to the process, named after the thread too.
  void counter(Track track, SimTime t, std::string_view name, const JsonObject& values);
  /// Directly after the moment() that it starts from, or arrives at.
  void flow_start(Track track, SimTime t, std::string_view name, std::uint64_t id);
  void flow_end(Track track, SimTime t, std::string_view name, std::uint64_t id);

  /// As OutputFile's.
  void flush() { file_.flush(); }
  void continue_in(std::filesystem::path path) { file_.continue_in(std::move(path)); }
  /// Ends what is open at `t`. Further events throw std::logic_error.
  void close(SimTime t);

 private:
  void write_name(const char* what, Track track, std::string_view name);
  // Up to "name", without the closing brace.
  void open_event(char phase, Track track, SimTime t, std::string_view name);
  void end_event(std::string_view args);
  void end_event(const JsonObject& args) { end_event(args.members()); }
  void move_to(SimTime t);
  void append_ts(SimTime t);

  OutputFile file_;
  SimTime start_, last_;
  std::string line_;
  bool first_ = true;
  enum class Holds { kNothing, kMoments, kSlices };
  struct Thread {
    std::string name;
    Holds holds = Holds::kNothing;
  };
  void require(Track track, Holds holds);
  std::vector<std::pair<std::string, std::vector<Thread>>> processes_;
  struct Open {
    SimTime from, until;
    std::uint64_t number;  // of its beginning: order among equal ends
    Track track;
    std::string name, args;
    bool is_written = false;  // its beginning
  };
  void write_begins();
  void write_end(const Open& one, SimTime t);
  std::vector<Open> open_;  // one per track at most, in the order of their beginnings
  std::uint64_t begun_ = 0;
};

}  // namespace orrery
