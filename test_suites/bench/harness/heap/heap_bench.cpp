// The paper's heap, with its accounting, and the C library's on the same traces through the same
// hooks: what flight software asked for in flight, and loads made up to be hard.

#include <orrery/harness/heap/interposition.hpp>
#include <orrery/harness/heap/simulated_heap.hpp>
#include <orrery/orrery.hpp>

#include <benchmark/benchmark.h>

#include <cstdint>
#include <cstdlib>
#include <optional>
#include <random>
#include <utility>
#include <vector>

namespace orrery {
namespace {

// One operation: `slot` gets a block of `bytes`, or gives its block back if that is 0.
struct Step {
  std::uint32_t slot, bytes;
};

// The deputy's requests over one orbit, flying a program that uses its heap as estimators in C++
// do (the package formation_keeping allocates once). calloc and realloc, of which there are few,
// are played as malloc, and as malloc and free.
std::vector<Step> recorded_flight() {
  FormationOptions options{.flight = {.library = "fixture_estimator"}};
  options.world.record = false;
  FormationWorld world(options);
  world.heap("deputy").record_trace();
  world.run_for(5739s);
  std::vector<Step> steps;
  std::vector<std::uint32_t> free_slots, slot_of;
  std::uint32_t slots = 0;
  const auto make = [&](std::uint64_t bytes) {
    if (free_slots.empty()) free_slots.push_back(slots++);
    slot_of.push_back(free_slots.back());
    free_slots.pop_back();
    steps.push_back({slot_of.back(), static_cast<std::uint32_t>(bytes == 0 ? 1 : bytes)});
  };
  const auto give_back = [&](std::uint64_t block) {
    steps.push_back({slot_of[block], 0});
    free_slots.push_back(slot_of[block]);
  };
  for (const HeapTraceStep& step : read_heap_trace(world.heap("deputy").trace())) {
    if (step.operation == HeapOperation::kCall) continue;
    if (step.operation == HeapOperation::kFree) {
      give_back(step.block);
    } else {
      make(step.bytes);
      if (step.operation == HeapOperation::kRealloc) give_back(step.old_block);
    }
  }
  return steps;
}

class Draw {
 public:
  explicit Draw(std::uint32_t seed) : engine_(seed) {}
  std::uint32_t below(std::uint32_t n) { return static_cast<std::uint32_t>(engine_() % n); }

 private:
  std::mt19937 engine_;
};

// A random block of `live` is replaced by one of 8 to 1032 bytes, again and again.
std::vector<Step> random_replacement(std::uint32_t live) {
  Draw draw(1);
  std::vector<Step> steps;
  for (std::uint32_t slot = 0; slot < live; ++slot) steps.push_back({slot, 8 + draw.below(1025)});
  while (steps.size() < 200'000) {
    const std::uint32_t slot = draw.below(live);
    steps.push_back({slot, 0});
    steps.push_back({slot, 8 + draw.below(1025)});
  }
  return steps;
}

// Plays the steps and frees what they leave.
void play(benchmark::State& state, const std::vector<Step>& steps, const HeapRules& rules) {
  warm_up_libraries();
  const int alignment = static_cast<int>(state.range(0));  // 0: the C library's heap
  std::optional<SimulatedHeap> heap;
  if (alignment != 0) {
    heap.emplace(HeapOptions{.alignment = alignment, .limit_bytes = 1u << 30, .rules = rules});
  }
  std::vector<void*> blocks(20'000, nullptr);
  for (auto _ : state) {
    const HeapGuard guard(heap ? &*heap : nullptr);
    for (const Step& step : steps) {
      void*& block = blocks[step.slot];
      if (step.bytes == 0) {
        std::free(std::exchange(block, nullptr));
      } else {
        block = std::malloc(step.bytes);
        benchmark::DoNotOptimize(block);
      }
    }
    for (void*& block : blocks) {
      if (block != nullptr) std::free(std::exchange(block, nullptr));
    }
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(steps.size()));
  state.counters["steps"] = static_cast<double>(steps.size());
  if (heap) {
    const HeapFigures f = heap->blocks().figures();
    state.counters["heap_kB"] = static_cast<double>(f.heap_bytes) / 1e3;
    state.counters["search"] =
        static_cast<double>(f.search_steps) / static_cast<double>(f.allocations);
  }
}

void BM_Heap_RecordedFlight(benchmark::State& state) {
  static const std::vector<Step> steps = recorded_flight();
  play(state, steps, {});
}
BENCHMARK(BM_Heap_RecordedFlight)->ArgName("align")->Arg(0)->Arg(16)->Arg(8);

void BM_Heap_RecordedFlightByPolicy(benchmark::State& state) {
  static const std::vector<Step> steps = recorded_flight();
  const HeapPolicy policy = static_cast<HeapPolicy>(state.range(1));
  state.SetLabel(to_string(policy));
  play(state, steps, {.policy = policy});
}
BENCHMARK(BM_Heap_RecordedFlightByPolicy)
    ->ArgNames({"align", "policy"})
    ->ArgsProduct({{16}, {0, 1, 2, 3, 4, 5, 6}});

void BM_Heap_RandomReplacement(benchmark::State& state) {
  play(state, random_replacement(static_cast<std::uint32_t>(state.range(1))), {});
}
BENCHMARK(BM_Heap_RandomReplacement)
    ->ArgNames({"align", "live"})
    ->ArgsProduct({{0, 16, 8}, {10, 1'000, 10'000}});

// A malloc that none of `holes` free blocks of 16 bytes can serve, so that a walk of the list would
// look at all of them before it gives up at the limit. A block that would do is taken before and
// given back after it, so that the bounds over the holes have to be renewed each time.
void BM_Heap_BehindUselessHoles(benchmark::State& state) {
  SimulatedHeap heap(HeapOptions{.alignment = 8, .limit_bytes = 1u << 30});
  BlockHeap& blocks = heap.blocks();
  const std::size_t holes = static_cast<std::size_t>(state.range(0));
  std::vector<void*> small;
  for (std::size_t i = 0; i < 2 * holes; ++i) small.push_back(blocks.allocate(8));
  void* useful = blocks.allocate(1000);
  blocks.allocate(8);
  for (std::size_t i = 0; i < 2 * holes; i += 2) blocks.release(small[i]);
  blocks.release(useful);
  blocks.set_limit(blocks.heap_bytes());
  const std::uint64_t before = blocks.figures().search_steps;
  for (auto _ : state) {
    void* front = blocks.allocate(1000);
    void* refused = blocks.allocate(1000);
    benchmark::DoNotOptimize(refused);
    blocks.release(front);
  }
  state.counters["search"] = static_cast<double>(blocks.figures().search_steps - before) /
                             static_cast<double>(state.iterations());
}
BENCHMARK(BM_Heap_BehindUselessHoles)->ArgName("holes")->Arg(0)->Arg(1'000)->Arg(100'000);

}  // namespace
}  // namespace orrery
