#include <orrery/models/orbit/gravity.hpp>

#include <benchmark/benchmark.h>

#include <cmath>
#include <vector>

namespace orrery {
namespace {

void BM_Gravity_Perturbation(benchmark::State& state) {
  const HarmonicGravity gravity(GravityField::ggm05s(), static_cast<int>(state.range(0)));
  std::vector<Vec3> positions;
  for (int k = 0; k < 256; ++k) {
    const double angle = 0.0245 * k;
    positions.push_back({6.9e6 * std::cos(angle), 1e6, 6.8e6 * std::sin(angle)});
  }
  std::size_t k = 0;
  for (auto _ : state) benchmark::DoNotOptimize(gravity.perturbation_ECEF(positions[++k % 256]));
}
BENCHMARK(BM_Gravity_Perturbation)->Arg(2)->Arg(20)->Arg(60);

void BM_Gravity_ReadCompiledInField(benchmark::State& state) {
  for (auto _ : state) benchmark::DoNotOptimize(GravityField::ggm05s());
}
BENCHMARK(BM_Gravity_ReadCompiledInField);

}  // namespace
}  // namespace orrery
