#include <orrery/harness/flight/flight_computer.hpp>
#include <orrery/harness/flight/payload_pool.hpp>

#include <algorithm>
#include <orrery_flight.h>
#include <stdexcept>
#include <string>

namespace orrery {
namespace {

constexpr EventKind kBoot{100, "flight boot"};
constexpr EventKind kInput{101, "flight input"};
constexpr EventKind kTick{102, "flight tick"};
constexpr EventKind kOutput{103, "flight output"};
constexpr EventKind kProcessorFree{104, "processor free"};
constexpr EventKind kReboot{105, "flight reboot"};
constexpr EventKind kPowerCycle{106, "flight power cycle"};
constexpr EventKind kKill{107, "flight kill"};
constexpr EventKind kBootLoop{108, "boot_loop"};

constexpr std::size_t kMostWaiting = 64;
constexpr std::uint64_t kMostWaiting_bytes = 1 << 20;
// A tick that asks for a time that has passed fires again at once. So many in a row are no plan:
// the usual cause is a period given where a time is expected.
constexpr int kMostTicksAtOneInstant = 10'000;
constexpr std::size_t kMostBoots = 10;  // within kBootWindow
constexpr Duration kBootWindow = 60s;

}  // namespace

class FlightComputer::Impl {
 public:
  Impl(EventLoop& loop, OwnerId owner, FlightProcessOptions options, Hooks hooks);

  void boot();
  void reset(SimTime t, const EventKind& kind, ResetCause cause, Duration boot_delay);
  void shut_down();
  void deliver(std::string_view port, Bytes bytes, OwnerId origin);
  std::uint32_t find_port(std::string_view name, PortDirection direction) const;
  std::uint32_t require_input(const char* function, std::string_view name) const;
  std::int64_t onboard_ns() const { return clock.onboard_ns(loop_.now()); }
  bool alive() const { return process != nullptr && process->alive(); }
  HeapFigures heap() const;
  Duration host_time() const;

  FlightProcessOptions options;
  std::unique_ptr<FlightProcess> process;
  std::vector<FlightPort> ports;
  OnboardClock clock;
  HeapHistory history;
  std::uint64_t crashes = 0, boots = 0, calls = 0, rejected = 0, inputs_lost = 0,
                outputs_discarded = 0;
  std::vector<std::uint64_t> dropped;  // by port
  bool boot_loop = false;

 private:
  struct Waiting {
    std::uint32_t port, payload;
    SimTime arrival;
  };

  void on_input(std::uint32_t port, std::uint32_t payload);
  void on_tick();
  void on_output(std::uint32_t port, std::uint32_t payload, std::uint32_t life);
  // What is modelled of one kind of call.
  struct Timing {
    ExecutionTime execution;
    RandomStream* execution_draws = nullptr;  // null: it draws none
    Duration jitter{0};
    RandomStream* jitter_draws = nullptr;
    SimTime latest;  // start so far: nobody of the same kind overtakes
  };
  void set_timings();
  RandomStream& stream(const std::string& purpose);
  Timing& timing_of(const std::string& what, const char* option, bool with_create);
  void set_execution(Timing& timing, const std::string& what, const ExecutionTime& time);
  SimTime with_jitter(Timing& timing, SimTime t);
  void end_call(const Timing& timing, CallOutcome outcome);

  void on_boot(ResetCause cause);
  void on_reset(const EventKind& kind, ResetCause cause, Duration boot_delay);
  void on_boot_loop();
  void schedule_boot(SimTime t, ResetCause cause);
  bool boots_too_often();
  void load_afresh();
  void end_life();
  void on_processor_free();

  bool busy() const { return loop_.now() < busy_until_; }
  bool others_wait() const { return !waiting_.empty() || tick_waits_; }
  void enqueue(std::uint32_t port, std::uint32_t payload);
  void wake_when_free();
  void run_input(std::uint32_t port, std::uint32_t payload);
  void run_tick();
  void take_over(CallOutcome outcome);
  void release_outputs();
  void set_tick(std::int64_t onboard_ns);
  void withdraw_tick();
  bool makes_progress();
  void bury();
  void lose_what_waits();
  void tell(CallOutcome outcome);
  void warn(const std::string& line);

  EventLoop& loop_;
  OwnerId owner_;
  Hooks hooks_;
  internal::PayloadPool payloads_;

  std::unique_ptr<RandomStreams> own_random_;
  std::vector<Timing> timings_;  // by port
  Timing create_timing_, tick_timing_;

