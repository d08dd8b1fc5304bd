/// Free blocks in the order of their addresses: FreeRTOS's heap_4 and next fit.
#pragma once

#include <orrery/harness/heap/block_heap.hpp>
#include <orrery/harness/heap/page_array.hpp>

#include <cstdint>

namespace orrery::internal {

/// Marks by address, so that insertion needs no search. A bucket covers 64 units of alignment, a
/// group 64 buckets; both know a bound that no block of theirs exceeds, as in RecencyList.
class AddressList {
 public:
  static constexpr bool kScatters = false;

  AddressList(const HeapArea& area, const HeapRules& rules)
      : area_(area), roves_(rules.policy == HeapPolicy::kNextFit) {}

  std::uint64_t length() const { return length_; }
  bool holds(HeapOffset block, std::uint32_t) const {
    const std::uint32_t unit = block / area_.align;
    return unit / 64 < buckets_.size() && (buckets_[unit / 64].starts >> (unit % 64) & 1) != 0 &&
           area_.word(block) == kMark && area_.word(block + 4) == ~kMark;
  }
  void insert(HeapOffset block, std::uint32_t size, bool at_top = false);
  void split(HeapOffset block, std::uint32_t found, HeapOffset rest, std::uint32_t size,
             bool at_top) {
    remove(block, found);
    insert(rest, size, at_top);
  }
  void remove(HeapOffset block, std::uint32_t size);
  void take(HeapOffset block, std::uint32_t size) { remove(block, size); }
  void replace(HeapOffset old, HeapOffset now, std::uint32_t size) {
    remove(old, size);
    insert(now, size);
  }
  HeapOffset find(std::uint32_t size, std::uint64_t& steps);
  std::uint32_t largest();
  HeapOffset check(std::uint64_t blocks) const;

 private:
  static constexpr std::uint32_t kMark = 0x0F4EEB1C;  // in a free block's first 8 payload bytes

  struct Bucket {
    std::uint64_t starts;  // bit i: a free block begins at unit i
    std::uint32_t bound, unused;
  };
  struct Group {
    std::uint32_t bound, live;
  };
  HeapOffset find_between(std::uint32_t begin, std::uint32_t end, std::uint32_t size,
                          std::uint64_t& steps);
  HeapOffset find_in_bucket(std::uint32_t bucket, std::uint64_t mask, std::uint32_t size,
                            std::uint64_t& steps);

  const HeapArea& area_;
  bool roves_;
  PageArray<Bucket> buckets_;
  PageArray<Group> groups_;
  std::uint32_t end_ = 0;    // buckets that were ever used
  std::uint32_t rover_ = 0;  // unit where the next search begins
  std::uint64_t length_ = 0;
};

}  // namespace orrery::internal
