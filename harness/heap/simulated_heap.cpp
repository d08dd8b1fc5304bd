#include <orrery/harness/heap/simulated_heap.hpp>

#include <algorithm>
#include <array>

namespace orrery {
namespace {

// By slot. Plain pointers: a heap belongs to the one thread that runs its process.
constinit std::array<SimulatedHeap*, Arena::kSlots> heap_of_slot{};

void* open_arena(Arena& arena, std::uint64_t limit_bytes) {
  arena.open(limit_bytes + FirstFitHeap::kOverhead_bytes);
  return arena.base();
}

}  // namespace

thread_local constinit SimulatedHeap* current_heap = nullptr;

SimulatedHeap::SimulatedHeap(const FirstFitOptions& options)
    : blocks_(open_arena(arena_, std::min(options.limit_bytes, FirstFitHeap::kMaxLimit_bytes)),
              options) {
  heap_of_slot[arena_.slot()] = this;
}

SimulatedHeap::~SimulatedHeap() {
  heap_of_slot[arena_.slot()] = nullptr;
}

void SimulatedHeap::set_limit(std::uint64_t bytes) {
  blocks_.set_limit(bytes);
  arena_.open(bytes + FirstFitHeap::kOverhead_bytes);
}

void SimulatedHeap::drop() {
  heap_of_slot[arena_.slot()] = nullptr;
  blocks_.largest_free_bytes();  // while the list can still be read
  arena_.reset();
}

SimulatedHeap* SimulatedHeap::owner_of(const void* address) {
  return Arena::contains(address) ? heap_of_slot[Arena::slot_of(address)] : nullptr;
}

}  // namespace orrery
