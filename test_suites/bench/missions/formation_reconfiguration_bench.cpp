// The first flight as a benchmark: ten orbits of two spacecraft with 60x60 gravity, GNSS every 10
// s, both flying the compiled package. Nothing is recorded.
#include <orrery/orrery.hpp>

#include <benchmark/benchmark.h>

#include <sys/resource.h>

#include "formation_keeping_messages.h"

namespace orrery {
namespace {

constexpr Duration kMission = 57390s;

double peak_memory_MB() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) * 1024 / 1e6;
}

FormationOptions flown(std::string library) {
  FormationOptions options;
  options.flight.library = std::move(library);
  options.world.record = false;
  return missions::first_flight(options);
}

void command_reconfiguration(FormationWorld& world) {
  const RelativeElements to = missions::safe_ellipse_m(100);
  const double a_roe_m[6] = {to.da, to.dl, to.dex, to.dey, to.dix, to.diy};
  std::byte command[FORMATION_COMMAND_BYTES];
  formation_put_command(reinterpret_cast<unsigned char*>(command), FORMATION_RECONFIGURE, a_roe_m,
                        to_ns(world.now() + kMission));
  world.ground().command("deputy", at(10min), command);
}

// One of each part, none of which begins before the mission's end.
void arm_later_faults(FormationWorld& world) {
  const When later = from(2 * kMission);
  world.crosslink("chief", "deputy").drop(later);
  world.crosslink("chief", "deputy").delay(later && with_probability(0.5), 5s);
  world.crosslink("chief", "deputy").corrupt(later, 3);
  for (const char* name : {"chief", "deputy"}) {
    world.gnss(name).freeze(later);
    world.gnss(name).bias(later, {10, 0, 0});
    world.thruster(name).lose(later);
    world.flight(name).slow_down(later, 10);
    world.heap(name).fail_allocation(later);
    world.storage(name).tear(later);
  }
}

/// @param library  empty: orbits and receivers alone
void BM_FirstFlight(benchmark::State& state, const std::string& library, bool faults = false) {
  double simulated_s = 0, flight_s = 0, total_s = 0;
  for (auto _ : state) {
    FormationWorld world(flown(library));
    if (!library.empty()) command_reconfiguration(world);
    if (faults) arm_later_faults(world);
    world.run_for(kMission);
    simulated_s += to_seconds(kMission);
    flight_s += world.flight_wall_s();
    total_s += world.wall_s();
  }
  const double runs = static_cast<double>(state.iterations());
  state.counters["x_real_time"] = benchmark::Counter(simulated_s, benchmark::Counter::kIsRate);
  state.counters["harness_and_models_s"] = (total_s - flight_s) / runs;
  state.counters["flight_s"] = flight_s / runs;
  state.counters["peak_memory_MB"] = peak_memory_MB();
}
BENCHMARK_CAPTURE(BM_FirstFlight, formation_keeping, std::string("formation_keeping"))
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(BM_FirstFlight, with_fifteen_inactive_faults, std::string("formation_keeping"),
                  true)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(BM_FirstFlight, without_flight_software, std::string())
    ->Unit(benchmark::kMillisecond);

enum Forces : std::int64_t { kGravityOnly = 0, kAllForces = 1 };

FormationOptions ranging(Duration period, std::int64_t forces) {
  using novatel::LogTrigger;
  FormationOptions options;
  options.world.record = false;
  if (forces == kGravityOnly) {
    options.world.drag = options.world.radiation_pressure = false;
    options.world.sun_gravity = options.world.moon_gravity = false;
  }
  options.gnss.period = period;
  options.gnss.logs = {{novatel::kRangeId, LogTrigger::kOnTime, period},
                       {novatel::kBestXyzId, LogTrigger::kOnTime, period},
                       {novatel::kRawEphemId, LogTrigger::kOnChanged}};
  return options;
}

/// Two spacecraft with all models and no flight software: orbits in 60x60, drag with NRLMSISE-00,
/// radiation pressure with shadow, Sun and Moon, attitude, crosslink, and receivers that track,
/// solve and log RANGE, BESTXYZ and ephemerides at every epoch. forces:0 has gravity alone.
void BM_TwoSpacecraft_Gnss(benchmark::State& state) {
  const Duration period = state.range(1) * 1s, span = 12h;
  double simulated_s = 0;
  for (auto _ : state) {
    state.PauseTiming();
    FormationWorld world(ranging(period, state.range(0)));
    state.ResumeTiming();
    world.run_for(span);
    simulated_s += to_seconds(span);
  }
  state.counters["x_real_time"] = benchmark::Counter(simulated_s, benchmark::Counter::kIsRate);
}
BENCHMARK(BM_TwoSpacecraft_Gnss)
    ->ArgNames({"forces", "period_s"})
    ->ArgsProduct({{kGravityOnly, kAllForces}, {1, 10, 30}})
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace orrery
