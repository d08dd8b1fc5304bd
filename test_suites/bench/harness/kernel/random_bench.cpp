#include <orrery/harness/kernel/random.hpp>

#include <benchmark/benchmark.h>

namespace orrery {
namespace {

template <class Draw>
void draw(benchmark::State& state, Draw one) {
  RandomStream stream(1);
  for (auto _ : state) benchmark::DoNotOptimize(one(stream));
  state.SetItemsProcessed(state.iterations());
}

void BM_RandomStream_Bits(benchmark::State& state) {
  draw(state, [](RandomStream& stream) { return stream.bits(); });
}
void BM_RandomStream_Uniform(benchmark::State& state) {
  draw(state, [](RandomStream& stream) { return stream.uniform(); });
}
void BM_RandomStream_Normal(benchmark::State& state) {
  draw(state, [](RandomStream& stream) { return stream.normal(); });
}
void BM_RandomStream_LogNormal(benchmark::State& state) {
  draw(state, [](RandomStream& stream) { return stream.log_normal(0.0, 1.0); });
}
void BM_RandomStream_Exponential(benchmark::State& state) {
  draw(state, [](RandomStream& stream) { return stream.exponential(1.0); });
}
void BM_RandomStream_Integer(benchmark::State& state) {
  draw(state, [](RandomStream& stream) { return stream.integer(1, 6); });
}

// Devices look their streams up by name at every event.
void BM_RandomStreams_LookUp(benchmark::State& state) {
  RandomStreams streams(1);
  for (const char* spacecraft : {"chief", "deputy"}) {
    for (const char* purpose : {"position", "velocity", "delay", "blackout", "execution"}) {
      streams.stream(spacecraft, "gnss", purpose);
    }
  }
  for (auto _ : state) benchmark::DoNotOptimize(&streams.stream("deputy", "gnss", "velocity"));
}

BENCHMARK(BM_RandomStream_Bits);
BENCHMARK(BM_RandomStream_Uniform);
BENCHMARK(BM_RandomStream_Normal);
BENCHMARK(BM_RandomStream_LogNormal);
BENCHMARK(BM_RandomStream_Exponential);
BENCHMARK(BM_RandomStream_Integer);
BENCHMARK(BM_RandomStreams_LookUp);

}  // namespace
}  // namespace orrery
