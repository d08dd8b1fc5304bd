/// The inside of a flight computer: its queue, its tick, its lives.
#pragma once

#include <orrery/harness/flight/call_timing.hpp>
#include <orrery/harness/flight/flight_computer.hpp>
#include <orrery/harness/flight/payload_pool.hpp>
#include <orrery/harness/flight/port_table.hpp>
#include <orrery/harness/flight/processor.hpp>

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace orrery {
namespace internal {

inline constexpr EventKind kBoot{100, "flight boot"};
inline constexpr EventKind kInput{101, "flight input"};
inline constexpr EventKind kTick{102, "flight tick"};
inline constexpr EventKind kOutput{103, "flight output"};
inline constexpr EventKind kReboot{105, "flight reboot"};
inline constexpr EventKind kPowerCycle{106, "flight power cycle"};
inline constexpr EventKind kKill{107, "flight kill"};
inline constexpr EventKind kBootLoop{108, "boot_loop"};

}  // namespace internal

class FlightComputer::Impl final : Processor::User {
 public:
  Impl(Processor& processor, OwnerId owner, FlightProcessOptions options, Hooks hooks);
  ~Impl();
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  void boot();
  void reset(SimTime t, const EventKind& kind, ResetCause cause, Duration boot_delay);
  void shut_down();
  void deliver(std::string_view port, Bytes bytes, OwnerId origin);
  std::uint32_t find_port(std::string_view name, PortDirection direction) const {
    return internal::find_port(ports, name, direction);
  }
  std::int64_t onboard_ns() const { return processor.clock().onboard_ns(loop_.now()); }
  bool alive() const { return process != nullptr && process->alive(); }
  HeapFigures heap() const;
  void run(const std::function<void()>& function);
  std::vector<CallFigures> call_figures() const { return timings_.figures(ports, stopwatch_); }
  Duration host_time() const;

  Processor& processor;
  FlightProcessOptions options;
  std::unique_ptr<FlightProcess> process;
  std::shared_ptr<NonVolatileMemory> memory;  // of all its lives
  std::vector<FlightPort> ports;
  HeapHistory history;
  std::uint64_t crashes = 0, boots = 0, calls = 0, rejected = 0, inputs_lost = 0,
                outputs_discarded = 0;
  std::vector<std::uint64_t> dropped;  // by port
  bool boot_loop = false;

 private:
  struct WaitingInput {
    std::uint32_t port, payload;
    SimTime due;
    std::uint64_t arrival;
  };
  struct WaitingCall {
    SimTime due;
    std::uint64_t arrival;
  };

  std::optional<Processor::Claim> claim() const override;
  void run_claimed() override;
  void clock_jumped() override;

  void on_input(std::uint32_t port, std::uint32_t payload);
  void on_tick();
  void on_output(std::uint32_t port, std::uint32_t payload, std::uint32_t life);
  void end_call(internal::CallTiming& timing, std::string_view what, CallOutcome outcome);

  void on_boot(ResetCause cause);
  void run_boot();
  void on_reset(const EventKind& kind, ResetCause cause, Duration boot_delay);
  void on_boot_loop();
  void schedule_boot(SimTime t, ResetCause cause);
  void withdraw_boot();
  bool boots_too_often();
  void load_afresh();
  void end_life();

  EventSpec event(Phase phase, const EventKind& kind) const {
    return {phase, owner_, processor.owner(), &kind};
  }
  bool has_to_wait() const {
    return processor.shared() || processor.busy() || !waiting_.empty() || tick_waits_;
  }
  Processor::Claim claim_of(Processor::Waiting what, const WaitingCall& call) const {
    return {-std::int64_t{options.priority}, call.due, what, call.arrival};
  }
  void enqueue(std::uint32_t port, std::uint32_t payload);
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

  internal::CallTimings timings_;
  internal::HostStopwatch stopwatch_;  // for the length of a tick only

  // Of earlier lives.
  std::uint64_t high_water_before_ = 0;
  Duration host_time_before_{};

  bool booted_ = false;  // or about to be
  EventHandle boot_event_;
  ResetCause boot_cause_ = ResetCause::kPowerOn;
  std::optional<WaitingCall> boot_waits_;  // it was due while others had the processor
  std::vector<SimTime> recent_boots_;
  std::vector<WaitingInput> waiting_;  // in order of arrival
  std::uint64_t waiting_bytes_ = 0;

  EventHandle tick_event_;
  std::int64_t tick_onboard_ns_ = 0;       // asked for, of the pending one
  std::optional<WaitingCall> tick_waits_;  // it was due while the processor was busy
  SimTime call_ends_;
  bool warned_of_tick_ = false;
  SimTime last_tick_;
  int ticks_here_ = 0;

  std::uint32_t life_ = 0;  // counts ends: an output belongs to one life
  SimTime died_;
};

}  // namespace orrery
