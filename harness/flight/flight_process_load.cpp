// How a process comes to be, and how it ends in good order.

#include <orrery/harness/flight/flight_process_impl.hpp>
#include <orrery/harness/flight/library_closure.hpp>
#include <orrery/harness/flight/port_table.hpp>

#include <dlfcn.h>
#include <link.h>
#include <stdexcept>

namespace orrery {
namespace {

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
  check_heap_options("FlightProcess", internal::heap_options(options));
  check_limits(options);
  name = process_name(options);
  contained_.name = name.c_str();
  contained_.services = &services;
  contained_.files = &files;
  if (internal::call_in_progress()) {
    throw std::logic_error("FlightProcess: loaded from within a call of flight code");
  }
  if (options.target.kind != TargetAddress::Kind::kHere) {
    reach_target();
    return;
  }
  if (heap_simulation_available() || heap_accounting_available()) {
    heap = std::make_unique<SimulatedHeap>(internal::heap_options(options));
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
  arguments_ = internal::CallArguments{};
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

FlightProcess::Impl::~Impl() {
  if (!crashed && !ended) shut_down_library();
  // Without our __cxa_atexit the C library keeps the dead process's destructors, and runs them.
  if (crashed && library != nullptr && !heap_simulation_available()) library->keep_loaded();
}

// What remains of the library after destroy: its static destructors, in reverse order. False: they
// crashed.
bool FlightProcess::Impl::shut_down_library() {
  alive = false;
  ended = true;
  target.reset();
  if (library == nullptr) return true;
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

}  // namespace orrery