  // Of earlier lives.
  FlightProcess::Storage storage_;
  std::uint64_t high_water_before_ = 0;
  Duration host_time_before_{};

  bool booted_ = false;  // or about to be
  EventHandle boot_event_;
  std::vector<SimTime> recent_boots_;
  SimTime busy_until_;
  std::vector<Waiting> waiting_;  // in order of arrival
  std::uint64_t waiting_bytes_ = 0;
  EventHandle free_event_;  // pending while something waits

  EventHandle tick_event_;
  bool tick_waits_ = false;  // it was due while the processor was busy
  SimTime tick_due_;
  bool warned_of_tick_ = false;
  SimTime last_tick_;
  int ticks_here_ = 0;

  std::uint32_t life_ = 0;  // counts ends: an output belongs to one life
  SimTime died_;
};

FlightComputer::Impl::Impl(EventLoop& loop, OwnerId owner, FlightProcessOptions flight_options,
                           Hooks hooks)
    : options(std::move(flight_options)),
      process(std::make_unique<FlightProcess>(options)),
      ports(process->ports()),
      history(loop.now()),
      loop_(loop),
      owner_(owner),
      hooks_(std::move(hooks)),
      busy_until_(loop.now()) {
  set_timings();
  dropped.resize(ports.size(), 0);
  waiting_.reserve(kMostWaiting);
}

// ---- time

void FlightComputer::Impl::set_timings() {
  if (options.random == nullptr) own_random_ = std::make_unique<RandomStreams>(0);
  timings_.resize(ports.size());
  for (std::size_t i = 0; i < ports.size(); ++i) {
    set_execution(timings_[i], ports[i].name, options.execution_time);
  }
  set_execution(create_timing_, "create", options.execution_time);
  set_execution(tick_timing_, "tick", options.execution_time);
  for (const auto& [what, time] : options.execution_time_of) {
    set_execution(timing_of(what, "execution_time_of", true), what, time);
  }
  for (const auto& [what, jitter] : options.scheduling_jitter) {
    Timing& timing = timing_of(what, "scheduling_jitter", false);
    if (jitter < Duration{0}) {
      throw std::invalid_argument("FlightComputer: scheduling_jitter of " + what + " = " +
                                  to_string(jitter) + "; it is 0 or more");
    }
    timing.jitter = jitter;
    timing.jitter_draws = &stream("scheduling_jitter " + what);
  }
}

RandomStream& FlightComputer::Impl::stream(const std::string& purpose) {
  RandomStreams& streams = own_random_ != nullptr ? *own_random_ : *options.random;
  return streams.stream(options.spacecraft, options.process, purpose);
}

FlightComputer::Impl::Timing& FlightComputer::Impl::timing_of(const std::string& what,
                                                              const char* option,
                                                              bool with_create) {
  if (what == "tick") return tick_timing_;
  if (what == "create" && with_create) return create_timing_;
  return timings_[require_input(option, what)];
}

void FlightComputer::Impl::set_execution(Timing& timing, const std::string& what,
                                         const ExecutionTime& time) {
  if (time.counts_work() && !process->counts_work()) {
    throw std::invalid_argument("FlightComputer: the execution time of " + what +
                                " is that of counted work, and flight library \"" +
                                options.library +
                                "\" counts none; build it with orrery_add_flight_library(... "
                                "COUNT_WORK)");
  }
  timing.execution = time;
  timing.execution_draws = time.draws() ? &stream("execution_time " + what) : nullptr;
}

SimTime FlightComputer::Impl::with_jitter(Timing& timing, SimTime t) {
  if (timing.jitter_draws == nullptr) return t;
  timing.latest =
      std::max(timing.latest, t + Duration(timing.jitter_draws->integer(0, to_ns(timing.jitter))));
  return timing.latest;
}

// The call has run on the host; in simulated time it begins now.
void FlightComputer::Impl::end_call(const Timing& timing, CallOutcome outcome) {
  ++calls;
  Duration time = timing.execution.of_call(timing.execution_draws, process->work());
  if (hooks_.slow_down) {
    const double factor = hooks_.slow_down(calls);
    if (factor != 1) time = from_seconds(to_seconds(time) * factor);
  }
  busy_until_ = loop_.now() + time + process->virtual_time_spent();
  take_over(outcome);
}

// ---- ports

std::uint32_t FlightComputer::Impl::find_port(std::string_view name,
                                              PortDirection direction) const {
  for (std::uint32_t i = 0; i < ports.size(); ++i) {
    if (ports[i].direction == direction && ports[i].name == name) return i;
  }
  return UINT32_MAX;
}

std::uint32_t FlightComputer::Impl::require_input(const char* function,
                                                  std::string_view name) const {
  const std::uint32_t index = find_port(name, PortDirection::kIn);
  if (index != UINT32_MAX) return index;
  std::string known;
  for (const FlightPort& port : ports) {
    if (port.direction == PortDirection::kIn) known += (known.empty() ? "" : ", ") + port.name;
  }
  throw std::invalid_argument(std::string("FlightComputer::") + function + ": " +
                              process_name(options) + " has no input port \"" + std::string(name) +
                              "\"; it has " + (known.empty() ? "none" : known));
}

// ---- events

void FlightComputer::Impl::boot() {
  if (booted_) {
    throw std::logic_error("FlightComputer::boot: " + process_name(options) + " was booted before");
  }
  booted_ = true;
  schedule_boot(loop_.now(), ResetCause::kPowerOn);
}

void FlightComputer::Impl::schedule_boot(SimTime t, ResetCause cause) {
  boot_event_ =
      loop_.schedule(t, {Phase::kFault, owner_, owner_, &kBoot}, [this, cause] { on_boot(cause); });
}

void FlightComputer::Impl::on_boot(ResetCause cause) {
  boot_event_ = {};
  if (boots_too_often()) {
    boot_loop = true;
    loop_.schedule(loop_.now(), {Phase::kFault, owner_, owner_, &kBootLoop},
                   [this] { on_boot_loop(); });
    return;
  }
  if (boots > 0) load_afresh();
  const auto boot_count = static_cast<std::uint32_t>(boots++);
  end_call(create_timing_, process->create(loop_.now(), onboard_ns(), boot_count, cause));
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
    storage_ = process->storage();
    process.reset();
  }
  process = std::make_unique<FlightProcess>(options);
  process->set_storage(storage_);
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
  loop_.schedule(t, {Phase::kFault, owner_, owner_, &kind},
                 [this, &kind, cause, boot_delay] { on_reset(kind, cause, boot_delay); });
}

