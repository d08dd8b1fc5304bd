#include <orrery/harness/flight/containment.hpp>
#include <orrery/harness/flight/flight_library.hpp>
#include <orrery/harness/flight/flight_process.hpp>
#include <orrery/harness/flight/host_stopwatch.hpp>
#include <orrery/harness/flight/port_table.hpp>
#include <orrery/harness/flight/stack_frames.hpp>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <orrery_flight.h>
#include <stdexcept>

namespace orrery {
namespace {

using internal::SimulatorScope;

enum class Call : std::uint8_t { kLoad, kCreate, kInput, kTick, kDestroy };

const char* call_name(Call call) {
  static constexpr const char* kNames[] = {"load", "create", "input", "tick", "destroy"};
  return kNames[static_cast<int>(call)];
}

// What a call of the library needs, as plain data: the other side of the boundary reads it.
struct Arguments {
  Call call = Call::kLoad;
  std::int64_t onboard_ns = 0;
  const orrery_boot* boot = nullptr;
  const FlightPort* port = nullptr;
  std::uint32_t bytes = 0;
  std::int32_t status = ORRERY_OK;  // result
};

void check_name(const char* what, const std::string& name) {
  if (name.empty() || name.find('/') != std::string::npos || name[0] == '.') {
    throw std::invalid_argument(std::string("FlightProcess: the ") + what + "'s name \"" + name +
                                "\" is empty, begins with '.', or contains '/'");
  }
}

FirstFitOptions heap_options(const FlightProcessOptions& options) {
  return {.alignment = options.heap_alignment, .limit_bytes = options.heap_bytes};
}

}  // namespace

class FlightProcess::Impl {
 public:
  explicit Impl(FlightProcessOptions options);
  ~Impl();

  CallOutcome call(Arguments arguments, SimTime truth, Bytes data);
  CallOutcome create(SimTime truth, std::int64_t onboard_ns, std::uint32_t boot_count,
                     std::uint32_t reset_cause);
  bool shut_down_library();
  void require_alive(const char* function) const;
  void require_between_calls(const char* function) const;
  void die_of_last_call(SimTime truth);
  void die(CrashKind kind, std::string message, SimTime truth, const Arguments& arguments);

  // What the library may ask of the host, within a call.
  std::int32_t output(std::uint32_t port, const void* data, std::uint32_t bytes);
  void request_tick(std::int64_t at_ns);
  void log(std::int32_t level, const char* line);
  std::int32_t load_slot(std::uint32_t slot, void* buffer, std::uint32_t capacity);
  std::int32_t store_slot(std::uint32_t slot, const void* data, std::uint32_t bytes);

  FlightProcessOptions options;
  std::string name;
  std::vector<FlightPort> ports;
  const orrery_flight* flight = nullptr;
  std::unique_ptr<SimulatedHeap> heap;     // null where heaps are not simulated
  std::unique_ptr<FlightLibrary> library;  // unloaded while the heap is still there

  bool created = false, alive = false, crashed = false, ended = false;
  CallRecord record;
  CrashReport crash;
  std::optional<std::int64_t> tick_request;
  Storage storage;
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
  void begin_call();
  void end_call(SimTime truth);
  void run_library_call();
  CallOutcome judge(const Arguments& arguments, SimTime truth);
  void host_log(LogLevel level, std::string_view text);
  void report_floating_point();
  bool calling() const { return internal::running_process() == &contained_; }
  std::uint32_t find_output(std::uint32_t id) const;
  static void on_heap_fault(void* self, const HeapFault& fault);

