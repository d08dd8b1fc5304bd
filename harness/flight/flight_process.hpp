/// One instance of a flight library: its globals, its heap, its storage, and the boundary around
/// it.
#pragma once

#include <orrery/harness/flight/crash_report.hpp>
#include <orrery/harness/flight/flight_options.hpp>
#include <orrery/harness/flight/flight_port.hpp>
#include <orrery/harness/flight/non_volatile_memory.hpp>
#include <orrery/harness/heap/heap_figures.hpp>
#include <orrery/harness/heap/heap_history.hpp>
#include <orrery/harness/kernel/bytes.hpp>
#include <orrery/harness/kernel/time.hpp>

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

struct orrery_host;

namespace orrery {

/// Why a process boots, as the ABI numbers it.
enum class ResetCause : std::uint8_t { kPowerOn = 0, kCommanded = 1, kWatchdog = 2, kCrash = 3 };

/// What one call of a process left behind.
enum class CallOutcome : std::uint8_t { kDone, kRejected, kCrashed };

/// Heap of a process around one call.
using CallRecord = HeapSample;

/// Blocks of one origin that are still live.
struct LeakReport {
  std::uint64_t blocks = 0;
  std::uint64_t bytes = 0;  // asked for
  SimTime first;            // when the oldest was allocated
  std::vector<StackFrame> allocated_by;
};
std::string to_string(const LeakReport& leak);

class SimulatedHeap;

/// Where a bit may flip.
enum class FlightMemory : std::uint8_t {
  kHeap,     // from the first block to the top, headers and free blocks too
  kGlobals,  // .data and .bss of the library itself
};

namespace internal {
struct AdaptedProcess;
AdaptedProcess adapted_process(const ::orrery_host* host);
}  // namespace internal

/// Runs flight code to completion and keeps it from the simulator, and the simulator from it.
///
/// Boundary   Within a call the process's heap is current and `sim_process` names it; MXCSR and the
///            x87 control word are put back after it, and reported once if they had changed. Host
///            callbacks run without a heap. Payloads are copied as flight code, so that a bad
///            pointer ends the process, not the simulator.
/// Crash      See CrashKind. The process is dead: its heap is dropped, no destructor of it runs.
///            A signal raised by simulator code, within a callback too, is not contained.
/// Isolation  kCopy runs the library's static constructors within that boundary, kShared under no
///            heap when the library is loaded first.
class FlightProcess {
 public:
  /// Loads the library, runs its static constructors and reads its port table.
  /// @throws std::invalid_argument  the library is missing, does not load, crashes while it does,
  ///                                or breaks the ABI; an option outside its range. The message
  ///                                says which and why.
  /// @param memory  Of an earlier process; null: fresh, with the files of the options.
  explicit FlightProcess(FlightProcessOptions options,
                         std::shared_ptr<NonVolatileMemory> memory = nullptr);
  ~FlightProcess();  // as shut_down(), if still alive
  FlightProcess(const FlightProcess&) = delete;
  FlightProcess& operator=(const FlightProcess&) = delete;

  const FlightProcessOptions& options() const;
  const std::vector<FlightPort>& ports() const;

  /// The calls. `truth` is for reports only, the library sees `onboard_ns`.
  /// @throws std::logic_error  create() twice; the others unless alive(); any within another call.
  CallOutcome create(SimTime truth, std::int64_t onboard_ns, std::uint32_t boot_count = 0,
                     ResetCause cause = ResetCause::kPowerOn);
  CallOutcome input(SimTime truth, std::int64_t onboard_ns, const FlightPort& port, Bytes data);
  CallOutcome tick(SimTime truth, std::int64_t onboard_ns);
  /// Any function, as flight code of this process: in its heap, contained, with its clock, and
  /// with outputs and a tick request like any other call. After a crash in it the destructors of
  /// what lived on its stack have not run; what it allocated and left to others is gone with the
  /// process.
  CallOutcome run(SimTime truth, std::int64_t onboard_ns, const std::function<void()>& function);
  /// What the library exports under that name; null: nothing, or it is off.
  void* symbol(const char* name) const;
  /// Orderly end: destroy, then the library's static destructors.
  CallOutcome shut_down(SimTime truth, std::int64_t onboard_ns);

