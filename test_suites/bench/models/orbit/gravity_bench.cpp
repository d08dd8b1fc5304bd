#include <orrery/models/orbit/gravity.hpp>
#include <orrery/models/orbit/gravity_force.hpp>
#include <orrery/models/orbit/spacecraft_orbit.hpp>

#include <benchmark/benchmark.h>

#include <cmath>
#include <string>
#include <vector>

namespace orrery {
namespace {

std::vector<Vec3> positions() {
  std::vector<Vec3> all;
  for (int k = 0; k < 256; ++k) {
    const double angle = 0.0245 * k;
    all.push_back({6.9e6 * std::cos(angle), 1e6, 6.8e6 * std::sin(angle)});
  }
  return all;
}

void perturbation(benchmark::State& state, VectorPath path) {
  const HarmonicGravity gravity(GravityField::ggm05s(), static_cast<int>(state.range(0)), path);
  const std::vector<Vec3> r = positions();
  std::size_t k = 0;
  for (auto _ : state) benchmark::DoNotOptimize(gravity.perturbation_ECEF(r[++k % 256]));
}

// `count` spacecraft in one call; the counter is the time of one of them.
void perturbations(benchmark::State& state, VectorPath path) {
  const HarmonicGravity gravity(GravityField::ggm05s(), 60, path);
  const std::vector<Vec3> r = positions();
  const auto count = static_cast<std::size_t>(state.range(0));
  std::vector<Vec3> a(count);
  std::size_t k = 0;
  for (auto _ : state) {
    k = (k + count) % (256 - count);
    gravity.perturbations_ECEF({&r[k], count}, a);
    benchmark::DoNotOptimize(a.data());
    benchmark::ClobberMemory();
  }
  state.counters["each"] =
      benchmark::Counter(static_cast<double>(state.iterations()) * static_cast<double>(count),
                         benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}

// Two spacecraft over 20.05 h in steps of 10 s, dynamics only.
void two_orbits(benchmark::State& state, VectorPath path) {
  const SimTime start(days(16510));
  const auto gravity = make_earth_gravity(60, path);
  const auto environment = std::make_shared<const EarthEnvironment>();
  const InertialState s =
      to_inertial(QuasiNonsingularElements{6928137, 0.0003, 0.00095, 1.70326682, 5.5, 0.2});
  const InertialState d =
      to_inertial(QuasiNonsingularElements{6928137, 0.0003, 0.00095, 1.70326682, 5.5, 0.2001});
  for (auto _ : state) {
    SpacecraftOrbit chief({start, s.r_ECI, s.v_ECI, 11},
                          {.forces = {gravity}, .environment = environment});
    SpacecraftOrbit deputy({start, d.r_ECI, d.v_ECI, 11},
                           {.forces = {gravity}, .environment = environment});
    for (int hour = 1; hour <= 20; ++hour) {
      benchmark::DoNotOptimize(chief.at(start + hour * 3609s));
      benchmark::DoNotOptimize(deputy.at(start + hour * 3609s));
    }
  }
  state.counters["x_real_time"] = benchmark::Counter(
      72180.0 * static_cast<double>(state.iterations()), benchmark::Counter::kIsRate);
}

// Every path that this processor has.
[[maybe_unused]] const bool kRegistered = [] {
  for (const VectorPath path : HarmonicGravity::available_paths()) {
    const std::string name(to_string(path));
    benchmark::RegisterBenchmark(("BM_Gravity_Perturbation/" + name).c_str(), perturbation, path)
        ->Arg(2)
        ->Arg(20)
        ->Arg(60);
    benchmark::RegisterBenchmark(("BM_Gravity_Perturbations60/" + name).c_str(), perturbations,
                                 path)
        ->Arg(1)
        ->Arg(2)
        ->Arg(8)
        ->Arg(64);
    benchmark::RegisterBenchmark(("BM_Gravity_TwoOrbits20h/" + name).c_str(), two_orbits, path)
        ->Unit(benchmark::kMillisecond);
  }
  return true;
}();

void BM_Gravity_ReadCompiledInField(benchmark::State& state) {
  for (auto _ : state) benchmark::DoNotOptimize(GravityField::ggm05s());
}
BENCHMARK(BM_Gravity_ReadCompiledInField);

}  // namespace
}  // namespace orrery
