/// The heap of one flight process, and which heap is current.
#pragma once

#include <orrery/harness/heap/arena.hpp>
#include <orrery/harness/heap/block_heap.hpp>
#include <orrery/harness/heap/heap_watch.hpp>

#include <array>
#include <memory>

namespace orrery {

class SimulatedHeap;

namespace internal {
/// By arena slot. Plain pointers: a heap belongs to the one thread that runs its process.
extern std::array<SimulatedHeap*, Arena::kSlots> heap_of_slot;
}  // namespace internal

/// A heap in an arena of its own, or, under a sanitizer, the account of one (accounting.hpp).
/// Blocks are found by address, so what is allocated here may be freed while another heap is
/// current, or none.
class SimulatedHeap {
 public:
  /// @throws std::invalid_argument  options outside their ranges; std::runtime_error  as Arena.
  explicit SimulatedHeap(const HeapOptions& options);
  ~SimulatedHeap();
  SimulatedHeap(const SimulatedHeap&) = delete;
  SimulatedHeap& operator=(const SimulatedHeap&) = delete;

  // What the allocation functions of the C library do while this heap is current, or its own.
  void* allocate(std::size_t bytes) noexcept {
    return unwatched_ != nullptr ? unwatched_->allocate(bytes) : watched_allocate(bytes);
  }
  void* allocate_zeroed(std::size_t count, std::size_t bytes) noexcept {
    return unwatched_ != nullptr ? unwatched_->allocate_zeroed(count, bytes)
                                 : watched_allocate_zeroed(count, bytes);
  }
  void* allocate_aligned(std::size_t alignment, std::size_t bytes) noexcept {
    return unwatched_ != nullptr ? unwatched_->allocate_aligned(alignment, bytes)
                                 : watched_allocate_aligned(alignment, bytes);
  }
  void* reallocate(void* payload, std::size_t bytes) noexcept {
    return unwatched_ != nullptr ? unwatched_->reallocate(payload, bytes)
                                 : watched_reallocate(payload, bytes);
  }
  void release(void* payload) noexcept {
    if (unwatched_ != nullptr) {
      unwatched_->release(payload);
    } else {
      watched_release(payload);
    }
  }

  /// Made at the first call; from then on every request is watched. Rules that need one (fill,
  /// track_sites) make it at once.
  HeapWatch& watch();
  const HeapWatch* watch_if_any() const { return watch_.get(); }

  /// While this heap is current, blocks of other heaps may be freed and resized (there, by
  /// address); else that is a foreign pointer. For instances that share a library's globals.
  void take_others_blocks() { takes_others_blocks_ = true; }
  bool takes_others_blocks() const { return takes_others_blocks_; }

  BlockHeap& blocks() { return *blocks_; }
  const BlockHeap& blocks() const { return *blocks_; }
  void set_limit(std::uint64_t bytes);
  /// The process is dead: its memory goes back to the system, figures stay. Blocks that are freed
  /// from here on are ignored, and nothing may be allocated.
  void drop();

  /// The heap that owns the address, if its slot is in use and not dropped.
  static SimulatedHeap* owner_of(const void* address) {
    return Arena::contains(address) ? internal::heap_of_slot[Arena::slot_of(address)] : nullptr;
  }

 private:
  void* watched_allocate(std::size_t bytes) noexcept;
  void* watched_allocate_zeroed(std::size_t count, std::size_t bytes) noexcept;
  void* watched_allocate_aligned(std::size_t alignment, std::size_t bytes) noexcept;
  void* watched_reallocate(void* payload, std::size_t bytes) noexcept;
  void watched_release(void* payload) noexcept;

  BlockHeap* unwatched_ = nullptr;  // blocks_ as long as there is no watch
  Arena arena_;
  std::unique_ptr<BlockHeap> blocks_;
  std::unique_ptr<HeapWatch> watch_;
  bool takes_others_blocks_ = false;
};

/// The heap from which this thread allocates; null: from the system's. Set by HeapGuard only.
#if defined(__GNUC__)
[[gnu::tls_model("initial-exec")]]
#endif
extern thread_local constinit SimulatedHeap* current_heap;

/// Makes a heap, or none (null), current. Nests.
class HeapGuard {
 public:
  explicit HeapGuard(SimulatedHeap* heap) : previous_(current_heap) { current_heap = heap; }
  ~HeapGuard() { current_heap = previous_; }
  HeapGuard(const HeapGuard&) = delete;
  HeapGuard& operator=(const HeapGuard&) = delete;

 private:
  SimulatedHeap* previous_;
};

}  // namespace orrery
