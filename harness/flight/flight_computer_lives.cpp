// How the lives of a process begin and end: boots, resets, crashes.

#include <orrery/harness/flight/flight_computer_impl.hpp>

#include <algorithm>
#include <stdexcept>

namespace orrery {
namespace {

constexpr std::size_t kMostBoots = 10;  // within kBootWindow
constexpr Duration kBootWindow = 60s;

}  // namespace

void FlightComputer::Impl::boot() {
  if (booted_) {
    throw std::logic_error("FlightComputer::boot: " + process_name(options) + " was booted before");
  }
  booted_ = true;
  schedule_boot(loop_.now(), ResetCause::kPowerOn);
}

void FlightComputer::Impl::schedule_boot(SimTime t, ResetCause cause) {
  boot_event_ =
      loop_.schedule(t, event(Phase::kFault, internal::kBoot), [this, cause] { on_boot(cause); });
}

void FlightComputer::Impl::on_boot(ResetCause cause) {
  boot_event_ = {};
  if (boots_too_often()) {
    boot_loop = true;
    loop_.schedule(loop_.now(), event(Phase::kFault, internal::kBootLoop),
                   [this] { on_boot_loop(); });
    return;
  }
  boot_cause_ = cause;
  if (!processor.shared()) return run_boot();
  boot_waits_ = {loop_.now(), processor.next_arrival()};
  processor.reconsider();
}

void FlightComputer::Impl::run_boot() {
  boot_waits_.reset();
  if (boots > 0) load_afresh();
  const auto boot_count = static_cast<std::uint32_t>(boots++);
  end_call(timings_.create(), "create",
           process->create(loop_.now(), onboard_ns(), boot_count, boot_cause_));
}

void FlightComputer::Impl::on_boot_loop() {
  warn("boot loop: more than " + std::to_string(kMostBoots) + " boots within " +
       to_string(kBootWindow) + "; the process stays off");
}

bool FlightComputer::Impl::boots_too_often() {
  const SimTime now = loop_.now();
  std::erase_if(recent_boots_, [now](SimTime t) { return now - t >= kBootWindow; });
  if (recent_boots_.size() == kMostBoots) return true;
  recent_boots_.push_back(now);
  return false;
}

// The old one goes first, so that file and arena are those of its first life, and so are pointers.
void FlightComputer::Impl::load_afresh() {
  if (process != nullptr) {
    high_water_before_ = std::max(high_water_before_, process->heap().high_water_bytes);
    host_time_before_ += process->host_time_in_flight();
    process.reset();
  }
  process = std::make_unique<FlightProcess>(options, memory);
}

HeapFigures FlightComputer::Impl::heap() const {
  HeapFigures figures = process == nullptr ? HeapFigures{} : process->heap();
  figures.high_water_bytes = std::max(figures.high_water_bytes, high_water_before_);
  return figures;
}

Duration FlightComputer::Impl::host_time() const {
  return host_time_before_ + (process == nullptr ? Duration{} : process->host_time_in_flight());
}

void FlightComputer::Impl::reset(SimTime t, const EventKind& kind, ResetCause cause,
                                 Duration boot_delay) {
  if (boot_delay <= Duration{0}) {
    throw std::invalid_argument("FlightComputer: boot delay = " + to_string(boot_delay) + " of " +
                                process_name(options) + "; it is above 0");
  }
  if (!booted_ && t <= loop_.now()) {
    throw std::logic_error("FlightComputer: " + process_name(options) +
                           " is to be reset, or killed, before it has booted");
  }
  loop_.schedule(t, event(Phase::kFault, kind),
                 [this, &kind, cause, boot_delay] { on_reset(kind, cause, boot_delay); });
}

void FlightComputer::Impl::on_reset(const EventKind& kind, ResetCause cause, Duration boot_delay) {
  if (alive()) {
    process->cut_off();
    end_life();
  }
  withdraw_boot();
  boot_loop = false;
  if (&kind != &internal::kKill) schedule_boot(loop_.now() + boot_delay, cause);
  if (&kind == &internal::kPowerCycle) {
    memory->files.lose_power();
    if (!options.clock_keeps_power) {
      processor.clock().set_offset(-Duration(to_ns(loop_.now())), loop_.now());
    }
    if (hooks_.on_power_cycle) hooks_.on_power_cycle();
  }
}

void FlightComputer::Impl::bury() {
  ++crashes;
  end_life();
}

void FlightComputer::Impl::end_life() {
  call_ends_ = loop_.now();
  processor.release(*this);
  ++life_;
  died_ = loop_.now();
  lose_what_waits();
  if (hooks_.on_end) hooks_.on_end();
}

void FlightComputer::Impl::lose_what_waits() {
  withdraw_tick();
  inputs_lost += waiting_.size();
  for (const WaitingInput& w : waiting_) payloads_.give_back(w.payload);
  waiting_.clear();
  waiting_bytes_ = 0;
  processor.reconsider();
}

void FlightComputer::Impl::withdraw_boot() {
  loop_.cancel(boot_event_);
  boot_event_ = {};
  if (!boot_waits_) return;
  boot_waits_.reset();
  processor.reconsider();
}

void FlightComputer::Impl::shut_down() {
  withdraw_boot();
  if (!alive()) return;
  const CallOutcome outcome = process->shut_down(loop_.now(), onboard_ns());
  if (outcome == CallOutcome::kCrashed) {
    bury();
  } else {
    lose_what_waits();
  }
  tell(outcome);
}

}  // namespace orrery
