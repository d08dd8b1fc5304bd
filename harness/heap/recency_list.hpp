/// The paper's list of free blocks, most recently freed first, with an index over it.
#pragma once

#include <orrery/harness/heap/block_heap.hpp>
#include <orrery/harness/heap/page_array.hpp>

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
  using Slot = std::uint32_t;

  RecencyList(const HeapArea& area, const HeapRules&) : area_(area) {
    grow();
    entries_[kFirst - 1] = kEdge;
  }

  std::uint64_t length() const { return length_; }

  /// True if the block is in the list with that size.
  bool holds(HeapOffset block, std::uint32_t size) const {
    const Slot slot = area_.word(block);
    return slot < end_ && entries_[slot] == entry(block, size) && area_.word(block + 4) == ~slot;
  }

  void insert(HeapOffset block, std::uint32_t size, bool /*at_top*/ = false) {
    if (full()) make_room();
    area_.link(block) = push(block, size);
  }
  void remove(HeapOffset block, std::uint32_t) { remove(area_.word(block)); }
  void take(HeapOffset block, std::uint32_t size) { remove(block, size); }

  /// The block is taken, and its rest goes to the front.
  void split(HeapOffset block, std::uint32_t found, HeapOffset rest, std::uint32_t size,
             bool at_top) {
    remove(block, found);
    insert(rest, size, at_top);
  }
  /// `now`, a part of `old`, takes its place in the list.
  void replace(HeapOffset old, HeapOffset now, std::uint32_t size) {
    const Slot slot = area_.word(old);
    area_.link(now) = shrink(slot, now, size);
  }

  /// The first block of at least `size`; 0: none. Adds the blocks that a walk would have looked
  /// at, this one included.
  HeapOffset find(std::uint32_t size, std::uint64_t& steps) {
    return block_of(find_slot(size, steps));
  }

  // ---- by slots: what the calls above come to, and what FirstFitHeap calls

  /// True: push() needs make_room() first, which renumbers the slots.
  bool full() const { return end_ == capacity_; }
  Slot end() const { return end_; }
  /// What a slot holds: size and block in one word; 0 if it is empty.
  std::uint64_t operator[](Slot slot) const { return entries_[slot]; }
  HeapOffset block_of(Slot slot) const { return static_cast<HeapOffset>(entries_[slot]); }
  std::uint32_t size_of(Slot slot) const {
    return static_cast<std::uint32_t>(entries_[slot] >> 32);
  }
  static constexpr std::uint64_t entry(HeapOffset block, std::uint32_t size) {
    return std::uint64_t{size} << 32 | block;
  }
  /// The first 8 payload bytes of a slot's block.
  static constexpr std::uint64_t mark(Slot slot) { return std::uint64_t{~slot} << 32 | slot; }

  /// Slot of the first block of at least `size`, else one that is empty.
  Slot find_slot(std::uint32_t size, std::uint64_t& steps) {
    // At the front, where most searches end.
    const std::uint64_t wanted = entry(0, size);
    const std::uint64_t* front = &entries_[end_ - 1];
    if (*front >= wanted) {
      ++steps;
      return end_ - 1;
    }
    return *(front - 1) >= wanted ? (steps += 2, end_ - 2) : search(size, steps);
  }

  /// Puts the block in front: the mark that it must bear.
  std::uint64_t push(HeapOffset block, std::uint32_t size) {
    const Slot slot = end_;
    entries_[slot] = entry(block, size);
    ++live_[slot / 64];
    if (__builtin_expect(bounds_[slot / 64] < size, 0)) raise_bound(slot / 64, size);
    end_ = slot + 1;
    ++length_;
    return mark(slot);
  }
  /// Empties the slot.
  void remove(Slot slot) {
    entries_[slot] = 0;
    --live_[slot / 64];
    --length_;
    // What was in front leaves no gap: the usual malloc after free.
    if (slot + 1 == end_) {
      while (entries_[slot - 1] == 0) --slot;
      end_ = slot;
    }
  }
  /// The slot holds a part of its block from here on: the mark that this must bear.
  std::uint64_t shrink(Slot slot, HeapOffset part, std::uint32_t size) {
    entries_[slot] = entry(part, size);
    return mark(slot);
  }

  /// Size of the largest block.
  std::uint32_t largest();
  /// The front of the list to its end: 0 if it holds `blocks` sound free blocks, else the bad one
  /// or, if only the number is wrong, HeapArea::kBad.
  HeapOffset check(std::uint64_t blocks) const;

 private:
  // The first slots hold no block, so that there is something before any front: nothing, and an
  // edge of size 0, where trimming ends.
  static constexpr Slot kFirst = 2;
  static constexpr std::uint64_t kEdge = HeapArea::kBad;

  void raise_bound(std::uint32_t bucket, std::uint32_t size) {
    bounds_[bucket] = size;
    if (group_bounds_[bucket / 64] < size) group_bounds_[bucket / 64] = size;
  }
  Slot search(std::uint32_t size, std::uint64_t& steps);
  Slot find_in_group(std::uint32_t g, std::uint32_t size, std::uint64_t& steps);
  Slot find_in_bucket(std::uint32_t b, std::uint32_t size, std::uint64_t& steps);
  std::uint32_t live_in_group(std::uint32_t g) const;
  std::uint32_t bound_of_bucket(std::uint32_t b) const;
  std::uint32_t last_bucket(std::uint32_t g) const;
  void grow();
  void make_room();

  const HeapArea& area_;
  PageArray<std::uint64_t> entries_;
  PageArray<std::uint8_t> live_;  // blocks in a bucket
  PageArray<std::uint32_t> bounds_, group_bounds_;
  Slot end_ = kFirst, capacity_ = 0;
  std::uint64_t length_ = 0;
};

}  // namespace orrery::internal
