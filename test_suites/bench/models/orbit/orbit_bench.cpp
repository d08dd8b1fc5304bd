#include <orrery/models/frames/earth_orientation.hpp>
#include <orrery/models/orbit/earth_forces.hpp>
#include <orrery/models/orbit/mean_elements.hpp>
#include <orrery/models/orbit/spacecraft_orbit.hpp>

#include <benchmark/benchmark.h>

#include <optional>
#include <vector>

namespace orrery {
namespace {

const SimTime kStart(days(16510));
const QuasiNonsingularElements kElements{6928137, 0.0003, 0.00095, 1.70326682, 5.5, 0.2};

OrbitState initial_state() {
  const InertialState s = to_inertial(kElements);
  return {kStart, s.r_ECI, s.v_ECI, 11};
}

void BM_EarthOrientation_At(benchmark::State& state) {
  const EarthOrientation earth;
  SimTime t = kStart;
  for (auto _ : state) benchmark::DoNotOptimize(earth.at(t += 5s));
}
BENCHMARK(BM_EarthOrientation_At);

void BM_EarthEnvironment_Surroundings(benchmark::State& state) {
  const EarthEnvironment environment;
  SimTime t = kStart;
  for (auto _ : state) benchmark::DoNotOptimize(environment.surroundings(t += 5s));
}
BENCHMARK(BM_EarthEnvironment_Surroundings);

void BM_OrbitDynamics_Step(benchmark::State& state) {
  const OrbitDynamics dynamics(std::make_shared<const EarthEnvironment>(),
                               {make_earth_gravity(60)});
  OrbitDynamics::State at = dynamics.start(initial_state());
  for (auto _ : state) at = dynamics.step(at, at.orbit.t + 10s);
  benchmark::DoNotOptimize(at);
  state.counters["x_real_time"] = benchmark::Counter(10.0 * static_cast<double>(state.iterations()),
                                                     benchmark::Counter::kIsRate);
}
BENCHMARK(BM_OrbitDynamics_Step);

void BM_SpacecraftOrbit_Look(benchmark::State& state) {
  SpacecraftOrbit orbit(initial_state(),
                        {.forces = {make_earth_gravity(60)},
                         .environment = std::make_shared<const EarthEnvironment>()});
  std::int64_t k = 0;
  for (auto _ : state) benchmark::DoNotOptimize(orbit.at(kStart + (k++ % 9000) * 1ms));
}
BENCHMARK(BM_SpacecraftOrbit_Look);

void BM_SpacecraftOrbit_Day(benchmark::State& state) {
  const auto gravity = make_earth_gravity(60);
  const auto environment = std::make_shared<const EarthEnvironment>();
  for (auto _ : state) {
    SpacecraftOrbit orbit(initial_state(), {.forces = {gravity}, .environment = environment});
    benchmark::DoNotOptimize(orbit.at(kStart + 24h));
  }
  state.counters["x_real_time"] = benchmark::Counter(
      86400.0 * static_cast<double>(state.iterations()), benchmark::Counter::kIsRate);
}
BENCHMARK(BM_SpacecraftOrbit_Day)->Unit(benchmark::kMillisecond);

/// All of Table 1, with this code for gravity.
OrbitDynamics::Forces table_1(std::optional<VectorPath> path = {}) {
  OrbitDynamics::Forces forces = EarthForces({.gravity_degree = 0}).on({});
  forces.push_back(make_earth_gravity(60, path));
  return forces;
}

/// This many spacecraft, 100 m apart along one orbit, looked at every 10 s in turn.
void fly_together(benchmark::State& state, const OrbitDynamics::Forces& forces,
                  std::int64_t spacecraft, Duration span) {
  const auto environment = std::make_shared<const EarthEnvironment>();
  for (auto _ : state) {
    std::vector<SpacecraftOrbit> orbits;
    for (std::int64_t k = 0; k < spacecraft; ++k) {
      QuasiNonsingularElements x = kElements;
      x.u_rad += 100 / x.a_m * static_cast<double>(k);
      const InertialState s = to_inertial(x);
      orbits.emplace_back(OrbitState{kStart, s.r_ECI, s.v_ECI, 11},
                          SpacecraftOrbitOptions{.forces = forces, .environment = environment});
    }
    for (SimTime t = kStart; t <= kStart + span; t += 10s) {
      for (SpacecraftOrbit& orbit : orbits) benchmark::DoNotOptimize(orbit.at(t));
    }
  }
  const double simulated_s = to_seconds(span) * static_cast<double>(state.iterations());
  state.counters["x_real_time"] = benchmark::Counter(simulated_s, benchmark::Counter::kIsRate);
  state.counters["s_per_spacecraft_day"] =
      benchmark::Counter(simulated_s * static_cast<double>(spacecraft) / 86400,
                         benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}

void BM_Table1_Day(benchmark::State& state) {
  fly_together(state, table_1(), 1, 24h);
}
BENCHMARK(BM_Table1_Day)->Unit(benchmark::kMillisecond);

// The paper's run, dynamics only: two spacecraft, 20.05 h.
void BM_Table1_TwoSpacecraftForTheTransfer(benchmark::State& state) {
  fly_together(state, table_1(), 2, 72180s);
}
BENCHMARK(BM_Table1_TwoSpacecraftForTheTransfer)->Unit(benchmark::kMillisecond);

void BM_Table1_TwoSpacecraftForTheTransferPlain(benchmark::State& state) {
  fly_together(state, table_1(VectorPath::kPlain), 2, 72180s);
}
BENCHMARK(BM_Table1_TwoSpacecraftForTheTransferPlain)->Unit(benchmark::kMillisecond);

void BM_Table1_Spacecraft(benchmark::State& state) {
  fly_together(state, table_1(), state.range(0), 2h);
}
BENCHMARK(BM_Table1_Spacecraft)->Arg(1)->Arg(2)->Arg(8)->Arg(64)->Unit(benchmark::kMillisecond);

void BM_MeanElements_FromOsculating(benchmark::State& state) {
  for (auto _ : state) benchmark::DoNotOptimize(osculating_to_mean(kElements));
}
BENCHMARK(BM_MeanElements_FromOsculating);

}  // namespace
}  // namespace orrery
