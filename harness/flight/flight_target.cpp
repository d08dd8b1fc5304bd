// Calls of a process that runs on a target: what FlightProcess does with a library of its own, from
// what came over the wire.

#include <orrery/harness/flight/flight_process_impl.hpp>
#include <orrery/harness/flight/flight_target.hpp>
#include <orrery/harness/flight/port_table.hpp>

#include <algorithm>
#include <orrery_wire.h>
#include <stdexcept>

namespace orrery {
namespace internal {

namespace {

constexpr Duration kDebuggerPatience = std::chrono::hours(24);

bool times_by_work(const FlightProcessOptions& options) {
  return options.execution_time.counts_work() ||
         std::any_of(options.execution_time_of.begin(), options.execution_time_of.end(),
                     [](const auto& entry) { return entry.second.counts_work(); });
}

// Of Debian's cross compilers, whose libraries lie in /usr/TRIPLET.
std::string cross_triplet(const TargetAddress& emulator) {
  const std::string processor = emulated_processor(emulator);
  if (processor == "arm64") return "aarch64-linux-gnu";
  return processor == "armhf" ? "arm-linux-gnueabihf" : "arm-linux-gnueabi";
}

// Found by the names that orrery_add_flight_library(... CROSS) gives them.
std::string built_for(const FlightProcessOptions& options, const std::string& what) {
  return find_flight_library(what + "@" + emulated_processor(options.target));
}

// qemu takes what is beside the program from its environment.
TargetAddress where_it_runs(const FlightProcessOptions& options) {
  constexpr std::uint64_t kMostHeap_bytes = 1'000'000'000;  // of 4 GiB of addresses
  if (options.target.kind != TargetAddress::Kind::kEmulator) return options.target;
  TargetAddress started =
      emulator_command(options.target, built_for(options, "orrery-flight-target"),
                       built_for(options, options.library));
  std::string environment;
  if (options.target.port != 0) {
    environment += "env QEMU_GDB=" + std::to_string(options.target.port) + " ";
  }
  // Its time says nothing of the processor that it emulates, and to ask for it is emulated, too.
  started.where +=
      " --no-clock --heap " + std::to_string(std::min(options.heap_bytes, kMostHeap_bytes));
  if (times_by_work(options)) {
    const std::string page = "199";  // a descriptor that nobody else takes
    environment += "env QEMU_PLUGIN='" + built_for(options, "orrery-instruction-count") +
                   ",page=" + page + "' ";
    started.where += " --instructions " + page;
  }
  started.where = environment + started.where;
  return started;
}

}  // namespace

TargetDebugging target_debugging(const FlightProcessOptions& options) {
  if (options.target.kind != TargetAddress::Kind::kEmulator) return {};
  TargetAddress waiting = options.target;
  if (waiting.port == 0) waiting.port = 4711;
  const std::string library = built_for(options, options.library);
  const auto step = [](const std::string& command) { return " -ex '" + command + "'"; };
  return {"--orrery_target='" + process_name(options) + "=" + to_string(waiting) + "'",
          "gdb-multiarch -q '" + built_for(options, "orrery-flight-target") + "'" +
              step("set sysroot /usr/" + cross_triplet(waiting)) +
              step("set solib-search-path " + library.substr(0, library.rfind('/'))) +
              step("target remote :" + std::to_string(waiting.port)) + step("continue") +
              step("backtrace")};
}

FlightTarget::FlightTarget(const FlightProcessOptions& options)
    : wants_instructions_(times_by_work(options)) {
  try {
    const bool debugged =
        options.target.kind == TargetAddress::Kind::kEmulator && options.target.port != 0;
    remote_.emplace(where_it_runs(options), debugged ? kDebuggerPatience : options.target_patience);
  } catch (const TargetLost& lost) {
    throw std::invalid_argument("flight process " + process_name(options) + ": " + lost.what());
  }
  const TargetHello& hello = remote_->hello();
  for (const TargetHello::Port& port : hello.ports) {
    ports_.push_back({port.id, port.direction, port.kind, port.name.c_str(), port.max_bytes});
  }
  table_.size = sizeof table_;
  table_.abi_version = ORRERY_ABI_VERSION;
  table_.name = hello.name.c_str();
  table_.version = hello.version.c_str();
  table_.ports = ports_.data();
  table_.port_count = static_cast<std::uint32_t>(ports_.size());
  // Never called: there, a library has them all.
  table_.create = [](void**, const orrery_host*, const orrery_boot*) { return ORRERY_FATAL; };
  table_.input = [](void*, std::int64_t, std::uint32_t, const void*, std::uint32_t) {
    return ORRERY_FATAL;
  };
  table_.tick = [](void*, std::int64_t) { return ORRERY_FATAL; };
  table_.destroy = [](void*) {};
}

void FlightTarget::check_cost(const TargetAnswer& answer) const {
  if (wants_instructions_ && answer.cost_unit != ORRERY_WU_INSTRUCTIONS) {
    throw TargetLost(
        "counts no instructions, on which the execution time depends; an emulator does that "
        "(qemu-arm), or orrery-flight-target --instructions");
  }
}

}  // namespace internal

using Call = internal::LibraryCall;

void FlightProcess::Impl::reach_target() {
  if (options.adapter) {
    throw std::invalid_argument("flight process " + name +
                                ": a FlightAdapter calls a library in this program, so it cannot "
                                "run on the target " +
                                to_string(options.target));
  }
  target = std::make_unique<internal::FlightTarget>(options);
  flight = target->flight();
  try {
    ports = internal::checked_ports(flight);
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument("flight library \"" + target->remote().hello().name + "\" on " +
                                to_string(options.target) + ": " + error.what());
  }
}

// False: it is lost, and capture_ says how.
bool FlightProcess::Impl::call_target() {
  try {
    take_answer(ask_target());
    return true;
  } catch (const TargetLost& lost) {
    capture_ = internal::CrashCapture{};
    capture_.kind = CrashKind::kTargetLost;
    target_loss_ = std::string("the link to its processor broke: ") + lost.what();
    return false;
  }
}

const TargetAnswer& FlightProcess::Impl::ask_target() {
  RemoteFlight& remote = target->remote();
  const internal::CallArguments& a = arguments_;
  switch (a.call) {
    case Call::kCreate:
      return remote.create(a.onboard_ns,
                           {.spacecraft = options.spacecraft,
                            .process = options.process,
                            .boot_count = a.boot->boot_count,
                            .reset_cause = a.boot->reset_cause,
                            .config = options.config,
                            .storage_bytes = static_cast<std::uint32_t>(
                                std::min<std::uint64_t>(options.storage_bytes, UINT32_MAX)),
                            .slots = &memory->slots()});
    case Call::kInput:
      return remote.input(a.onboard_ns, a.port->id, input_);
    case Call::kTick:
      return remote.tick(a.onboard_ns);
    case Call::kDestroy:
      return remote.destroy(a.onboard_ns);
    case Call::kLoad:
    case Call::kRun:
      break;
  }
  throw std::logic_error("FlightProcess::run: " + name + " runs on the target " +
                         to_string(options.target) + ", where no function of this program does");
}

// The link is no part of what a call took.
void FlightProcess::Impl::report_target_time() {
  const TargetAnswer& answer = target->remote().answer();
  if (answer.cost_unit != ORRERY_WU_NS) return;
  constexpr std::uint64_t kMost_ns = 1'000'000'000'000;  // whatever it says
  stopwatch.replace_last(Duration(static_cast<std::int64_t>(std::min(answer.cost, kMost_ns))));
}

void FlightProcess::Impl::take_answer(const TargetAnswer& answer) {
  arguments_.status = answer.status;
  for (const TargetAnswer::Message& m : answer.outputs) {
    outputs.push_back({find_output(m.number), output_bytes.size(), m.bytes});
    const Bytes message = answer.of(m);
    output_bytes.insert(output_bytes.end(), message.begin(), message.end());
  }
  for (const TargetAnswer::Message& m : answer.logs) {
    const auto level = static_cast<std::int32_t>(m.number);
    logs.push_back({static_cast<LogLevel>(std::clamp(level, ORRERY_DEBUG + 0, ORRERY_ERROR + 0)),
                    log_text.size(), m.bytes});
    log_text.append(reinterpret_cast<const char*>(answer.of(m).data()), m.bytes);
  }
  // A store that fails here (a full or torn medium) is not known there before the next boot.
  for (const TargetAnswer::Message& m : answer.stores) {
    const Bytes content = answer.of(m);
    memory->store(m.number, ByteBuffer(content.begin(), content.end()));
  }
  if (answer.asked_for_tick) tick_request = answer.pending_tick_ns;
  target->check_cost(answer);
  target_instructions = answer.cost_unit == ORRERY_WU_INSTRUCTIONS ? answer.cost : 0;
  target_heap.limit_bytes = options.heap_bytes;
  target_heap.resting_bytes = answer.heap_now_bytes;
  target_heap.transient_peak_bytes = answer.heap_peak_bytes;
  target_heap.high_water_bytes = std::max(target_heap.high_water_bytes, answer.heap_peak_bytes);
  target_heap.heap_bytes = answer.heap_bytes;
  target_heap.largest_free_bytes = answer.heap_largest_free_bytes;
  record.resting_bytes = answer.heap_now_bytes;
  record.transient_peak_bytes = answer.heap_peak_bytes;
  record.heap_bytes = answer.heap_bytes;
  record.largest_free_bytes = answer.heap_largest_free_bytes;
}

}  // namespace orrery
