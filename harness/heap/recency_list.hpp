/// The paper's list of free blocks, most recently freed first, with an index over it.
#pragma once

#include <orrery/harness/heap/block_heap.hpp>
#include <orrery/harness/heap/page_array.hpp>

#include <cstdint>

namespace orrery::internal {

/// Finds exactly the block that a walk from the front finds, without the walk.
///
/// Method    The list is an array of slots, the front of the list at its end. The slots nearest to
///           it, the hot ones, are walked: most lists have no others. The rest is indexed: 64 slots
///           make a bucket, which knows how many blocks it holds, 64 buckets a group; both know a
///           bound that no block of theirs exceeds. A search passes over what is bounded below the
///           request, and tightens the bounds of what it looked through in vain, so that the next
///           one need not. When there is no room in front, blocks move together, or the hindmost
///           hot ones are indexed.
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
    limit_ = kMostHot;
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
    ++length_;
  }
  void remove(HeapOffset block, std::uint32_t) {
    remove(area_.word(block));
    --length_;
  }
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
    area_.link(now) = put(slot, now, size);
  }

  /// The first block of at least `size`; 0: none. Adds the blocks that a walk would have looked
  /// at, this one included.
  HeapOffset find(std::uint32_t size, std::uint64_t& steps) {
    return block_of(find_slot(size, steps));
  }

  // ---- by slots: what the calls above come to, and what FirstFitHeap calls, which keeps length()
  // itself

  /// True: push() needs make_room() first, which renumbers the slots.
  bool full() const { return end_ == limit_; }
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
    const std::uint64_t wanted = entry(0, size);
    const Slot last = std::max(hot_, kFirst);
    for (Slot slot = end_; slot-- > last;) {
      const std::uint64_t e = entries_[slot];
      steps += e != 0 ? 1 : 0;
      if (e >= wanted) return slot;
    }
    return search(size, steps);
  }

  /// Puts the block in front: the mark that it must bear.
  std::uint64_t push(HeapOffset block, std::uint32_t size) { return put(end_++, block, size); }
  /// Empties the slot.
  void remove(Slot slot) {
    entries_[slot] = 0;
    if (slot < hot_) --live_[slot / 64];
    if (slot + 1 == end_) trim();
  }
  /// remove() and push(). Where the slot is second, the front steps back and no gap is left.
  std::uint64_t push_for(Slot slot, HeapOffset block, std::uint32_t size) {
    if (slot + 1 == end_) return put(slot, block, size);
    if (slot + 2 == end_ && slot >= hot_) {
      const std::uint64_t front = entries_[slot + 1];
      HeapArea::Link& front_mark = area_.link(static_cast<HeapOffset>(front));
      if (front_mark == mark(slot + 1)) {  // else that is to be found, not mended
        entries_[slot] = front;
        front_mark = mark(slot);
        return put(slot + 1, block, size);
      }
    }
    entries_[slot] = 0;
    if (slot < hot_) --live_[slot / 64];
    return push(block, size);
  }
  /// Into a slot that is in use: the mark that the block must bear. @pre the slot is hot, or what
  /// it held is no smaller
  std::uint64_t put(Slot slot, HeapOffset block, std::uint32_t size) {
    entries_[slot] = entry(block, size);
    return mark(slot);
  }
  void add_length(std::int64_t blocks) { length_ += static_cast<std::uint64_t>(blocks); }

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

  static constexpr Slot kMostHot = 256;

  // What was in front leaves no gap: the usual malloc after free.
  void trim() {
    Slot end = end_ - 1;
    while (entries_[end - 1] == 0) --end;
    end_ = end;
    if (__builtin_expect(end <= hot_, 0)) reheat();
  }
  void reheat();
  Slot search(std::uint32_t size, std::uint64_t& steps);
  Slot find_in_group(std::uint32_t g, std::uint32_t size, std::uint64_t& steps);
  Slot find_in_bucket(std::uint32_t b, std::uint32_t size, std::uint64_t& steps);
  std::uint32_t live_in_group(std::uint32_t g) const;
  std::uint32_t largest_between(Slot first, Slot end) const;
  std::uint32_t end_bucket(std::uint32_t g) const;
  void index_bucket(std::uint32_t b);
  void grow();
  void make_room();
  void move_together(Slot first);

  const HeapArea& area_;
  PageArray<std::uint64_t> entries_;
  PageArray<std::uint8_t> live_;  // blocks in a bucket, 0 if it is not indexed
  PageArray<std::uint32_t> bounds_, group_bounds_;
  Slot end_ = kFirst;
  Slot limit_ = 0;  // where end_ needs make_room()
  Slot hot_ = 0;    // what lies before is indexed: a multiple of 64 before end_
  std::uint64_t length_ = 0;
};

}  // namespace orrery::internal