void FlightComputer::Impl::on_reset(const EventKind& kind, ResetCause cause, Duration boot_delay) {
  if (alive()) {
    process->cut_off();
    end_life();
  }
  loop_.cancel(boot_event_);
  boot_event_ = {};
  boot_loop = false;
  if (&kind != &kKill) schedule_boot(loop_.now() + boot_delay, cause);
  if (&kind == &kPowerCycle) {
    if (!options.clock_keeps_power) clock.set_offset(-Duration(to_ns(loop_.now())));
    if (hooks_.on_power_cycle) hooks_.on_power_cycle();
  }
}

void FlightComputer::Impl::deliver(std::string_view port, Bytes bytes, OwnerId origin) {
  const std::uint32_t index = require_input("deliver", port);
  const FlightPort& p = ports[index];
  const auto schedule = [&](Bytes part) {
    const std::uint32_t payload = payloads_.put(part);
    loop_.schedule(with_jitter(timings_[index], loop_.now()),
                   {Phase::kDelivery, owner_, origin, &kInput},
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
  } else if (busy() || others_wait()) {
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
    return;
  }
  waiting_bytes_ += bytes;
  waiting_.push_back({port, payload, loop_.now()});
  wake_when_free();
}

void FlightComputer::Impl::wake_when_free() {
  if (free_event_ != EventHandle{}) return;
  free_event_ = loop_.schedule(std::max(busy_until_, loop_.now()),
                               {Phase::kDelivery, owner_, owner_, &kProcessorFree},
                               [this] { on_processor_free(); });
}

// One call, the one that has been due for longest; at one instant an input before the tick.
void FlightComputer::Impl::on_processor_free() {
  free_event_ = {};
  if (!alive() || !others_wait()) return;
  if (tick_waits_ && (waiting_.empty() || tick_due_ < waiting_.front().arrival)) {
    run_tick();
  } else {
    const Waiting next = waiting_.front();
    waiting_.erase(waiting_.begin());
    waiting_bytes_ -= payloads_[next.payload].size();
    run_input(next.port, next.payload);
  }
}

void FlightComputer::Impl::run_input(std::uint32_t port, std::uint32_t payload) {
  const FlightPort& p = ports[port];
  const internal::TakenPayload taken(payloads_, payload);
  if (taken.bytes().size() > p.max_bytes) {
    ++rejected;
    if (others_wait()) wake_when_free();
    warn("a packet of " + std::to_string(taken.bytes().size()) + " bytes is too long for port " +
         p.name + ", which takes " + std::to_string(p.max_bytes));
    return;
  }
  end_call(timings_[port], process->input(loop_.now(), onboard_ns(), p, taken.bytes()));
}

void FlightComputer::Impl::on_tick() {
  tick_event_ = {};
  if (busy() || others_wait()) {
    tick_waits_ = true;
    tick_due_ = loop_.now();
    wake_when_free();
  } else {
    run_tick();
  }
}

void FlightComputer::Impl::run_tick() {
  tick_waits_ = false;
  if (!makes_progress()) return;
  end_call(tick_timing_, process->tick(loop_.now(), onboard_ns()));
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

// State first, then hooks: they may throw.
void FlightComputer::Impl::take_over(CallOutcome outcome) {
  if (outcome == CallOutcome::kCrashed) {
    bury();
  } else {
    if (outcome == CallOutcome::kRejected) ++rejected;
    release_outputs();
    if (const auto request = process->tick_request()) set_tick(*request);
    if (others_wait()) wake_when_free();
  }
  tell(outcome);
}

void FlightComputer::Impl::release_outputs() {
  for (std::size_t i = 0; i < process->output_count(); ++i) {
    const FlightProcess::Output output = process->output(i);
    const std::uint32_t port = static_cast<std::uint32_t>(output.port - process->ports().data());
    const std::uint32_t payload = payloads_.put(output.data);
    const std::uint32_t life = life_;
    loop_.schedule(busy_until_, {Phase::kOutput, owner_, owner_, &kOutput},
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
  const SimTime due = clock.truth(onboard_ns);
  tick_event_ = loop_.schedule(with_jitter(tick_timing_, due <= loop_.now() ? busy_until_ : due),
                               {Phase::kTick, owner_, owner_, &kTick}, [this] { on_tick(); });
}

void FlightComputer::Impl::withdraw_tick() {
  loop_.cancel(tick_event_);
  tick_event_ = {};
  tick_waits_ = false;
}

void FlightComputer::Impl::bury() {
  ++crashes;
  end_life();
}

void FlightComputer::Impl::end_life() {
  busy_until_ = loop_.now();
  ++life_;
  died_ = loop_.now();
  lose_what_waits();
}

void FlightComputer::Impl::lose_what_waits() {
  withdraw_tick();
  loop_.cancel(free_event_);
  free_event_ = {};
  inputs_lost += waiting_.size();
  for (const Waiting& w : waiting_) payloads_.give_back(w.payload);
  waiting_.clear();
  waiting_bytes_ = 0;
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

void FlightComputer::Impl::shut_down() {
  loop_.cancel(boot_event_);
  if (!alive()) return;
  const CallOutcome outcome = process->shut_down(loop_.now(), onboard_ns());
  if (outcome == CallOutcome::kCrashed) {
    bury();
  } else {
    lose_what_waits();
  }
  tell(outcome);
}

// ---- the public face

FlightComputer::FlightComputer(EventLoop& loop, OwnerId owner, FlightProcessOptions options,
                               Hooks hooks)
    : impl_(std::make_unique<Impl>(loop, owner, std::move(options), std::move(hooks))) {}
FlightComputer::~FlightComputer() = default;

void FlightComputer::boot() {
  impl_->boot();
}
void FlightComputer::reboot(SimTime t, Duration boot_delay, ResetCause cause) {
  impl_->reset(t, kReboot, cause, boot_delay);
}
void FlightComputer::power_cycle(SimTime t, Duration boot_delay) {
  impl_->reset(t, kPowerCycle, ResetCause::kPowerOn, boot_delay);
}
void FlightComputer::kill(SimTime t) {
  impl_->reset(t, kKill, ResetCause::kCommanded, Duration{1});
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
  return impl_->dropped[impl_->require_input("dropped", port)];
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
std::int64_t FlightComputer::onboard_ns() const {
  return impl_->onboard_ns();
}
OnboardClock& FlightComputer::clock() {
  return impl_->clock;
}
Duration FlightComputer::host_time_in_flight() const {
  return impl_->host_time();
}

}  // namespace orrery
