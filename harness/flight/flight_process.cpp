#include <orrery/harness/flight/flight_process_impl.hpp>

#include <stdexcept>
#include <utility>

namespace orrery {

using Call = internal::LibraryCall;

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
  return impl_->library == nullptr ? nullptr : impl_->library->symbol(symbol_name);
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

std::uint64_t FlightProcess::work() const {
  return impl_->work == nullptr ? impl_->target_instructions : impl_->work->count;
}
Duration FlightProcess::virtual_time_spent() const {
  return impl_->services.spent();
}
bool FlightProcess::counts_work() const {
  return impl_->work != nullptr || impl_->options.target.kind != TargetAddress::Kind::kHere;
}

const std::vector<std::string>& FlightProcess::edited_symbols() const {
  static const std::vector<std::string> kNone;
  return impl_->library == nullptr ? kNone : impl_->library->edited_symbols();
}
const std::string& FlightProcess::written_global() const {
  return impl_->written_global;
}
const std::vector<std::string>& FlightProcess::shared_dependencies() const {
  static const std::vector<std::string> kNone;
  return impl_->library == nullptr ? kNone : impl_->library->shared_dependencies();
}
Duration FlightProcess::host_time_in_flight() const {
  return impl_->stopwatch.total();
}
std::uint64_t FlightProcess::last_host_ticks() const {
  return impl_->stopwatch.last_ticks();
}

}  // namespace orrery