  internal::ContainedProcess contained_;
  internal::CrashCapture capture_;
  orrery_host host_{};
  void* self_ = nullptr;
  Arguments arguments_;
  ByteBuffer input_;    // a copy, so that flight code cannot change the simulator's
  ByteBuffer staging_;  // a store that may still fault
  std::uint64_t allocations_before_ = 0;
  bool reported_floating_point_ = false;
};

FlightProcess::Impl::Impl(FlightProcessOptions o) : options(std::move(o)) {
  check_name("spacecraft", options.spacecraft);
  check_name("process", options.process);
  name = process_name(options);
  contained_.name = name.c_str();
  if (internal::call_in_progress()) {
    throw std::logic_error("FlightProcess: loaded from within a call of flight code");
  }
  if (heap_simulation_available()) {
    heap = std::make_unique<SimulatedHeap>(heap_options(options));
    heap->blocks().set_fault_handler(on_heap_fault, this);
    contained_.heap = heap.get();
  }
  host_.size = sizeof host_;
  host_.abi_version = ORRERY_ABI_VERSION;
  host_.context = this;
  host_.output = [](void* context, std::uint32_t port, const void* data, std::uint32_t bytes) {
    return static_cast<Impl*>(context)->output(port, data, bytes);
  };
  host_.request_tick = [](void* context, std::int64_t at_ns) {
    static_cast<Impl*>(context)->request_tick(at_ns);
  };
  host_.log = [](void* context, std::int32_t level, const char* line) {
    static_cast<Impl*>(context)->log(level, line);
  };
  host_.nv_load = [](void* context, std::uint32_t slot, void* buffer, std::uint32_t capacity) {
    return static_cast<Impl*>(context)->load_slot(slot, buffer, capacity);
  };
  host_.nv_store = [](void* context, std::uint32_t slot, const void* data, std::uint32_t bytes) {
    return static_cast<Impl*>(context)->store_slot(slot, data, bytes);
  };
  load();
}

void FlightProcess::Impl::load() {
  library = std::make_unique<FlightLibrary>(options);
  const auto refuse = [&](const std::string& reason) {
    throw std::invalid_argument("flight library \"" + options.library + "\" (" + library->path() +
                                "): " + reason);
  };
  if (library->symbol("orrery_flight_entry") == nullptr) {
    refuse(
        "it does not export orrery_flight_entry, by which flight software is entered; is it linked "
        "from orrery_flight.h, and with that symbol visible?");
  }
  begin_call();
  arguments_ = Arguments{};
  if (!internal::run_contained(
          contained_, [](void* self) { static_cast<Impl*>(self)->run_library_call(); }, this,
          capture_)) {
    const CrashKind kind = capture_.kind;
    die(kind, capture_.message, SimTime{}, arguments_);
    if (heap == nullptr) library->keep_loaded();
    refuse(std::string("it crashes while it is loaded: ") + to_string(kind) + ": " + crash.message);
  }
  try {
    ports = internal::checked_ports(flight);
  } catch (const std::invalid_argument& error) {
    shut_down_library();
    refuse(error.what());
  }
  input_.reserve(64);  // never a null pointer, of an empty message either
}

FlightProcess::Impl::~Impl() {
  if (!crashed && !ended) shut_down_library();
  // Without our __cxa_atexit the C library keeps the dead process's destructors, and runs them.
  if (crashed && heap == nullptr) library->keep_loaded();
}

// What remains of the library after destroy: its static destructors, in reverse order. False: they
// crashed.
bool FlightProcess::Impl::shut_down_library() {
  alive = false;
  ended = true;
  return internal::run_contained(
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
      },
      this, capture_);
}

// ---- calls

