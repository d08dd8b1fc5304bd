/// The inside of a flight process: its state, the calls into the library and those back into the
/// host.
#pragma once

#include <orrery/harness/flight/adapter_bridge.hpp>
#include <orrery/harness/flight/containment.hpp>
#include <orrery/harness/flight/file_services.hpp>
#include <orrery/harness/flight/flight_library.hpp>
#include <orrery/harness/flight/flight_process.hpp>
#include <orrery/harness/flight/flight_target.hpp>
#include <orrery/harness/flight/globals_watch.hpp>
#include <orrery/harness/flight/host_stopwatch.hpp>
#include <orrery/harness/flight/virtual_services.hpp>

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <orrery_flight.h>
#include <orrery_work.h>
#include <string>
#include <string_view>
#include <vector>

namespace orrery {
namespace internal {

enum class LibraryCall : std::uint8_t { kLoad, kCreate, kInput, kTick, kDestroy, kRun };

// What a call of the library needs, as plain data: the other side of the boundary reads it.
struct CallArguments {
  LibraryCall call = LibraryCall::kLoad;
  std::int64_t onboard_ns = 0;
  const orrery_boot* boot = nullptr;
  const FlightPort* port = nullptr;
  std::uint32_t bytes = 0;
  const std::function<void()>* function = nullptr;
  std::int32_t status = ORRERY_OK;  // result
};

inline HeapOptions heap_options(const FlightProcessOptions& options) {
  return {.alignment = options.heap_alignment,
          .limit_bytes = options.heap_bytes,
          .rules = options.heap};
}

}  // namespace internal

class FlightProcess::Impl {
 public:
  Impl(FlightProcessOptions options, std::shared_ptr<NonVolatileMemory> memory);
  ~Impl();

  CallOutcome call(internal::CallArguments arguments, SimTime truth, Bytes data);
  CallOutcome create(SimTime truth, std::int64_t onboard_ns, std::uint32_t boot_count,
                     ResetCause cause);
  void cut_off();
  bool shut_down_library();
  std::string check_heap();
  std::vector<LeakReport> leaks(std::uint64_t after, std::uint64_t until) const;
  void require_alive(const char* function) const;
  internal::AdaptedProcess adapted() const { return {&options, library.get(), &ports}; }
  void require_between_calls(const char* function) const;
  void die_of_last_call(SimTime truth);
  void die(CrashKind kind, std::string message, SimTime truth,
           const internal::CallArguments& arguments);

  // What the library may ask of the host, within a call.
  std::int32_t output(std::uint32_t port, const void* data, std::uint32_t bytes);
  void request_tick(std::int64_t at_ns);
  void log(std::int32_t level, const char* line);
  std::int32_t load_slot(std::uint32_t slot, void* buffer, std::uint32_t capacity);
  std::int32_t store_slot(std::uint32_t slot, const void* data, std::uint32_t bytes);

  FlightProcessOptions options;
  std::string name;
  std::vector<FlightPort> ports;
  std::optional<internal::AdapterTable> adapter;
  const orrery_flight* flight = nullptr;
  std::unique_ptr<SimulatedHeap> heap;           // null where heaps are not simulated
  std::unique_ptr<internal::FlightStack> stack;  // null: calls run on the caller's
  internal::VirtualServices services{options};
  std::shared_ptr<NonVolatileMemory> memory;
  internal::FileServices files;
  std::unique_ptr<FlightLibrary> library;          // unloaded while all of the above is still there
  std::unique_ptr<internal::FlightTarget> target;  // in place of the library
  std::uint64_t target_instructions = 0;           // of the last call there; 0: it counts none
  HeapFigures target_heap;
  orrery_work* work = nullptr;  // of the library; null: it counts none

  std::vector<internal::GlobalsWatch> globals;    // Isolation::kShared; the library's own first
  std::vector<std::string> watched_dependencies;  // names of the others
  std::string written_global;
  std::uint64_t calls = 0;

  bool created = false, alive = false;
  bool crashed = false;  // or cut off: its destructors never run
  bool ended = false;    // in good order
  CallRecord record;
  CrashReport crash;
  std::optional<std::int64_t> tick_request;
  internal::HostStopwatch stopwatch;

  struct OutputRow {
    std::uint32_t port;  // index
    std::size_t begin, bytes;
  };
  std::vector<OutputRow> outputs;
  ByteBuffer output_bytes;
  struct LogRow {
    LogLevel level;
    std::size_t begin, bytes;
  };
  std::vector<LogRow> logs;
  std::string log_text;

 private:
  void load();
  void reach_target();
  bool call_target();
  const TargetAnswer& ask_target();
  void take_answer(const TargetAnswer& answer);
  void report_target_time();
  void find_work_counter();
  void fill_host_table();
  void begin_call();
  void record_call(Bytes data, bool returned);
  void end_call(SimTime truth);
  void run_library_call();
  CallOutcome judge(const internal::CallArguments& arguments, SimTime truth);
  void host_log(LogLevel level, std::string_view text);
  void report_floating_point();
  void tell_of_block(const void* address);
  std::vector<StackFrame> frames(const CallStack& stack) const;
  void report_written_global();
  void watch_globals();
  void mark_half_initialised();
  bool calling() const { return internal::running_process() == &contained_; }
  std::uint32_t find_output(std::uint32_t id) const;
  static void on_heap_fault(void* self, const HeapFault& fault);

  internal::ContainedProcess contained_;
  internal::CrashCapture capture_;
  std::string target_loss_;  // what capture_.message has no room for
  orrery_host host_{};
  void* self_ = nullptr;
  internal::CallArguments arguments_;
  ByteBuffer input_;    // a copy, so that flight code cannot change the simulator's
  ByteBuffer staging_;  // a store that may still fault
  std::uint64_t allocations_before_ = 0;
  const void* fault_address_ = nullptr;  // of the last heap fault
  bool reported_floating_point_ = false;
};

}  // namespace orrery
