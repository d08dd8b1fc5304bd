#include <orrery/harness/heap/simulated_heap.hpp>

#include <algorithm>
#include <array>

namespace orrery {
namespace {

// By slot. Plain pointers: a heap belongs to the one thread that runs its process.
constinit std::array<SimulatedHeap*, Arena::kSlots> heap_of_slot{};

void* open_arena(Arena& arena, const HeapOptions& options) {
  arena.open(BlockHeap::arena_bytes(options));
  return arena.base();
}

}  // namespace

thread_local constinit SimulatedHeap* current_heap = nullptr;

SimulatedHeap::SimulatedHeap(const HeapOptions& options)
    : blocks_(make_heap(open_arena(arena_, options), options)) {
  heap_of_slot[arena_.slot()] = this;
}

SimulatedHeap::~SimulatedHeap() {
  heap_of_slot[arena_.slot()] = nullptr;
}

void SimulatedHeap::set_limit(std::uint64_t bytes) {
  blocks_->set_limit(bytes);
  arena_.open(BlockHeap::arena_bytes(blocks_->options()));
}

void SimulatedHeap::drop() {
  heap_of_slot[arena_.slot()] = nullptr;
  arena_.reset();
}

SimulatedHeap* SimulatedHeap::owner_of(const void* address) {
  return Arena::contains(address) ? heap_of_slot[Arena::slot_of(address)] : nullptr;
}

}  // namespace orrery
