/// When a call begins and how long it keeps its processor, by kind of call.
#pragma once

#include <orrery/harness/flight/call_figures.hpp>
#include <orrery/harness/flight/flight_options.hpp>
#include <orrery/harness/flight/flight_process.hpp>
#include <orrery/harness/flight/host_stopwatch.hpp>
#include <orrery/harness/kernel/random.hpp>

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace orrery::internal {

/// What is modelled of one kind of call.
struct CallTiming {
  ExecutionTime execution;
  RandomStream* execution_draws = nullptr;  // null: it draws none
  Duration jitter{0};
  RandomStream* jitter_draws = nullptr;
  SimTime latest;  // start so far: nobody of the same kind overtakes

  // Of the calls so far.
  std::uint64_t calls = 0, host_ticks = 0, most_host_ticks = 0, work = 0, most_work = 0;
  Duration modelled{0}, most_modelled{0};

  /// When one begins that was due at `t`.
  SimTime with_jitter(SimTime t);
  void count(std::uint64_t ticks_of_host, Duration execution_time, std::uint64_t edges);
};

class CallTimings {
 public:
  /// @throws std::invalid_argument  an option names a port that does not exist, a negative jitter,
  ///                                or counted work of a library that counts none.
  CallTimings(const FlightProcessOptions& options, const std::vector<FlightPort>& ports,
              bool counts_work);

  CallTiming& create() { return create_; }
  CallTiming& tick() { return tick_; }
  CallTiming& input(std::uint32_t port) { return inputs_[port]; }

  /// Of every kind of call that has been made: create, inputs by port, tick.
  std::vector<CallFigures> figures(const std::vector<FlightPort>& ports,
                                   const HostStopwatch& stopwatch) const;

 private:
  RandomStream& stream(const FlightProcessOptions& options, const std::string& purpose);
  CallTiming& timing_of(const FlightProcessOptions& options, const std::vector<FlightPort>& ports,
                        const std::string& what, const char* option, bool with_create);
  void set_execution(CallTiming& timing, const FlightProcessOptions& options,
                     const std::string& what, const ExecutionTime& time);
  void set_jitter(CallTiming& timing, const FlightProcessOptions& options, const std::string& what,
                  Duration jitter);

  bool counts_work_;
  std::unique_ptr<RandomStreams> own_random_;
  std::vector<CallTiming> inputs_;  // by port; those of outputs are not used
  CallTiming create_, tick_;
};

}  // namespace orrery::internal
