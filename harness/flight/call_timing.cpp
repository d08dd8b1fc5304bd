#include <orrery/harness/flight/call_timing.hpp>
#include <orrery/harness/flight/port_table.hpp>

#include <algorithm>
#include <stdexcept>

namespace orrery::internal {

SimTime CallTiming::with_jitter(SimTime t) {
  if (jitter_draws == nullptr) return t;
  latest = std::max(latest, t + Duration(jitter_draws->integer(0, to_ns(jitter))));
  return latest;
}

CallTimings::CallTimings(const FlightProcessOptions& options, const std::vector<FlightPort>& ports,
                         bool counts_work)
    : counts_work_(counts_work), inputs_(ports.size()) {
  if (options.random == nullptr) own_random_ = std::make_unique<RandomStreams>(0);
  for (std::size_t i = 0; i < ports.size(); ++i) {
    set_execution(inputs_[i], options, ports[i].name, options.execution_time);
  }
  set_execution(create_, options, "create", options.execution_time);
  set_execution(tick_, options, "tick", options.execution_time);
  for (const auto& [what, time] : options.execution_time_of) {
    set_execution(timing_of(options, ports, what, "execution_time_of", true), options, what, time);
  }
  for (const auto& [what, jitter] : options.scheduling_jitter) {
    set_jitter(timing_of(options, ports, what, "scheduling_jitter", false), options, what, jitter);
  }
}

RandomStream& CallTimings::stream(const FlightProcessOptions& options, const std::string& purpose) {
  RandomStreams& streams = own_random_ != nullptr ? *own_random_ : *options.random;
  return streams.stream(options.spacecraft, options.process, purpose);
}

CallTiming& CallTimings::timing_of(const FlightProcessOptions& options,
                                   const std::vector<FlightPort>& ports, const std::string& what,
                                   const char* option, bool with_create) {
  if (what == "tick") return tick_;
  if (what == "create" && with_create) return create_;
  return inputs_[require_input_port(std::string("FlightComputer::") + option, process_name(options),
                                    ports, what)];
}

void CallTimings::set_execution(CallTiming& timing, const FlightProcessOptions& options,
                                const std::string& what, const ExecutionTime& time) {
  if (time.counts_work() && !counts_work_) {
    throw std::invalid_argument("FlightComputer: the execution time of " + what +
                                " is that of counted work, and flight library \"" +
                                options.library +
                                "\" counts none; build it with orrery_add_flight_library(... "
                                "COUNT_WORK)");
  }
  timing.execution = time;
  timing.execution_draws = time.draws() ? &stream(options, "execution_time " + what) : nullptr;
}

void CallTimings::set_jitter(CallTiming& timing, const FlightProcessOptions& options,
                             const std::string& what, Duration jitter) {
  if (jitter < Duration{0}) {
    throw std::invalid_argument("FlightComputer: scheduling_jitter of " + what + " = " +
                                to_string(jitter) + "; it is 0 or more");
  }
  timing.jitter = jitter;
  timing.jitter_draws = &stream(options, "scheduling_jitter " + what);
}

}  // namespace orrery::internal
