/// The paper's list of free blocks, most recently freed first, with an index over it.
#pragma once

#include <orrery/harness/heap/block_heap.hpp>
#include <orrery/harness/heap/page_array.hpp>

#include <bit>
#include <cstdint>

namespace orrery::internal {

/// Finds exactly the block that a walk from the front finds, without the walk.
///
/// Method    The list is an array of slots, the front of the list at its end. 64 slots make a
///           bucket, 64 buckets a group; both know a bound that no block of theirs exceeds. A
///           search passes over what is bounded below the request, and tightens the bounds of
///           what it looked through in vain, so that the next one need not. When the array is
///           full, the blocks that are left move together.
/// Cost      Tens of nanoseconds amortised, whatever lies in front; a removal lets at most one
///           bucket and one group be searched in vain.
/// In the    A free block's first 8 payload bytes hold its slot and that slot's complement, in the
/// arena     place of the paper's links: overwritten, they no longer name the block.
class RecencyList {
 public:
  static constexpr bool kScatters = false;

  RecencyList(const HeapArea& area, const HeapRules&) : area_(area) {}

  std::uint64_t length() const { return length_; }

  /// True if the block is in the list with that size.
  bool holds(HeapOffset block, std::uint32_t size) const {
    const std::uint32_t slot = area_.word(block);
    if (slot >= end_ || area_.word(block + 4) != ~slot) return false;
    const Bucket& bucket = buckets_[slot / 64];
    return (bucket.live >> (slot % 64) & 1) != 0 && bucket.block[slot % 64] == block &&
           bucket.size[slot % 64] == size;
  }

  void insert(HeapOffset block, std::uint32_t size, bool /*at_top*/ = false) {
    if (end_ == capacity_) make_room();
    put(end_++, block, size);
    ++length_;
  }
  void insert_rest(HeapOffset block, std::uint32_t size, bool at_top) {
    insert(block, size, at_top);
  }

  void remove(HeapOffset block, std::uint32_t) {
    const std::uint32_t slot = area_.word(block);
    Bucket& bucket = buckets_[slot / 64];
    bucket.live &= ~(std::uint64_t{1} << (slot % 64));
    if (bucket.live == 0) bucket.bound = 0;
    --groups_[slot / 4096].live;
    --length_;
    // What was in front leaves no gap: the usual malloc after free.
    if (slot + 1 == end_) {
      const std::uint32_t begin = slot & ~63u;
      end_ = bucket.live == 0
                 ? begin
                 : begin + 64 - static_cast<std::uint32_t>(std::countl_zero(bucket.live));
    }
  }
  void take(HeapOffset block, std::uint32_t size) { remove(block, size); }

  /// `now` takes the place of `old` in the list.
  void replace(HeapOffset old, HeapOffset now, std::uint32_t size) {
    const std::uint32_t slot = area_.word(old);
    Bucket& bucket = buckets_[slot / 64];
    bucket.block[slot % 64] = now;
    bucket.size[slot % 64] = size;
    area_.word(now) = slot;
    area_.word(now + 4) = ~slot;
  }

  /// The first block of at least `size`; 0: none. Adds the blocks that a walk would have looked
  /// at, this one included.
  HeapOffset find(std::uint32_t size, std::uint64_t& steps) {
    if (end_ == 0) return 0;
    for (std::uint32_t g = (end_ - 1) / 4096 + 1; g-- > 0;) {
      if (groups_[g].bound < size) {
        steps += groups_[g].live;
        continue;
      }
      const HeapOffset found = find_in_group(g, size, steps);
      if (found != 0) return found;
    }
    return 0;
  }

  /// Size of the largest block.
  std::uint32_t largest();
  /// The front of the list to its end: 0 if it holds `blocks` sound free blocks, else the bad one
  /// or, if only the number is wrong, HeapArea::kBad.
  HeapOffset check(std::uint64_t blocks) const;

 private:
  struct Bucket {
    std::uint64_t live;  // bit i: slot i holds a block
    std::uint32_t bound, unused;
    std::uint32_t size[64], block[64];
  };
  struct Group {
    std::uint32_t bound, live;
  };

  void put(std::uint32_t slot, HeapOffset block, std::uint32_t size) {
    Bucket& bucket = buckets_[slot / 64];
    Group& group = groups_[slot / 4096];
    bucket.live |= std::uint64_t{1} << (slot % 64);
    bucket.size[slot % 64] = size;
    bucket.block[slot % 64] = block;
    if (bucket.bound < size) bucket.bound = size;
    if (group.bound < size) group.bound = size;
    ++group.live;
    area_.word(block) = slot;
    area_.word(block + 4) = ~slot;
  }
  HeapOffset find_in_group(std::uint32_t g, std::uint32_t size, std::uint64_t& steps);
  std::uint32_t last_bucket(std::uint32_t g) const;
  void make_room();

  const HeapArea& area_;
  PageArray<Bucket> buckets_;
  PageArray<Group> groups_;
  std::uint32_t end_ = 0, capacity_ = 0;  // slots
  std::uint64_t length_ = 0;
};

}  // namespace orrery::internal