// Flight code from here on.
void FlightProcess::Impl::run_library_call() {
  Arguments& a = arguments_;
  switch (a.call) {
    case Call::kLoad: {
      using Entry = const orrery_flight* (*)();
      library->run_constructors();
      flight = reinterpret_cast<Entry>(library->symbol("orrery_flight_entry"))();
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
  }
}

CallOutcome FlightProcess::Impl::create(SimTime truth, std::int64_t onboard_ns,
                                        std::uint32_t boot_count, std::uint32_t reset_cause) {
  require_between_calls("create");
  if (created) throw std::logic_error("FlightProcess::create: " + name + " was created before");
  created = alive = true;
  orrery_boot boot{};
  boot.now_ns = onboard_ns;
  boot.spacecraft = options.spacecraft.c_str();
  boot.process = options.process.c_str();
  boot.boot_count = boot_count;
  boot.reset_cause = reset_cause;
  boot.config = options.config.data();
  boot.config_bytes = static_cast<std::uint32_t>(options.config.size());
  return call({.call = Call::kCreate, .onboard_ns = onboard_ns, .boot = &boot}, truth, {});
}

CallOutcome FlightProcess::Impl::call(Arguments arguments, SimTime truth, Bytes data) {
  input_.assign(data.begin(), data.end());
  arguments.bytes = static_cast<std::uint32_t>(data.size());
  arguments_ = arguments;
  begin_call();
  stopwatch.start();
  const bool returned = internal::run_contained(
      contained_, [](void* self) { static_cast<Impl*>(self)->run_library_call(); }, this, capture_);
  stopwatch.stop();
  end_call(truth);
  if (returned) return judge(arguments_, truth);
  die_of_last_call(truth);
  return CallOutcome::kCrashed;
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
  if (heap != nullptr) {
    heap->blocks().mark();
    allocations_before_ = heap->blocks().allocations();
  }
}

void FlightProcess::Impl::end_call(SimTime truth) {
  record = CallRecord{.t = truth};
  if (heap != nullptr) {
    const FirstFitHeap& blocks = heap->blocks();
    record.resting_bytes = blocks.live_bytes();
    record.transient_peak_bytes = blocks.peak_since_mark_bytes();
    record.heap_bytes = blocks.heap_bytes();
    record.largest_free_bytes = blocks.largest_free_bytes();
    record.allocations = blocks.allocations() - allocations_before_;
  }
  report_floating_point();
}

CallOutcome FlightProcess::Impl::judge(const Arguments& arguments, SimTime truth) {
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
                              const Arguments& arguments) {
  crash = CrashReport{};
  crash.spacecraft = options.spacecraft;
  crash.process = options.process;
  crash.library = options.library;
  crash.t = truth;
  crash.onboard_ns = arguments.onboard_ns;
  crash.kind = kind;
  crash.signal = kind == CrashKind::kSignal || kind == CrashKind::kAbort ? capture_.signal : 0;
  crash.status = arguments.status;
  crash.message = std::move(message);
  crash.call = call_name(arguments.call);
  if (arguments.port != nullptr) {
    crash.port = arguments.port->name;
    crash.input = input_;
  }
  crash.backtrace = internal::stack_frames(capture_, library->loaded_path());
  capture_.frame_count = 0;

  alive = false;
  crashed = true;
  outputs.clear();
  tick_request.reset();
  contained_.exit_functions.clear();
  if (heap != nullptr) heap->drop();
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

void FlightProcess::Impl::host_log(LogLevel level, std::string_view text) {
  logs.push_back({level, log_text.size(), text.size()});
  log_text += text;
}

void FlightProcess::Impl::on_heap_fault(void* self, const HeapFault& fault) {
  const Impl& process = *static_cast<Impl*>(self);
  char message[160];
  if (fault.kind == HeapFault::Kind::kExhausted) {
    if (process.options.heap_exhaustion != HeapExhaustion::kCrash) return;
    std::snprintf(message, sizeof message, "%s of %llu bytes would pass the heap's limit of %llu",
                  fault.during, static_cast<unsigned long long>(fault.bytes),
                  static_cast<unsigned long long>(process.heap->blocks().limit_bytes()));
    internal::end_running_call(CrashKind::kHeapExhausted, message);
    return;
  }
  std::snprintf(message, sizeof message, "%s %p in %s", to_string(fault.kind), fault.address,
                fault.during);
  internal::end_running_call(CrashKind::kHeapFault, message);
  // No flight code is running: the simulator, or the test, freed what it should not have.
  std::fprintf(stderr, "orrery: heap of %s, outside of its calls: %s\n", process.name.c_str(),
               message);
  std::abort();
}

// ---- callbacks. What reads or writes flight memory does so as flight code; the rest is simulator
// code under SimulatorScope. A crash may leave them between any two lines.

std::uint32_t FlightProcess::Impl::find_output(std::uint32_t id) const {
  for (std::uint32_t i = 0; i < ports.size(); ++i) {
    if (ports[i].direction == PortDirection::kOut && ports[i].id == id) return i;
  }
  return UINT32_MAX;
}

std::int32_t FlightProcess::Impl::output(std::uint32_t port, const void* data,
                                         std::uint32_t bytes) {
  if (!calling() || arguments_.call == Call::kDestroy || arguments_.call == Call::kLoad) {
    return ORRERY_REJECTED;
  }
  const std::size_t begin = output_bytes.size();
  const std::uint32_t index = find_output(port);
  if (index == UINT32_MAX) return ORRERY_NOT_FOUND;
  if (bytes > ports[index].max_bytes) return ORRERY_TOO_SMALL;
  {
    const SimulatorScope scope;
    output_bytes.resize(begin + bytes);
  }
  if (bytes > 0) std::memcpy(output_bytes.data() + begin, data, bytes);
  const SimulatorScope scope;
  outputs.push_back({index, begin, bytes});
  return ORRERY_OK;
}

void FlightProcess::Impl::request_tick(std::int64_t at_ns) {
  if (calling() && arguments_.call != Call::kDestroy) tick_request = at_ns;
}

void FlightProcess::Impl::log(std::int32_t level, const char* line) {
  constexpr std::size_t kMostCharacters = 1000;
  if (!calling()) return;
  const std::size_t length = line == nullptr ? 0 : strnlen(line, kMostCharacters);
  const std::size_t begin = log_text.size();
  {
    const SimulatorScope scope;
    log_text.resize(begin + length);
  }
  if (length > 0) std::memcpy(log_text.data() + begin, line, length);
  const SimulatorScope scope;
  logs.push_back({static_cast<LogLevel>(std::clamp(level, ORRERY_DEBUG + 0, ORRERY_ERROR + 0)),
                  begin, length});
}

std::int32_t FlightProcess::Impl::load_slot(std::uint32_t slot, void* buffer,
                                            std::uint32_t capacity) {
  if (!calling()) return ORRERY_REJECTED;
  for (const auto& [number, content] : storage) {
    if (number != slot) continue;
    if (content.size() > capacity) return ORRERY_TOO_SMALL;
    if (!content.empty()) std::memcpy(buffer, content.data(), content.size());
    return static_cast<std::int32_t>(content.size());
  }
  return ORRERY_NOT_FOUND;
}

std::int32_t FlightProcess::Impl::store_slot(std::uint32_t slot, const void* data,
                                             std::uint32_t bytes) {
  if (!calling()) return ORRERY_REJECTED;
  std::uint64_t others = 0;
  for (const auto& [number, content] : storage) others += number == slot ? 0 : content.size();
  if (others + bytes > options.storage_bytes) return ORRERY_TOO_SMALL;
  {
    const SimulatorScope scope;
    staging_.resize(bytes);
  }
  if (bytes > 0) std::memcpy(staging_.data(), data, bytes);
  const SimulatorScope scope;
  const auto place = std::lower_bound(
      storage.begin(), storage.end(), slot,
      [](const auto& entry, std::uint32_t number) { return entry.first < number; });
  if (place != storage.end() && place->first == slot) {
    place->second = staging_;
  } else {
    storage.insert(place, {slot, staging_});
  }
  return ORRERY_OK;
}

// ---- the public face

FlightProcess::FlightProcess(FlightProcessOptions options)
    : impl_(std::make_unique<Impl>(std::move(options))) {}

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
                                  std::uint32_t reset_cause) {
  return impl_->create(truth, onboard_ns, boot_count, reset_cause);
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
void FlightProcess::set_heap_limit(std::uint64_t bytes) {
  impl_->options.heap_bytes = bytes;
  if (impl_->heap != nullptr) impl_->heap->set_limit(bytes);
}
const FlightProcess::Storage& FlightProcess::storage() const {
  return impl_->storage;
}
void FlightProcess::set_storage(Storage storage) {
  impl_->storage = std::move(storage);
}
const std::vector<std::string>& FlightProcess::edited_symbols() const {
  return impl_->library->edited_symbols();
}
const std::vector<std::string>& FlightProcess::shared_dependencies() const {
  return impl_->library->shared_dependencies();
}
Duration FlightProcess::host_time_in_flight() const {
  return impl_->stopwatch.total();
}

}  // namespace orrery
