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
    return bucket.block[slot % 64] == block && bucket.size[slot % 64] == size;
  }

  void insert(HeapOffset block, std::uint32_t size, bool /*at_top*/ = false) {
    if (end_ == capacity_) make_room();
    put(end_++, block, size);
    ++length_;
  }

  void remove(HeapOffset block, std::uint32_t) {
    const std::uint32_t slot = area_.word(block);
    Bucket& bucket = buckets_[slot / 64];
    const std::uint64_t live = bucket.live & ~(std::uint64_t{1} << (slot % 64));
    bucket.live = live;
    if (live == 0) bucket.bound = 0;
    --groups_[slot / 4096].live;
    --length_;
    // What was in front leaves no gap: the usual malloc after free.
    if (slot + 1 == end_) {
      const std::uint32_t begin = slot & ~63u;
      end_ = live == 0 ? begin : begin + 64 - static_cast<std::uint32_t>(std::countl_zero(live));
    }
  }
  void take(HeapOffset block, std::uint32_t size) { remove(block, size); }

  /// The block is taken, and its rest goes to the front.
  void split(HeapOffset block, std::uint32_t found, HeapOffset rest, std::uint32_t size,
             bool at_top) {
    if (rename_front(block, rest, size)) return;
    remove(block, found);
    insert(rest, size, at_top);
  }
  /// If `old` is in front, `now` takes its place there: what removing and inserting would come to.
  bool rename_front(HeapOffset old, HeapOffset now, std::uint32_t size) {
    const std::uint32_t slot = area_.word(old);
    if (slot + 1 != end_) return false;
    set(slot, now, size);
    return true;
  }
  /// `now`, a part of `old`, takes its place in the list.
  void replace(HeapOffset old, HeapOffset now, std::uint32_t size) {
    set(area_.word(old), now, size);
  }

  /// The first block of at least `size`; 0: none. Adds the blocks that a walk would have looked
  /// at, this one included.
  HeapOffset find(std::uint32_t size, std::uint64_t& steps) {
    if (end_ == 0) return 0;
    // The front, where most searches end.
    const Bucket& bucket = buckets_[(end_ - 1) / 64];
    if (bucket.live != 0) {
      const int i = 63 - std::countl_zero(bucket.live);
      if (bucket.size[i] >= size) {
        ++steps;
        return bucket.block[i];
      }
    }
    return search(size, steps);
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
    buckets_[slot / 64].live |= std::uint64_t{1} << (slot % 64);
    ++groups_[slot / 4096].live;
    set(slot, block, size);
  }
  void set(std::uint32_t slot, HeapOffset block, std::uint32_t size) {
    Bucket& bucket = buckets_[slot / 64];
    bucket.size[slot % 64] = size;
    bucket.block[slot % 64] = block;
    if (bucket.bound < size) {
      bucket.bound = size;
      Group& group = groups_[slot / 4096];
      if (group.bound < size) group.bound = size;
    }
    area_.word(block) = slot;
    area_.word(block + 4) = ~slot;
  }
  HeapOffset search(std::uint32_t size, std::uint64_t& steps);
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
