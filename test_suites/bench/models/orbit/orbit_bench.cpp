#include <orrery/models/frames/earth_orientation.hpp>
#include <orrery/models/orbit/gravity_force.hpp>
#include <orrery/models/orbit/mean_elements.hpp>
#include <orrery/models/orbit/spacecraft_orbit.hpp>

#include <benchmark/benchmark.h>

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

void BM_MeanElements_FromOsculating(benchmark::State& state) {
  for (auto _ : state) benchmark::DoNotOptimize(osculating_to_mean(kElements));
}
BENCHMARK(BM_MeanElements_FromOsculating);

}  // namespace
}  // namespace orrery
