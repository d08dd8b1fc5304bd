// What becomes of an input and of the tick: the queue, the call, and what the call leaves behind.

#include <orrery/harness/flight/flight_computer_impl.hpp>

#include <algorithm>
#include <orrery_flight.h>
#include <stdexcept>

namespace orrery {
namespace {

constexpr std::size_t kMostWaiting = 64;
constexpr std::uint64_t kMostWaiting_bytes = 1 << 20;
// A tick that asks for a time that has passed fires again at once. So many in a row are no plan:
// the usual cause is a period given where a time is expected.
constexpr int kMostTicksAtOneInstant = 10'000;

}  // namespace

FlightComputer::Impl::Impl(Processor& shared_processor, OwnerId owner,
                           FlightProcessOptions flight_options, Hooks hooks)
    : processor(shared_processor),
      options(std::move(flight_options)),
      process(std::make_unique<FlightProcess>(options)),
      memory(process->memory()),
      ports(process->ports()),
      history(processor.loop().now()),
      loop_(processor.loop()),
      owner_(owner),
      hooks_(std::move(hooks)),
      timings_(options, ports, process->counts_work()) {
  processor.join(*this);
  dropped.resize(ports.size(), 0);
  waiting_.reserve(kMostWaiting);
}

FlightComputer::Impl::~Impl() {
  processor.leave(*this);
}

// ---- events

void FlightComputer::Impl::deliver(std::string_view port, Bytes bytes, OwnerId origin) {
  const std::uint32_t index =
      internal::require_input_port("FlightComputer::deliver", process_name(options), ports, port);
  const FlightPort& p = ports[index];
  const auto schedule = [&](Bytes part) {
    const std::uint32_t payload = payloads_.put(part);
    loop_.schedule(timings_.input(index).with_jitter(loop_.now()),
                   {Phase::kDelivery, owner_, origin, &internal::kInput},
                   [this, index, payload] { on_input(index, payload); });
  };
  if (p.kind == PortKind::kStream) {
    for (; bytes.size() > p.max_bytes; bytes = bytes.subspan(p.max_bytes)) {
      schedule(bytes.first(p.max_bytes));
    }
  }
  schedule(bytes);
}

void FlightComputer::Impl::on_input(std::uint32_t port, std::uint32_t payload) {
  loop_.fingerprint_payload(payloads_[payload]);
  if (!alive()) {
    ++inputs_lost;
    payloads_.give_back(payload);
  } else if (has_to_wait()) {
    enqueue(port, payload);
  } else {
    run_input(port, payload);
  }
}

void FlightComputer::Impl::enqueue(std::uint32_t port, std::uint32_t payload) {
  const std::uint64_t bytes = payloads_[payload].size();
  if (waiting_.size() == kMostWaiting || waiting_bytes_ + bytes > kMostWaiting_bytes) {
    ++dropped[port];
    payloads_.give_back(payload);
    if (hooks_.on_drop) hooks_.on_drop(ports[port].name);
    return;
  }
  waiting_bytes_ += bytes;
  waiting_.push_back({port, payload, loop_.now(), processor.next_arrival()});
  processor.reconsider();
}

// The one that has been due for longest; at one instant an input before the tick.
std::optional<Processor::Claim> FlightComputer::Impl::claim() const {
  using What = Processor::Waiting;
  if (boot_waits_) return claim_of(What::kBoot, *boot_waits_);
  if (tick_waits_ && (waiting_.empty() || tick_waits_->due < waiting_.front().due)) {
    return claim_of(What::kTick, *tick_waits_);
  }
  if (waiting_.empty()) return std::nullopt;
  return claim_of(What::kInput, {waiting_.front().due, waiting_.front().arrival});
}

void FlightComputer::Impl::run_claimed() {
  switch (claim()->what) {
    case Processor::Waiting::kBoot:
      return run_boot();
    case Processor::Waiting::kTick:
      return run_tick();
    case Processor::Waiting::kInput:
      const WaitingInput next = waiting_.front();
      waiting_.erase(waiting_.begin());
      waiting_bytes_ -= payloads_[next.payload].size();
      return run_input(next.port, next.payload);
  }
}

void FlightComputer::Impl::run_input(std::uint32_t port, std::uint32_t payload) {
  const FlightPort& p = ports[port];
  const internal::TakenPayload taken(payloads_, payload);
  if (taken.bytes().size() > p.max_bytes) {
    ++rejected;
    processor.reconsider();
    warn("a packet of " + std::to_string(taken.bytes().size()) + " bytes is too long for port " +
         p.name + ", which takes " + std::to_string(p.max_bytes));
    return;
  }
  end_call(timings_.input(port), p.name,
           process->input(loop_.now(), onboard_ns(), p, taken.bytes()));
}

void FlightComputer::Impl::on_tick() {
  tick_event_ = {};
  if (has_to_wait()) {
    tick_waits_ = {loop_.now(), processor.next_arrival()};
    processor.reconsider();
  } else {
    run_tick();
  }
}

void FlightComputer::Impl::run_tick() {
  tick_waits_.reset();
  if (!makes_progress()) return;
  end_call(timings_.tick(), "tick", process->tick(loop_.now(), onboard_ns()));
}

bool FlightComputer::Impl::makes_progress() {
  if (last_tick_ != loop_.now()) ticks_here_ = 0;
  last_tick_ = loop_.now();
  if (++ticks_here_ <= kMostTicksAtOneInstant) return true;
  process->end(CrashKind::kNoProgress,
               std::to_string(kMostTicksAtOneInstant) +
                   " ticks at one instant: each asked for a time that had passed already",
               loop_.now(), onboard_ns());
  bury();
  if (hooks_.on_crash) hooks_.on_crash(process->crash());
  return false;
}

void FlightComputer::Impl::on_output(std::uint32_t port, std::uint32_t payload,
                                     std::uint32_t life) {
  const internal::TakenPayload taken(payloads_, payload);
  // Due at the very instant of the crash: it had left.
  if (life != life_ && died_ < loop_.now()) {
    ++outputs_discarded;
    return;
  }
  loop_.fingerprint_payload(taken.bytes());
  if (hooks_.on_output) hooks_.on_output(ports[port].name, taken.bytes());
}

// ---- after a call

// The call has run on the host; in simulated time it begins now.
void FlightComputer::Impl::end_call(internal::CallTiming& timing, std::string_view what,
                                    CallOutcome outcome) {
  ++calls;
  const Duration time =
      processor.slowed(timing.execution.of_call(timing.execution_draws, process->work())) +
      process->virtual_time_spent();
  timing.count(process->last_host_ticks(), time, process->work());
  call_ends_ = loop_.now() + time;
  processor.occupy(*this, time);
  if (hooks_.on_span) hooks_.on_span({what, loop_.now(), call_ends_, outcome});
  take_over(outcome);
}

// Beside what the processor is modelled to do: it takes no simulated time.
void FlightComputer::Impl::run(const std::function<void()>& function) {
  if (!alive()) {
    throw std::logic_error("FlightComputer::run: " + process_name(options) + " is not running");
  }
  take_over(process->run(loop_.now(), onboard_ns(), function));
}

// State first, then hooks: they may throw.
void FlightComputer::Impl::take_over(CallOutcome outcome) {
  if (outcome == CallOutcome::kCrashed) {
    bury();
  } else {
    if (outcome == CallOutcome::kRejected) ++rejected;
    release_outputs();
    if (const auto request = process->tick_request()) set_tick(*request);
    processor.reconsider();
  }
  tell(outcome);
}

void FlightComputer::Impl::release_outputs() {
  for (std::size_t i = 0; i < process->output_count(); ++i) {
    const FlightProcess::Output output = process->output(i);
    const std::uint32_t port = static_cast<std::uint32_t>(output.port - process->ports().data());
    const std::uint32_t payload = payloads_.put(output.data);
    const std::uint32_t life = life_;
    loop_.schedule(processor.free_at(), event(Phase::kOutput, internal::kOutput),
                   [this, port, payload, life] { on_output(port, payload, life); });
  }
}

void FlightComputer::Impl::set_tick(std::int64_t onboard_ns) {
  withdraw_tick();
  if (onboard_ns < 0) return;
  if (!process->has_tick()) {
    if (!warned_of_tick_) warn("a tick was requested, but the library has no tick function");
    warned_of_tick_ = true;
    return;
  }
  tick_onboard_ns_ = onboard_ns;
  const SimTime due = processor.clock().truth(onboard_ns);
  const SimTime soonest = std::max(call_ends_, loop_.now());
  tick_event_ = loop_.schedule(timings_.tick().with_jitter(due <= loop_.now() ? soonest : due),
                               event(Phase::kTick, internal::kTick), [this] { on_tick(); });
}

void FlightComputer::Impl::clock_jumped() {
  if (loop_.pending(tick_event_)) set_tick(tick_onboard_ns_);
}

void FlightComputer::Impl::withdraw_tick() {
  loop_.cancel(tick_event_);
  tick_event_ = {};
  tick_waits_.reset();
}

void FlightComputer::Impl::tell(CallOutcome outcome) {
  if (hooks_.on_log) {
    for (std::size_t i = 0; i < process->log_count(); ++i) {
      const FlightProcess::LogLine line = process->log_line(i);
      hooks_.on_log(line.level, line.text);
    }
  }
  if (process->simulated_heap() != nullptr) history.add(process->call_record());
  if (hooks_.on_call) hooks_.on_call(process->call_record());
  if (outcome == CallOutcome::kCrashed && hooks_.on_crash) hooks_.on_crash(process->crash());
}

void FlightComputer::Impl::warn(const std::string& line) {
  if (hooks_.on_log) hooks_.on_log(LogLevel::kWarning, line);
}

}  // namespace orrery
