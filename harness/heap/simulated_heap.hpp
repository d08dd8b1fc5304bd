/// The heap of one flight process, and which heap is current.
#pragma once

#include <orrery/harness/heap/arena.hpp>
#include <orrery/harness/heap/block_heap.hpp>

namespace orrery {

/// A heap in an arena of its own. Blocks are found by address, so what is allocated here
/// may be freed while another heap is current, or none.
class SimulatedHeap {
 public:
  /// @throws std::invalid_argument  options outside their ranges; std::runtime_error  as Arena.
  explicit SimulatedHeap(const HeapOptions& options);
  ~SimulatedHeap();
  SimulatedHeap(const SimulatedHeap&) = delete;
  SimulatedHeap& operator=(const SimulatedHeap&) = delete;

  BlockHeap& blocks() { return *blocks_; }
  const BlockHeap& blocks() const { return *blocks_; }
  void set_limit(std::uint64_t bytes);
  /// The process is dead: its memory goes back to the system, figures stay. Blocks that are freed
  /// from here on are ignored, and nothing may be allocated.
  void drop();

  /// The heap that owns the address, if its slot is in use and not dropped.
  static SimulatedHeap* owner_of(const void* address);

 private:
  Arena arena_;
  std::unique_ptr<BlockHeap> blocks_;
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
