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

void CallTiming::count(std::uint64_t ticks_of_host, Duration execution_time, std::uint64_t edges) {
  ++calls;
  host_ticks += ticks_of_host;
  most_host_ticks = std::max(most_host_ticks, ticks_of_host);
  modelled += execution_time;
  most_modelled = std::max(most_modelled, execution_time);
  work += edges;
  most_work = std::max(most_work, edges);
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

std::vector<CallFigures> CallTimings::figures(const std::vector<FlightPort>& ports,
                                              const HostStopwatch& stopwatch) const {
  std::vector<CallFigures> rows;
  const auto add = [&](const std::string& call, const CallTiming& t) {
    if (t.calls == 0) return;
    rows.push_back({.call = call,
                    .calls = t.calls,
                    .host_mean = stopwatch.duration(t.host_ticks / t.calls),
                    .host_max = stopwatch.duration(t.most_host_ticks),
                    .modelled_mean = t.modelled / static_cast<std::int64_t>(t.calls),
                    .modelled_max = t.most_modelled,
                    .work_mean = t.work / t.calls,
                    .work_max = t.most_work});
  };
  add("create", create_);
  for (std::size_t i = 0; i < ports.size(); ++i) add(ports[i].name, inputs_[i]);
  add("tick", tick_);
  return rows;
}

}  // namespace orrery::internal
