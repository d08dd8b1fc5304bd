#include <orrery/harness/heap/accounting.hpp>
#include <orrery/harness/heap/simulated_heap.hpp>

#include <algorithm>
#include <array>

namespace orrery {
namespace internal {
constinit std::array<SimulatedHeap*, Arena::kSlots> heap_of_slot{};
}  // namespace internal

using internal::heap_of_slot;

namespace {

std::unique_ptr<BlockHeap> heap_in(Arena& arena, const HeapOptions& options) {
  if (heap_accounting_available()) {
    internal::install_accounting();
    return make_accounting_heap(options);
  }
  arena.open(BlockHeap::arena_bytes(options));
  return make_heap(arena.base(), options);
}

}  // namespace

thread_local constinit SimulatedHeap* current_heap = nullptr;

SimulatedHeap::SimulatedHeap(const HeapOptions& options) : blocks_(heap_in(arena_, options)) {
  unwatched_ = blocks_.get();
  heap_of_slot[arena_.slot()] = this;
  if (options.rules.fill || options.rules.track_sites) watch();
}

SimulatedHeap::~SimulatedHeap() {
  heap_of_slot[arena_.slot()] = nullptr;
  if (heap_accounting_available()) internal::forget_accounts(this);
}

void SimulatedHeap::set_limit(std::uint64_t bytes) {
  blocks_->set_limit(bytes);
  arena_.open(BlockHeap::arena_bytes(blocks_->options()));
}

void SimulatedHeap::drop() {
  heap_of_slot[arena_.slot()] = nullptr;
  if (heap_accounting_available()) internal::forget_accounts(this);
  arena_.reset();
}

HeapWatch& SimulatedHeap::watch() {
  const HeapGuard outside(nullptr);
  if (watch_ == nullptr) watch_ = std::make_unique<HeapWatch>(blocks_->options().rules);
  unwatched_ = nullptr;
  return *watch_;
}

void* SimulatedHeap::watched_allocate(std::size_t bytes) noexcept {
  if (watch_->refuses()) return nullptr;
  void* made = blocks_->allocate(bytes);
  if (made != nullptr) watch_->allocated(made, bytes, blocks_->usable_bytes(made));
  return made;
}

void* SimulatedHeap::watched_allocate_zeroed(std::size_t count, std::size_t bytes) noexcept {
  if (watch_->refuses()) return nullptr;
  void* made = blocks_->allocate_zeroed(count, bytes);
  if (made != nullptr) watch_->zeroed(made, count * bytes);
  return made;
}

void* SimulatedHeap::watched_allocate_aligned(std::size_t alignment, std::size_t bytes) noexcept {
  if (watch_->refuses()) return nullptr;
  void* made = blocks_->allocate_aligned(alignment, bytes);
  if (made != nullptr) watch_->aligned(made, bytes, alignment, blocks_->usable_bytes(made));
  return made;
}

void* SimulatedHeap::watched_reallocate(void* payload, std::size_t bytes) noexcept {
  if (payload == nullptr) return watched_allocate(bytes);
  if (bytes == 0 && !blocks_->options().rules.realloc_to_zero_keeps) {
    watched_release(payload);
    return nullptr;
  }
  const std::size_t old_usable = blocks_->usable_bytes(payload);  // reports a bad pointer
  if (old_usable == 0 || watch_->refuses()) return nullptr;
  void* made = blocks_->reallocate(payload, bytes);
  if (made != nullptr) {
    watch_->reallocated(payload, old_usable, made, bytes, blocks_->usable_bytes(made));
  }
  return made;
}

// A fault in what follows ends the process; until then the block counts as freed here.
void SimulatedHeap::watched_release(void* payload) noexcept {
  if (payload == nullptr) return;
  watch_->released(payload);
  blocks_->release(payload);
}

}  // namespace orrery
