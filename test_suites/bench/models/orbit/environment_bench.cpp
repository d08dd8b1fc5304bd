#include <orrery/models/orbit/space_environment.hpp>

#include <benchmark/benchmark.h>

#include <cstdio>
#include <string>

namespace orrery {
namespace {

// Forty days from 2025-04-01 in the layout of CelesTrak's files, with the same values every day.
EarthOrientationTable made_up_table() {
  std::string text = "VERSION 1.1\nNUM_OBSERVED_POINTS 40\nBEGIN OBSERVED\n";
  char line[96];
  for (int d = 0; d < 40; ++d) {
    std::snprintf(line, sizeof line,
                  "2025 %02d %02d %d 0.10 0.35 0.0400 0.001 -0.11 -0.007 0.0 0.0 37\n",
                  d < 30 ? 4 : 5, d < 30 ? d + 1 : d - 29, 60766 + d);
    text += line;
  }
  return EarthOrientationTable::parse(text + "END OBSERVED\n", "made up");
}

// Steps of 5 s, as RK4 asks for them: an interval of 3 h serves 2160 calls.
void BM_EarthEnvironment_SurroundingsWithEop(benchmark::State& state) {
  const EarthEnvironment environment(made_up_table());
  const SimTime first = gps_midnight(2025, 4, 2);
  std::int64_t k = 0;
  for (auto _ : state)
    benchmark::DoNotOptimize(environment.surroundings(first + (k++ % 600000) * 5s));
}
BENCHMARK(BM_EarthEnvironment_SurroundingsWithEop);

// A new interval at every call: what making one costs.
void BM_EarthEnvironment_NewInterval(benchmark::State& state) {
  const EarthEnvironment environment;
  const SimTime first = gps_midnight(2025, 4, 2);
  std::int64_t k = 0;
  for (auto _ : state)
    benchmark::DoNotOptimize(environment.surroundings(first + (k++ % 10000) * 3h));
}
BENCHMARK(BM_EarthEnvironment_NewInterval);

}  // namespace
}  // namespace orrery
