// How a process ends that crashes, and what is said of it.

#include <orrery/harness/flight/flight_process_impl.hpp>
#include <orrery/harness/flight/stack_frames.hpp>
#include <orrery/harness/kernel/random.hpp>

#include <cstdio>
#include <cstdlib>
#include <utility>

namespace orrery {
namespace {

using internal::CallArguments;
using Call = internal::LibraryCall;

const char* call_name(Call call) {
  static constexpr const char* kNames[] = {"load", "create", "input", "tick", "destroy", "run"};
  return kNames[static_cast<int>(call)];
}

}  // namespace

void FlightProcess::Impl::die_of_last_call(SimTime truth) {
  const bool lost = capture_.kind == CrashKind::kTargetLost;
  die(capture_.kind, lost ? target_loss_ : capture_.message, truth, arguments_);
}

void FlightProcess::Impl::die(CrashKind kind, std::string message, SimTime truth,
                              const CallArguments& arguments) {
  crash = CrashReport{};
  crash.spacecraft = options.spacecraft;
  crash.process = options.process;
  crash.library = options.library;
  crash.t = truth;
  crash.onboard_ns = arguments.onboard_ns;
  crash.kind = kind;
  const bool raised =
      kind == CrashKind::kSignal || kind == CrashKind::kAbort || kind == CrashKind::kStackOverflow;
  crash.signal = raised ? capture_.signal : 0;
  crash.status = arguments.status;
  crash.message = std::move(message);
  crash.call = call_name(arguments.call);
  crash.seed = options.random == nullptr ? 0 : options.random->seed();
  if (arguments.port != nullptr) {
    crash.port = arguments.port->name;
    crash.input = input_;
  }
  if (work != nullptr) crash.work = work->count;
  if (library != nullptr) {
    crash.backtrace = internal::stack_frames(capture_, library->loaded_paths());
  }
  capture_.frame_count = 0;
  if (kind == CrashKind::kHeapFault) tell_of_block(fault_address_);
  mark_half_initialised();
  cut_off();
}

// In a copy they go with it.
void FlightProcess::Impl::mark_half_initialised() {
  std::vector<const void*> guards;
  guards.swap(contained_.statics_begun);
  if (options.isolation != Isolation::kShared || guards.empty()) return;
  library->keep_loaded();
  for (const void* guard : guards) {
    std::string what = "its name is not known";
    for (const internal::GlobalsWatch& watch : globals) {
      const std::string found = watch.name_of(static_cast<const std::byte*>(guard));
      if (!found.starts_with("the byte")) what = found;
    }
    internal::mark_half_initialised(
        guard, "flight library \"" + options.library + "\" cannot be used any more: " + name +
                   " crashed while it initialised a static, which all its processes share under "
                   "Isolation::kShared (" +
                   what + ")");
  }
}

void FlightProcess::Impl::cut_off() {
  alive = false;
  crashed = true;
  outputs.clear();
  tick_request.reset();
  contained_.exit_functions.clear();
  files.close_all();
  if (heap != nullptr) heap->drop();
  target.reset();
}

void FlightProcess::Impl::tell_of_block(const void* address) {
  if (heap == nullptr || heap->watch_if_any() == nullptr) return;
  const HeapSite* site = heap->watch_if_any()->site_of(address);
  if (site == nullptr) return;
  crash.block_allocated = site->allocated_at;
  crash.block_allocated_by = frames(site->allocated_by);
  crash.block_freed = site->freed_at;
  crash.block_freed_by = frames(site->freed_by);
}

void FlightProcess::Impl::on_heap_fault(void* self, const HeapFault& fault) {
  Impl& process = *static_cast<Impl*>(self);
  char message[160];
  if (fault.kind == HeapFault::Kind::kExhausted) {
    // A sanitizer tells when it is too late for a null.
    if (process.options.heap_exhaustion != HeapExhaustion::kCrash && heap_simulation_available()) {
      return;
    }
    std::snprintf(message, sizeof message, "%s of %llu bytes would pass the heap's limit of %llu",
                  fault.during, static_cast<unsigned long long>(fault.bytes),
                  static_cast<unsigned long long>(process.heap->blocks().limit_bytes()));
    internal::end_running_call(CrashKind::kHeapExhausted, message);
    return;
  }
  process.fault_address_ = fault.address;
  std::snprintf(message, sizeof message, "%s %p in %s", to_string(fault.kind), fault.address,
                fault.during);
  internal::end_running_call(CrashKind::kHeapFault, message);
  // No flight code is running: the simulator, or the test, freed what it should not have.
  std::fprintf(stderr, "orrery: heap of %s, outside of its calls: %s\n", process.name.c_str(),
               message);
  std::abort();
}

}  // namespace orrery
