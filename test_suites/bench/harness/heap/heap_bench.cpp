// A trace of allocations as flight code makes them, through malloc and free of this program: on the
// simulated heap, and on the C library's.

#include <orrery/harness/heap/interposition.hpp>
#include <orrery/harness/heap/simulated_heap.hpp>

#include <benchmark/benchmark.h>

#include <cstdint>
#include <cstdlib>
#include <optional>
#include <random>
#include <vector>

namespace orrery {
namespace {

// One call: `slot` is freed if it is in use, then `bytes` are allocated for it, unless 0.
struct Step {
  std::uint32_t slot, bytes;
};

class Draw {
 public:
  explicit Draw(std::uint32_t seed) : engine_(seed) {}
  std::uint32_t below(std::uint32_t n) { return static_cast<std::uint32_t>(engine_() % n); }

 private:
  std::mt19937 engine_;
};

// Every step replaces a random block of `live` by one of 8 to 1032 bytes.
std::vector<Step> random_replacement(std::uint32_t live) {
  Draw draw(1);
  std::vector<Step> steps(100'000);
  for (Step& step : steps) {
    step.slot = draw.below(live);
    step.bytes = 8 + draw.below(1025);
  }
  return steps;
}

// A filter update: matrices of n x n doubles, allocated in turn and freed in reverse, beside a list
// of small nodes that grows and shrinks.
std::vector<Step> filter_updates() {
  Draw draw(2);
  std::vector<Step> steps;
  while (steps.size() < 100'000) {
    constexpr std::uint32_t kMatrices = 6;
    for (std::uint32_t i = 0; i < kMatrices; ++i) steps.push_back({i, 8 * 20 * 20});
    for (int i = 0; i < 10; ++i) steps.push_back({kMatrices + draw.below(200), 48});
    for (std::uint32_t i = kMatrices; i-- > 0;) steps.push_back({i, 0});
  }
  return steps;
}

void play(benchmark::State& state, const std::vector<Step>& steps, int alignment) {
  warm_up_libraries();
  std::optional<SimulatedHeap> heap;
  if (alignment != 0) {
    if (!heap_simulation_available()) {
      state.SkipWithError("a sanitizer owns malloc");
      return;
    }
    heap.emplace(HeapOptions{.alignment = alignment, .limit_bytes = 1u << 30});
  }
  std::vector<void*> blocks(20'000, nullptr);
  for (auto _ : state) {
    const HeapGuard guard(heap ? &*heap : nullptr);
    for (const Step& step : steps) {
      std::free(blocks[step.slot]);
      void* p = step.bytes == 0 ? nullptr : std::malloc(step.bytes);
      benchmark::DoNotOptimize(p);
      blocks[step.slot] = p;
    }
  }
  for (void* p : blocks) std::free(p);
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(steps.size()));
  if (heap) {
    const HeapFigures f = heap->blocks().figures();
    state.counters["heap_kB"] = static_cast<double>(f.heap_bytes) / 1e3;
    state.counters["search"] =
        static_cast<double>(f.search_steps) / static_cast<double>(f.allocations);
  }
}

// Alignment 0: the C library's heap, through the same hooks.
void BM_Heap_RandomReplacement(benchmark::State& state) {
  play(state, random_replacement(static_cast<std::uint32_t>(state.range(1))),
       static_cast<int>(state.range(0)));
}
BENCHMARK(BM_Heap_RandomReplacement)
    ->ArgNames({"align", "live"})
    ->ArgsProduct({{0, 16, 8}, {10, 1'000, 10'000}});

void BM_Heap_FilterUpdates(benchmark::State& state) {
  play(state, filter_updates(), static_cast<int>(state.range(0)));
}
BENCHMARK(BM_Heap_FilterUpdates)->ArgName("align")->Arg(0)->Arg(16)->Arg(8);

}  // namespace
}  // namespace orrery