  /// Its memory is gone: a reset, a power cut. No code of it runs any more.
  /// @throws std::logic_error  within a call.
  void cut_off();

  bool alive() const;     // created, and since then no crash, shut_down() or cut_off()
  bool has_tick() const;  // the library has a tick function

  /// Of the last call, until the next; none after a crash.
  struct Output {
    const FlightPort* port = nullptr;
    Bytes data;
  };
  std::size_t output_count() const;
  Output output(std::size_t index) const;
  /// Onboard time asked for by the last call; negative: withdrawn; empty: the pending tick stays.
  std::optional<std::int64_t> tick_request() const;
  struct LogLine {
    LogLevel level = LogLevel::kInfo;
    std::string_view text;
  };
  /// Kept after a crash.
  std::size_t log_count() const;
  LogLine log_line(std::size_t index) const;
  const CallRecord& call_record() const;
  /// Of the last call that returned CallOutcome::kCrashed, or of end().
  const CrashReport& crash() const;
  /// Ends the process between calls, as a crash that was found from outside.
  /// @throws std::logic_error  unless alive(), or within a call.
  void end(CrashKind kind, const std::string& message, SimTime truth, std::int64_t onboard_ns);

  HeapFigures heap() const;
  /// Most of its stack that it has used; 0 where it has none of its own.
  std::uint64_t stack_high_water_bytes() const;
  std::uint64_t work() const;  // edges of the last call (COUNT_WORK), or instructions on a target
  /// What clock reads and sleeps of the last call took: it lengthens the execution time.
  Duration virtual_time_spent() const;
  bool counts_work() const;  // the library was built with COUNT_WORK, or runs on a target
  /// Below what the heap already has is allowed: it stops growing.
  /// @throws std::invalid_argument  above 4 GiB less 1 MiB.
  void set_heap_limit(std::uint64_t bytes);
  /// The heap itself, to look at and to watch; null where it is not simulated.
  SimulatedHeap* simulated_heap();
  /// Visits every block: empty, or what is wrong, with the stacks of the block if sites are
  /// tracked. Also empty where heaps are not simulated, and of a dead process.
  std::string check_heap();
  /// Blocks allocated after one HeapWatch::mark() up to another that are live now, by call stack.
  /// @throws std::logic_error  HeapRules::track_sites is off.
  std::vector<LeakReport> leaks(std::uint64_t after, std::uint64_t until) const;
  /// Inverts one bit of its memory: the one at `place`, 0 to 1, of the whole. Says which: "bit 3 of
  /// byte 0x40 of the heap", "... of counter"; empty where there is no such memory.
  /// @throws std::logic_error  within a call.
  std::string flip_bit(FlightMemory memory, double place);
  /// It outlives crash and shut-down, and may be handed to the next process.
  const std::shared_ptr<NonVolatileMemory>& memory() const;

  /// Symbols of the library that would have been one for all its copies, and were made one per
  /// copy.
  const std::vector<std::string>& edited_symbols() const;
  /// Isolation::kShared: the first variable of the library that is seen to have changed since it
  /// was loaded; empty: none, so far. All processes of the library share it. Looked for after
  /// each of the first 16 calls, then after the 32nd, 64th ..., and logged once as a warning.
  const std::string& written_global() const;
  /// Libraries beyond the C and C++ run time that all copies of this one share.
  const std::vector<std::string>& shared_dependencies() const;

  /// Host time spent within calls, for reports only: it repeats in no run.
  Duration host_time_in_flight() const;
  std::uint64_t last_host_ticks() const;  // of the last call, for HostStopwatch::duration()

 private:
  class Impl;
  friend internal::AdaptedProcess internal::adapted_process(const ::orrery_host* host);
  std::unique_ptr<Impl> impl_;
};

}  // namespace orrery
