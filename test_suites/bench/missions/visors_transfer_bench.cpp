// The case study's transfer as a benchmark: 20 h from standby to science, both spacecraft flying
// formation_gnc, GNSS every 10 s, all forces of Table 1, all models. Nothing is recorded.
#include <orrery/orrery.hpp>

#include <benchmark/benchmark.h>

#include <ctime>

#include "formation_gnc/formation_gnc_messages.h"

namespace orrery {
namespace {

constexpr Duration kTransfer = 20h, kBegin = 30min;

FormationOptions telescope(std::uint64_t seed) {
  FormationOptions options{.flight = {.library = "formation_gnc", .heap_bytes = 50_MB},
                           .run = RunId{.seed = seed}};
  options.world.record = false;
  return missions::visors_like(std::move(options));
}

void command_transfer(FormationWorld& world) {
  const std::int64_t start_ns = to_ns(world.now());
  const formation_gnc_command c = {.opcode = FORMATION_GNC_UPLOAD,
                                   .mode = FORMATION_GNC_TRANSFER,
                                   .observations = 0,
                                   .every = 0,
                                   .number = 1,
                                   .t_ns = start_ns + kBegin.count(),
                                   .end_ns = start_ns + kTransfer.count(),
                                   .a_m = 0,
                                   .b_m = 0};
  std::byte message[FORMATION_GNC_COMMAND_BYTES];
  formation_gnc_put_command(reinterpret_cast<unsigned char*>(message), &c);
  world.ground().command("dsc", at(10min), message);
}

// Harness and flight software are told apart by wall time, which a busy machine stretches alike;
// both are given as their share of the CPU time.
void BM_VisorsTransfer(benchmark::State& state) {
  double simulated_s = 0, flight_s = 0, total_s = 0, cpu_s = 0, delta_v_mps = 0;
  for (auto _ : state) {
    state.PauseTiming();
    auto world = std::make_unique<FormationWorld>(telescope(1));
    command_transfer(*world);
    state.ResumeTiming();
    const std::clock_t begin = std::clock();
    world->run_for(kTransfer);
    cpu_s += static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
    state.PauseTiming();
    simulated_s += to_seconds(kTransfer);
    flight_s += world->flight_wall_s();
    total_s += world->wall_s();
    delta_v_mps = world->delta_v_mps("osc");
    world.reset();
    state.ResumeTiming();
  }
  const double runs = static_cast<double>(state.iterations());
  state.counters["x_real_time"] = benchmark::Counter(simulated_s, benchmark::Counter::kIsRate);
  state.counters["harness_and_models_s"] = (1 - flight_s / total_s) * cpu_s / runs;
  state.counters["flight_s"] = flight_s / total_s * cpu_s / runs;
  state.counters["delta_v_mps"] = delta_v_mps;
}
BENCHMARK(BM_VisorsTransfer)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace orrery
