/// Memory for a heap under test, at no particular address.
#pragma once

#include <orrery/harness/heap/block_heap.hpp>

#include <cstddef>
#include <memory>
#include <new>

namespace orrery {

class TestArena {
 public:
  explicit TestArena(std::size_t bytes) : memory_(new (std::align_val_t(4096)) std::byte[bytes]) {}
  std::byte* base() { return memory_.get(); }

 private:
  struct Delete {
    void operator()(std::byte* p) const { operator delete[](p, std::align_val_t(4096)); }
  };
  std::unique_ptr<std::byte[], Delete> memory_;
};

/// A heap on an arena of its own, that keeps the last fault.
struct TestHeap {
  explicit TestHeap(const HeapOptions& options)
      : arena(static_cast<std::size_t>(BlockHeap::arena_bytes(options))),
        owner(make_heap(arena.base(), options)),
        heap(*owner) {
    heap.set_fault_handler(
        [](void* self, const HeapFault& fault) {
          static_cast<TestHeap*>(self)->last = fault;
          ++static_cast<TestHeap*>(self)->faults;
        },
        this);
  }
  TestArena arena;
  std::unique_ptr<BlockHeap> owner;
  BlockHeap& heap;
  HeapFault last;
  int faults = 0;
};

}  // namespace orrery
