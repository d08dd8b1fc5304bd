#include <orrery/harness/flight/call_recording.hpp>
#include <orrery/harness/flight/flight_process_impl.hpp>
#include <orrery/harness/flight/library_closure.hpp>
#include <orrery/harness/flight/port_table.hpp>
#include <orrery/harness/flight/stack_frames.hpp>
#include <orrery/harness/kernel/hash.hpp>
#include <orrery/harness/kernel/random.hpp>
#include <orrery/harness/kernel/text.hpp>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <dlfcn.h>
#include <link.h>
#include <stdexcept>

namespace orrery {
namespace {

using internal::CallArguments;
using Call = internal::LibraryCall;

const char* call_name(Call call) {
  static constexpr const char* kNames[] = {"load", "create", "input", "tick", "destroy", "run"};
  return kNames[static_cast<int>(call)];
}

void check_name(const char* what, const std::string& name) {
  if (name.empty() || name.find('/') != std::string::npos || name[0] == '.') {
    throw std::invalid_argument(std::string("FlightProcess: the ") + what + "'s name \"" + name +
                                "\" is empty, begins with '.', or contains '/'");
  }
}

void check_limits(const FlightProcessOptions& options) {
  using internal::FlightStack;
  if (options.stack_bytes < FlightStack::kLeast_bytes ||
      options.stack_bytes > FlightStack::kMost_bytes) {
    throw std::invalid_argument(
        "FlightProcess: stack_bytes = " + std::to_string(options.stack_bytes) + "; it is " +
        std::to_string(FlightStack::kLeast_bytes) + " to " +
        std::to_string(FlightStack::kMost_bytes));
  }
  if (options.host_time_limit < Duration{0}) {
    throw std::invalid_argument("FlightProcess: host_time_limit = " +
                                to_string(options.host_time_limit) + "; it is 0 (none) or more");
  }
}

HeapOptions heap_options(const FlightProcessOptions& options) {
  return {.alignment = options.heap_alignment,
          .limit_bytes = options.heap_bytes,
          .rules = options.heap};
}

std::shared_ptr<NonVolatileMemory> fresh_memory(const FlightProcessOptions& options) {
  return std::make_shared<NonVolatileMemory>(
      options.storage_bytes,
      FlightFiles(options.files, options.file_bytes, options.power_loss_takes_unsynced));
}

}  // namespace

FlightProcess::Impl::Impl(FlightProcessOptions o, std::shared_ptr<NonVolatileMemory> earlier)
    : options(std::move(o)),
      memory(earlier != nullptr ? std::move(earlier) : fresh_memory(options)),
      files(options, memory, services) {
  check_name("spacecraft", options.spacecraft);
  check_name("process", options.process);
  // Also where heaps are not simulated: a mistake must not show under one preset only.
  check_heap_options("FlightProcess", heap_options(options));
  check_limits(options);
  name = process_name(options);
  contained_.name = name.c_str();
  contained_.services = &services;
  contained_.files = &files;
  if (internal::call_in_progress()) {
    throw std::logic_error("FlightProcess: loaded from within a call of flight code");
  }
  if (heap_simulation_available() || heap_accounting_available()) {
    heap = std::make_unique<SimulatedHeap>(heap_options(options));
    heap->blocks().set_fault_handler(on_heap_fault, this);
    if (options.isolation == Isolation::kShared) heap->take_others_blocks();
    contained_.heap = heap.get();
  }
  if (internal::FlightStack::available()) {
    stack = std::make_unique<internal::FlightStack>(options.stack_bytes);
    contained_.stack = stack.get();
  }
  contained_.host_limit_ns = to_ns(options.host_time_limit);
  fill_host_table();
  load();
}

void FlightProcess::Impl::load() {
  library = std::make_unique<FlightLibrary>(options);
  const auto refuse = [&](const std::string& reason) {
    throw std::invalid_argument("flight library \"" + options.library + "\" (" + library->path() +
                                "): " + reason);
  };
  if (options.adapter) {
    adapter.emplace(options);
  } else if (library->symbol("orrery_flight_entry") == nullptr) {
    refuse(
        "it does not export orrery_flight_entry, by which flight software is entered; is it linked "
        "from orrery_flight.h, and with that symbol visible?");
  }
  find_work_counter();
  begin_call();
  arguments_ = CallArguments{};
  if (!internal::run_contained(
          contained_, [](void* self) { static_cast<Impl*>(self)->run_library_call(); }, this,
          capture_)) {
    const CrashKind kind = capture_.kind;
    die(kind, capture_.message, SimTime{}, arguments_);
    if (!heap_simulation_available()) library->keep_loaded();
    refuse(std::string("it crashes while it is loaded: ") + to_string(kind) + ": " + crash.message);
  }
  try {
    ports = internal::checked_ports(flight);
  } catch (const std::invalid_argument& error) {
    shut_down_library();
    refuse(error.what());
  }
  if (options.isolation == Isolation::kShared) watch_globals();
  input_.reserve(64);  // never a null pointer, of an empty message either
}

void FlightProcess::Impl::find_work_counter() {
  using Counter = orrery_work* (*)();
  if (void* counter = library->symbol("orrery_work_counter")) {
    work = reinterpret_cast<Counter>(counter)();
  } else if (options.work_budget != 0) {
    throw std::invalid_argument("flight library \"" + options.library + "\" (" + library->path() +
                                "): a work budget needs a library that counts its work; build it "
                                "with orrery_add_flight_library(... COUNT_WORK)");
  }
}

FlightProcess::Impl::~Impl() {
  if (!crashed && !ended) shut_down_library();
  // Without our __cxa_atexit the C library keeps the dead process's destructors, and runs them.
  if (crashed && !heap_simulation_available()) library->keep_loaded();
}

// What remains of the library after destroy: its static destructors, in reverse order. False: they
// crashed.
bool FlightProcess::Impl::shut_down_library() {
  alive = false;
  ended = true;
  const bool returned = internal::run_contained(
      contained_,
      [](void* argument) {
        Impl& self = *static_cast<Impl*>(argument);
        std::vector<internal::ExitFunction>& functions = self.contained_.exit_functions;
        while (!functions.empty()) {
          const internal::ExitFunction last = functions.back();
          functions.pop_back();
          last.function(last.argument);
        }
        self.library->run_destructors();
        self.files.flush();
      },
      this, capture_);
  files.close_all();
  return returned;
}

// ---- calls

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
  const bool returned = internal::run_contained(
      contained_, [](void* self) { static_cast<Impl*>(self)->run_library_call(); }, this, capture_);
  stopwatch.stop();
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

void FlightProcess::Impl::die_of_last_call(SimTime truth) {
  die(capture_.kind, capture_.message, truth, arguments_);
}

void FlightProcess::Impl::begin_call() {
  outputs.clear();
  output_bytes.clear();
  logs.clear();
  log_text.clear();
  tick_request.reset();
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
  record = CallRecord{.t = truth};
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
  crash.backtrace = internal::stack_frames(capture_, library->loaded_paths());
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

std::vector<StackFrame> FlightProcess::Impl::frames(const CallStack& calls_made) const {
  internal::CrashCapture capture;
  for (const void* frame : calls_made)
    capture.frames[capture.frame_count++] = const_cast<void*>(frame);
  return internal::stack_frames(capture, library->loaded_paths());
}

std::string FlightProcess::Impl::check_heap() {
  if (heap == nullptr || crashed) return "";
  const std::optional<HeapFault> fault = heap->blocks().find_fault();
  if (!fault) return "";
  char address[32];
  std::snprintf(address, sizeof address, "%p", fault->address);
  std::string text = "heap of " + name + ": " + to_string(fault->kind) + " at " + address + "\n";
  const HeapWatch* watch = heap->watch_if_any();
  const HeapSite* site = watch == nullptr ? nullptr : watch->site_of(fault->address);
  if (site == nullptr) return text;
  text += "  the block was allocated at " + to_string(site->allocated_at) + " by\n" +
          to_string(frames(site->allocated_by));
  if (site->live) return text;
  return text + "  and freed at " + to_string(site->freed_at) + " by\n" +
         to_string(frames(site->freed_by));
}

std::vector<LeakReport> FlightProcess::Impl::leaks(std::uint64_t after, std::uint64_t until) const {
  if (!options.heap.track_sites) {
    throw std::logic_error("FlightProcess::leaks: " + name +
                           " keeps no record of its blocks; set HeapRules::track_sites");
  }
  std::vector<LeakReport> reports;
  if (heap == nullptr) return reports;
  for (const HeapLeak& leak : heap->watch_if_any()->live_since(after, until)) {
    reports.push_back({leak.blocks, leak.bytes, leak.first, frames(leak.allocated_by)});
  }
  return reports;
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

// Of the library and of what it links of the team's own.
void FlightProcess::Impl::watch_globals() {
  globals.emplace_back(library->loaded_path(), library->base(), work, sizeof *work);
  const internal::LibraryClosure closure = internal::read_closure(library->path());
  for (std::size_t i = 0; i + 1 < closure.parts.size(); ++i) {
    const std::string& path = closure.parts[i].path;
    void* handle = dlopen(path.c_str(), RTLD_LAZY | RTLD_NOLOAD);
    if (handle == nullptr) continue;
    const std::uintptr_t base = static_cast<const link_map*>(handle)->l_addr;
    globals.emplace_back(path, base, nullptr, 0);
    watched_dependencies.push_back(closure.parts[i].name);
    dlclose(handle);
  }
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

// ---- the public face

FlightProcess::FlightProcess(FlightProcessOptions options,
                             std::shared_ptr<NonVolatileMemory> memory)
    : impl_(std::make_unique<Impl>(std::move(options), std::move(memory))) {}

FlightProcess::~FlightProcess() {
  if (impl_->alive) shut_down(impl_->record.t, 0);
}

const FlightProcessOptions& FlightProcess::options() const {
  return impl_->options;
}
const std::vector<FlightPort>& FlightProcess::ports() const {
  return impl_->ports;
}
bool FlightProcess::alive() const {
  return impl_->alive;
}
bool FlightProcess::has_tick() const {
  return impl_->flight->tick != nullptr;
}

CallOutcome FlightProcess::create(SimTime truth, std::int64_t onboard_ns, std::uint32_t boot_count,
                                  ResetCause cause) {
  return impl_->create(truth, onboard_ns, boot_count, cause);
}
void FlightProcess::cut_off() {
  impl_->require_between_calls("cut_off");
  if (!impl_->crashed && !impl_->ended) impl_->cut_off();
}

CallOutcome FlightProcess::input(SimTime truth, std::int64_t onboard_ns, const FlightPort& port,
                                 Bytes data) {
  impl_->require_alive("input");
  return impl_->call({.call = Call::kInput, .onboard_ns = onboard_ns, .port = &port}, truth, data);
}

CallOutcome FlightProcess::tick(SimTime truth, std::int64_t onboard_ns) {
  impl_->require_alive("tick");
  if (!has_tick()) {
    throw std::logic_error("FlightProcess::tick: " + impl_->name + " has no tick function");
  }
  return impl_->call({.call = Call::kTick, .onboard_ns = onboard_ns}, truth, {});
}

CallOutcome FlightProcess::run(SimTime truth, std::int64_t onboard_ns,
                               const std::function<void()>& function) {
  impl_->require_alive("run");
  return impl_->call({.call = Call::kRun, .onboard_ns = onboard_ns, .function = &function}, truth,
                     {});
}
void* FlightProcess::symbol(const char* symbol_name) const {
  return impl_->library->symbol(symbol_name);
}

CallOutcome FlightProcess::shut_down(SimTime truth, std::int64_t onboard_ns) {
  impl_->require_alive("shut_down");
  const CallOutcome outcome =
      impl_->call({.call = Call::kDestroy, .onboard_ns = onboard_ns}, truth, {});
  if (outcome == CallOutcome::kCrashed || impl_->shut_down_library()) return outcome;
  impl_->die_of_last_call(truth);
  return CallOutcome::kCrashed;
}

void FlightProcess::end(CrashKind kind, const std::string& message, SimTime truth,
                        std::int64_t onboard_ns) {
  impl_->require_alive("end");
  impl_->die(kind, message, truth, {.call = Call::kTick, .onboard_ns = onboard_ns});
}

std::size_t FlightProcess::output_count() const {
  return impl_->outputs.size();
}
FlightProcess::Output FlightProcess::output(std::size_t index) const {
  const Impl::OutputRow& row = impl_->outputs.at(index);
  return {&impl_->ports[row.port], Bytes(impl_->output_bytes).subspan(row.begin, row.bytes)};
}
std::optional<std::int64_t> FlightProcess::tick_request() const {
  return impl_->tick_request;
}
std::size_t FlightProcess::log_count() const {
  return impl_->logs.size();
}
FlightProcess::LogLine FlightProcess::log_line(std::size_t index) const {
  const Impl::LogRow& row = impl_->logs.at(index);
  return {row.level, std::string_view(impl_->log_text).substr(row.begin, row.bytes)};
}
const CallRecord& FlightProcess::call_record() const {
  return impl_->record;
}
const CrashReport& FlightProcess::crash() const {
  return impl_->crash;
}

HeapFigures FlightProcess::heap() const {
  return impl_->heap == nullptr ? HeapFigures{} : impl_->heap->blocks().figures();
}
std::uint64_t FlightProcess::stack_high_water_bytes() const {
  return impl_->stack == nullptr ? 0 : impl_->stack->high_water_bytes();
}
std::uint64_t FlightProcess::work() const {
  return impl_->work == nullptr ? 0 : impl_->work->count;
}
Duration FlightProcess::virtual_time_spent() const {
  return impl_->services.spent();
}
bool FlightProcess::counts_work() const {
  return impl_->work != nullptr;
}
void FlightProcess::set_heap_limit(std::uint64_t bytes) {
  FlightProcessOptions changed = impl_->options;
  changed.heap_bytes = bytes;
  check_heap_options("FlightProcess::set_heap_limit", heap_options(changed));
  impl_->options.heap_bytes = bytes;
  if (impl_->heap != nullptr) impl_->heap->set_limit(bytes);
}
SimulatedHeap* FlightProcess::simulated_heap() {
  return impl_->heap.get();
}
std::string FlightProcess::check_heap() {
  return impl_->check_heap();
}
std::vector<LeakReport> FlightProcess::leaks(std::uint64_t after, std::uint64_t until) const {
  return impl_->leaks(after, until);
}
std::string to_string(const LeakReport& leak) {
  return std::to_string(leak.bytes) + " bytes in " + std::to_string(leak.blocks) +
         " blocks, the first of " + to_string(leak.first) + ", allocated by\n" +
         to_string(leak.allocated_by);
}

const std::shared_ptr<NonVolatileMemory>& FlightProcess::memory() const {
  return impl_->memory;
}
const std::vector<std::string>& FlightProcess::edited_symbols() const {
  return impl_->library->edited_symbols();
}
const std::string& FlightProcess::written_global() const {
  return impl_->written_global;
}
std::string FlightProcess::flip_bit(FlightMemory memory, double place) {
  impl_->require_between_calls("flip_bit");
  if (memory == FlightMemory::kGlobals) {
    return internal::flip_global(impl_->library->loaded_path(), impl_->library->base(), place);
  }
  if (impl_->heap == nullptr || !heap_simulation_available()) return "";
  BlockHeap& blocks = impl_->heap->blocks();
  const std::uint64_t bits = 8 * blocks.heap_bytes();
  if (bits == 0) return "";
  const auto bit =
      std::min(bits - 1, static_cast<std::uint64_t>(place * static_cast<double>(bits)));
  static_cast<std::byte*>(blocks.first_block())[bit / 8] ^= std::byte{1} << (bit % 8);
  return "bit " + std::to_string(bit % 8) + " of byte 0x" + hex_digits(bit / 8, 8) + " of the heap";
}
const std::vector<std::string>& FlightProcess::shared_dependencies() const {
  return impl_->library->shared_dependencies();
}
Duration FlightProcess::host_time_in_flight() const {
  return impl_->stopwatch.total();
}
std::uint64_t FlightProcess::last_host_ticks() const {
  return impl_->stopwatch.last_ticks();
}

}  // namespace orrery
