// A call of the library, from what the host hands over to what it left behind.

#include <orrery/harness/flight/call_recording.hpp>
#include <orrery/harness/flight/flight_process_impl.hpp>
#include <orrery/harness/kernel/hash.hpp>

#include <stdexcept>

namespace orrery {

using internal::CallArguments;
using Call = internal::LibraryCall;

// Flight code from here on.
void FlightProcess::Impl::run_library_call() {
  CallArguments& a = arguments_;
  switch (a.call) {
    case Call::kLoad: {
      using Entry = const orrery_flight* (*)();
      library->run_constructors();
      flight = adapter ? adapter->flight()
                       : reinterpret_cast<Entry>(library->symbol("orrery_flight_entry"))();
      return;
    }
    case Call::kCreate:
      a.status = flight->create(&self_, &host_, a.boot);
      return;
    case Call::kInput:
      a.status = flight->input(self_, a.onboard_ns, a.port->id, input_.data(), a.bytes);
      return;
    case Call::kTick:
      a.status = flight->tick(self_, a.onboard_ns);
      return;
    case Call::kDestroy:
      flight->destroy(self_);
      return;
    case Call::kRun:
      (*a.function)();
      return;
  }
}

CallOutcome FlightProcess::Impl::create(SimTime truth, std::int64_t onboard_ns,
                                        std::uint32_t boot_count, ResetCause cause) {
  require_between_calls("create");
  if (created) throw std::logic_error("FlightProcess::create: " + name + " was created before");
  created = alive = true;
  orrery_boot boot{};
  boot.now_ns = onboard_ns;
  boot.spacecraft = options.spacecraft.c_str();
  boot.process = options.process.c_str();
  boot.boot_count = boot_count;
  boot.reset_cause = static_cast<std::uint32_t>(cause);
  boot.config = options.config.data();
  boot.config_bytes = static_cast<std::uint32_t>(options.config.size());
  return call({.call = Call::kCreate, .onboard_ns = onboard_ns, .boot = &boot}, truth, {});
}

CallOutcome FlightProcess::Impl::call(CallArguments arguments, SimTime truth, Bytes data) {
  input_.assign(data.begin(), data.end());
  arguments.bytes = static_cast<std::uint32_t>(data.size());
  arguments_ = arguments;
  services.begin_call(truth, arguments.onboard_ns, arguments.call == Call::kCreate);
  begin_call();
  if (options.heap.fill && stack != nullptr) {
    stack->overwrite_used(hash_word(options.heap.seed, calls));
  }
  stopwatch.start();
  const bool returned =
      target != nullptr
          ? call_target()
          : internal::run_contained(
                contained_, [](void* self) { static_cast<Impl*>(self)->run_library_call(); }, this,
                capture_);
  stopwatch.stop();
  if (target != nullptr && returned) report_target_time();
  end_call(truth);
  if (options.calls != nullptr) record_call(data, returned);
  if (returned) return judge(arguments_, truth);
  die_of_last_call(truth);
  return CallOutcome::kCrashed;
}

void FlightProcess::Impl::record_call(Bytes data, bool returned) {
  CallRecording& calls_made = *options.calls;
  const CallArguments& a = arguments_;
  if (a.call == Call::kCreate) {
    calls_made.boot({a.onboard_ns, a.boot->boot_count, a.boot->reset_cause, options.spacecraft,
                     options.process, options.config});
  } else if (a.call == Call::kInput) {
    calls_made.input(a.onboard_ns, a.port->id, data);
  } else if (a.call == Call::kTick) {
    calls_made.tick(a.onboard_ns);
  } else if (a.call == Call::kDestroy) {
    calls_made.destroy();
  }
  for (const OutputRow& row : outputs) {
    calls_made.output(ports[row.port].id, Bytes(output_bytes).subspan(row.begin, row.bytes));
  }
  if (tick_request) calls_made.tick_request(*tick_request);
  if (returned) {
    calls_made.status(a.status);
  } else {
    calls_made.crash();
  }
}

void FlightProcess::Impl::begin_call() {
  outputs.clear();
  output_bytes.clear();
  logs.clear();
  log_text.clear();
  tick_request.reset();
  record = CallRecord{};
  if (work != nullptr) {
    work->count = 0;
    work->limit = options.work_budget == 0 ? UINT64_MAX : options.work_budget;
    work->exceeded = [] {
      internal::end_running_call(CrashKind::kWorkBudget, "the call took more edges than it may");
    };
  }
  if (heap != nullptr) {
    heap->blocks().mark();
    allocations_before_ = heap->blocks().allocations();
  }
}

void FlightProcess::Impl::end_call(SimTime truth) {
  record.t = truth;
  if (heap != nullptr) {
    const BlockHeap& blocks = heap->blocks();
    record.resting_bytes = blocks.live_bytes();
    record.transient_peak_bytes = blocks.peak_since_mark_bytes();
    record.heap_bytes = blocks.heap_bytes();
    record.largest_free_bytes = blocks.largest_free_bytes();
    record.free_list_length = blocks.free_list_length();
    record.allocations = blocks.allocations() - allocations_before_;
    if (heap->watch_if_any() != nullptr) {
      if (HeapTraceWriter* trace = heap->watch().trace()) trace->call_returned(truth);
    }
  }
  report_floating_point();
  report_written_global();
}

CallOutcome FlightProcess::Impl::judge(const CallArguments& arguments, SimTime truth) {
  const std::int32_t status = arguments.status;
  if (status == ORRERY_OK) return CallOutcome::kDone;
  const std::string returned = "it returned status " + std::to_string(status);
  if (arguments.call == Call::kCreate) {
    die(CrashKind::kBootFailure, returned, truth, arguments);
    return CallOutcome::kCrashed;
  }
  if (status == ORRERY_REJECTED || status == ORRERY_NOT_FOUND || status == ORRERY_TOO_SMALL) {
    return CallOutcome::kRejected;
  }
  die(status == ORRERY_FATAL ? CrashKind::kFatalStatus : CrashKind::kUnknownStatus, returned, truth,
      arguments);
  return CallOutcome::kCrashed;
}

void FlightProcess::Impl::require_between_calls(const char* function) const {
  if (internal::call_in_progress()) {
    throw std::logic_error(std::string("FlightProcess::") + function + ": " + name +
                           ": a call within a call");
  }
}

void FlightProcess::Impl::require_alive(const char* function) const {
  require_between_calls(function);
  if (!alive) {
    throw std::logic_error(std::string("FlightProcess::") + function + ": " + name +
                           (crashed   ? " has crashed"
                            : created ? " was shut down"
                                      : " was not created yet"));
  }
}

void FlightProcess::Impl::report_floating_point() {
  if (!contained_.changed_floating_point || reported_floating_point_) return;
  reported_floating_point_ = true;
  host_log(LogLevel::kWarning,
           "flight code changed the floating-point control registers (flush to zero, rounding or "
           "exceptions); they are put back after every call");
}

void FlightProcess::Impl::report_written_global() {
  ++calls;
  const bool looks = calls <= 16 || (calls & (calls - 1)) == 0;  // then 32, 64 ...
  if (!looks || !written_global.empty()) return;
  for (std::size_t i = 0; i < globals.size() && written_global.empty(); ++i) {
    written_global = globals[i].changed();
    if (i > 0 && !written_global.empty()) written_global += " of " + watched_dependencies[i - 1];
  }
  if (written_global.empty()) return;
  host_log(LogLevel::kWarning, "flight library \"" + options.library +
                                   "\" writes its own globals (" + written_global +
                                   "), which all its processes share under Isolation::kShared; "
                                   "Isolation::kCopy gives each its own");
}

void FlightProcess::Impl::host_log(LogLevel level, std::string_view text) {
  logs.push_back({level, log_text.size(), text.size()});
  log_text += text;
}

}  // namespace orrery
