/// Free blocks to choose from at random.
#pragma once

#include <orrery/harness/heap/block_heap.hpp>
#include <orrery/harness/heap/page_array.hpp>
#include <orrery/harness/kernel/random.hpp>

#include <cstdint>

namespace orrery::internal {

/// A request gets a block drawn from a stream of its seed, and its place within that block as well:
/// every address differs from those of another seed, so code that depends on them shows.
class ScatterList {
 public:
  static constexpr bool kScatters = true;
  ScatterList(const HeapArea& area, const HeapRules& rules) : area_(area), random_(rules.seed) {}

  std::uint64_t length() const { return length_; }
  bool holds(HeapOffset block, std::uint32_t) const {
    const std::uint32_t i = area_.word(block);
    return i < length_ && area_.word(block + 4) == ~i && blocks_[i] == block;
  }
  void insert(HeapOffset block, std::uint32_t size, bool at_top = false);
  void split(HeapOffset block, std::uint32_t found, HeapOffset rest, std::uint32_t size,
             bool at_top) {
    remove(block, found);
    insert(rest, size, at_top);
  }
  void remove(HeapOffset block, std::uint32_t size);
  void take(HeapOffset block, std::uint32_t size) { remove(block, size); }
  void replace(HeapOffset old, HeapOffset now, std::uint32_t size);
  HeapOffset find(std::uint32_t size, std::uint64_t& steps);
  /// How far into a block a request goes that leaves `slack` bytes of it.
  std::uint32_t gap(std::uint32_t slack);
  std::uint32_t largest();
  HeapOffset check(std::uint64_t blocks) const;

 private:
  std::uint64_t below(std::uint64_t n);

  const HeapArea& area_;
  RandomStream random_;
  PageArray<HeapOffset> blocks_;
  std::uint32_t length_ = 0;
};

}  // namespace orrery::internal
