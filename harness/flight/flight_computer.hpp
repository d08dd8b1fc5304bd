/// Binds a flight process to the event loop: inputs, ticks, outputs, the processor's time.
#pragma once

#include <orrery/harness/flight/call_figures.hpp>
#include <orrery/harness/flight/flight_process.hpp>
#include <orrery/harness/flight/processor.hpp>
#include <orrery/harness/kernel/event_loop.hpp>

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace orrery {

/// A call of flight software in simulated time.
struct CallSpan {
  std::string_view what;  // the input port, "create" or "tick"
  SimTime begin, end;     // its outputs leave at `end`, unless the process ends before
  CallOutcome outcome = CallOutcome::kDone;
};

/// A flight process on a processor: of its own, or one that several share (processor.hpp).
///
/// Calls    An input is an event of Phase::kDelivery, the tick one of Phase::kTick. A call starts
///          when the processor is free and runs at once on the host; its outputs leave at start +
///          execution time, in order, as events of Phase::kOutput. Clock reads and sleeps of flight
///          code lengthen it (HostServices).
/// Queue    While the processor is not to be had 64 inputs of 1 MiB together wait; of more the
/// newest is
///          dropped and counted. The tick waits beside them, and goes first if it was due earlier.
/// Tick     One pending. A new request replaces it, a negative one withdraws it; one in the past
///          fires when the call that asked for it has ended.
/// Crash    Outputs and tick request of the crashed call are discarded, as are outputs that had not
///          left yet and waiting inputs; then Hooks::on_crash decides. A dead process gets nothing.
/// Reset    A reboot loads the library afresh from the same file: memory, queue, tick and outputs
///          that had not left are lost, non-volatile storage is kept. While it is off inputs are
///          lost and counted. More than 10 boots within 60 s are a boot loop: the process stays
///          off. The onboard clock goes on, unless a power cycle takes its power (FlightOptions).
/// Events   Kinds 100-108; none allocates once the buffers have grown to their sizes.
class FlightComputer {
 public:
  /// Called in simulator context; each may be empty. on_crash and on_output may throw.
  struct Hooks {
    std::function<void(std::string_view port, Bytes)> on_output;
    std::function<void(LogLevel, std::string_view line)> on_log;
    std::function<void(const CrashReport&)> on_crash;
    std::function<void(const CallRecord&)> on_call;
    std::function<void(const CallSpan&)> on_span;        // before on_call; not of `destroy`
    std::function<void()> on_end;                        // a life of the process is over
    std::function<void(std::string_view port)> on_drop;  // an input, as the queue was full
    std::function<void()> on_power_cycle;                // devices start cold
  };

  /// Loads the library. The loop, or the processor, must outlive the computer.
  /// @throws std::invalid_argument  as FlightProcess, and for execution times and jitters of
  ///                                ports that do not exist, or of counted work in a library that
  ///                                counts none.
  FlightComputer(EventLoop& loop, OwnerId owner, FlightProcessOptions options, Hooks hooks);
  FlightComputer(Processor& processor, OwnerId owner, FlightProcessOptions options, Hooks hooks);
  ~FlightComputer();
  FlightComputer(const FlightComputer&) = delete;
  FlightComputer& operator=(const FlightComputer&) = delete;

  /// Schedules `create` now, before the devices and inputs of this instant.
  /// @throws std::logic_error  booted before.
  void boot();
  /// From `t` on, before anything else at that instant: ends the process without its destroy, and
  /// boots it again `boot_delay` later, also where it had crashed, or was killed.
  /// @throws std::invalid_argument  a delay of 0 or less, t before now; std::logic_error  not
  ///                                booted yet, and t is no later than that.
  void reboot(SimTime t, Duration boot_delay, ResetCause cause = ResetCause::kCommanded);
  /// A reboot with ResetCause::kPowerOn, and Hooks::on_power_cycle at `t`.
  void power_cycle(SimTime t, Duration boot_delay);
  /// As reboot(), but it stays off.
  void kill(SimTime t);
  /// Orderly end, now; waiting inputs and the tick are dropped. Nothing if not alive.
  void shut_down();

  const FlightProcessOptions& options() const;
  const std::vector<FlightPort>& ports() const;
  bool has_input(std::string_view port) const;
  bool has_output(std::string_view port) const;

  /// Schedules `bytes` for delivery now, as an event from `origin`. A packet above the port's
  /// max_bytes is rejected when it is delivered; a stream is cut into calls.
  /// @throws std::invalid_argument  no such input port; the message lists those that exist.
  void deliver(std::string_view port, Bytes bytes, OwnerId origin);

  bool alive() const;
  std::uint64_t crashes() const;
  std::uint64_t boots() const;
  bool stopped_by_boot_loop() const;
  std::uint64_t calls() const;              // create, inputs, ticks
  std::uint64_t rejected() const;           // inputs and ticks that the library rejected, and
                                            // packets too long for their port
  std::uint64_t inputs_lost() const;        // came while the process was not alive, or died waiting
  std::uint64_t outputs_discarded() const;  // by a crash or a reset
  /// Dropped because the queue was full. @throws std::invalid_argument  no such input port.
  std::uint64_t dropped(std::string_view port) const;

  HeapFigures heap() const;
  std::uint64_t stack_high_water_bytes() const;  // of this life
  std::string written_global() const;            // FlightProcess::written_global()
  /// @throws std::invalid_argument  above 4 GiB less 1 MiB.
  void set_heap_limit(std::uint64_t bytes);
  /// A sample per call; empty where heaps are not simulated.
  const HeapHistory& heap_history() const;
  /// For its heap; calling it is the computer's. Another one after a reboot, null while off.
  FlightProcess* process();
  /// Of all its lives.
  NonVolatileMemory& memory();
  std::int64_t onboard_ns() const;  // what the spacecraft's clock shows now
  Processor& processor();
  /// Runs a function as flight code of this process, now: FlightProcess::run. Its outputs leave
  /// when the processor is free. @throws std::logic_error  it is not running.
  void run(const std::function<void()>& function);
  /// By kind of call, of all lives: calls, host time, modelled time, work.
  std::vector<CallFigures> call_figures() const;
  Duration host_time_in_flight() const;  // for reports only

 private:
  class Impl;
  std::unique_ptr<Processor> own_processor_;
  std::unique_ptr<Impl> impl_;
};

}  // namespace orrery
