#include <orrery/harness/flight/flight_computer_impl.hpp>

namespace orrery {

FlightComputer::FlightComputer(EventLoop& loop, OwnerId owner, FlightProcessOptions options,
                               Hooks hooks)
    : own_processor_(std::make_unique<Processor>(loop, owner)),
      impl_(std::make_unique<Impl>(*own_processor_, owner, std::move(options), std::move(hooks))) {}
FlightComputer::FlightComputer(Processor& processor, OwnerId owner, FlightProcessOptions options,
                               Hooks hooks)
    : impl_(std::make_unique<Impl>(processor, owner, std::move(options), std::move(hooks))) {}
FlightComputer::~FlightComputer() = default;

void FlightComputer::boot() {
  impl_->boot();
}
void FlightComputer::reboot(SimTime t, Duration boot_delay, ResetCause cause) {
  impl_->reset(t, internal::kReboot, cause, boot_delay);
}
void FlightComputer::power_cycle(SimTime t, Duration boot_delay) {
  impl_->reset(t, internal::kPowerCycle, ResetCause::kPowerOn, boot_delay);
}
void FlightComputer::kill(SimTime t) {
  impl_->reset(t, internal::kKill, ResetCause::kCommanded, Duration{1});
}
void FlightComputer::shut_down() {
  impl_->shut_down();
}
const FlightProcessOptions& FlightComputer::options() const {
  return impl_->options;
}
const std::vector<FlightPort>& FlightComputer::ports() const {
  return impl_->ports;
}
bool FlightComputer::has_input(std::string_view port) const {
  return impl_->find_port(port, PortDirection::kIn) != UINT32_MAX;
}
bool FlightComputer::has_output(std::string_view port) const {
  return impl_->find_port(port, PortDirection::kOut) != UINT32_MAX;
}
void FlightComputer::deliver(std::string_view port, Bytes bytes, OwnerId origin) {
  impl_->deliver(port, bytes, origin);
}
bool FlightComputer::alive() const {
  return impl_->alive();
}
std::uint64_t FlightComputer::boots() const {
  return impl_->boots;
}
bool FlightComputer::stopped_by_boot_loop() const {
  return impl_->boot_loop;
}
std::uint64_t FlightComputer::crashes() const {
  return impl_->crashes;
}
std::uint64_t FlightComputer::calls() const {
  return impl_->calls;
}
std::uint64_t FlightComputer::rejected() const {
  return impl_->rejected;
}
std::uint64_t FlightComputer::inputs_lost() const {
  return impl_->inputs_lost;
}
std::uint64_t FlightComputer::outputs_discarded() const {
  return impl_->outputs_discarded;
}
std::uint64_t FlightComputer::dropped(std::string_view port) const {
  return impl_->dropped[internal::require_input_port(
      "FlightComputer::dropped", process_name(impl_->options), impl_->ports, port)];
}
HeapFigures FlightComputer::heap() const {
  return impl_->heap();
}
std::uint64_t FlightComputer::stack_high_water_bytes() const {
  return impl_->process == nullptr ? 0 : impl_->process->stack_high_water_bytes();
}
std::string FlightComputer::written_global() const {
  return impl_->process == nullptr ? "" : impl_->process->written_global();
}
void FlightComputer::set_heap_limit(std::uint64_t bytes) {
  if (impl_->process != nullptr) impl_->process->set_heap_limit(bytes);
  impl_->options.heap_bytes = bytes;
}
const HeapHistory& FlightComputer::heap_history() const {
  return impl_->history;
}
FlightProcess* FlightComputer::process() {
  return impl_->process.get();
}
NonVolatileMemory& FlightComputer::memory() {
  return *impl_->memory;
}
std::int64_t FlightComputer::onboard_ns() const {
  return impl_->onboard_ns();
}
Processor& FlightComputer::processor() {
  return impl_->processor;
}
void FlightComputer::run(const std::function<void()>& function) {
  impl_->run(function);
}
std::vector<CallFigures> FlightComputer::call_figures() const {
  return impl_->call_figures();
}
Duration FlightComputer::host_time_in_flight() const {
  return impl_->host_time();
}

}  // namespace orrery