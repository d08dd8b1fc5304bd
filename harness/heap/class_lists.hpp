/// Free blocks in lists by size class: best fit, two-level segregated fit, and newlib's bins.
#pragma once

#include <orrery/harness/heap/block_heap.hpp>

#include <array>
#include <cstdint>

namespace orrery::internal {

/// Doubly linked lists, one per class, whose links lie in the first 8 payload bytes of the blocks,
/// and a bitmap of those that are not empty.
class ClassLists {
 public:
  static constexpr std::uint32_t kMostClasses = 1024;

  explicit ClassLists(const HeapArea& area) : area_(area) {}

  std::uint64_t length() const { return length_; }
  HeapOffset front(std::uint32_t list) const { return front_[list]; }
  HeapOffset back(std::uint32_t list) const { return back_[list]; }
  HeapOffset next(HeapOffset block) const { return area_.word(block); }
  HeapOffset previous(HeapOffset block) const { return area_.word(block + 4); }

  /// True if the block's neighbours in the list know it.
  bool linked(HeapOffset block, std::uint32_t list) const;
  /// Before `after`; at the end if that is 0.
  void insert_before(HeapOffset after, HeapOffset block, std::uint32_t list);
  void unlink(HeapOffset block, std::uint32_t list);
  /// The first list from `list` on that holds a block; kMostClasses: none.
  std::uint32_t first_used(std::uint32_t list) const;
  /// True if a walk may go on to this block of the list.
  bool plausible(HeapOffset block) const {
    return area_.within(block) && (area_.header(block) & HeapArea::kLive) == 0;
  }

  const HeapArea& area() const { return area_; }

 private:
  const HeapArea& area_;
  std::array<HeapOffset, kMostClasses> front_{}, back_{};
  std::array<std::uint64_t, kMostClasses / 64> used_{};
  std::uint64_t length_ = 0;
};

/// Number of the class of sizes that `size` belongs to: 32 classes of equal width for each power of
/// two from 256 on, and 8 bytes wide below. Increases with the size.
/// Source  Masmano, Ripoll, Crespo & Real, TLSF (ECRTS 2004), with 5 bits of second level.
std::uint32_t two_level_class(std::uint32_t size);

/// newlib's (dlmalloc 2.6's) bin: 8 bytes wide below 512, then in six steps of wider ones.
std::uint32_t newlib_bin(std::uint32_t size);

/// The smallest block that is large enough; of equal ones that freed last.
class BestFitLists {
 public:
  static constexpr bool kScatters = false;
  BestFitLists(const HeapArea& area, const HeapRules&) : lists_(area) {}

  std::uint64_t length() const { return lists_.length(); }
  bool holds(HeapOffset block, std::uint32_t size) const {
    return lists_.linked(block, two_level_class(size));
  }
  void insert(HeapOffset block, std::uint32_t size, bool = false) {
    const std::uint32_t list = two_level_class(size);
    lists_.insert_before(lists_.front(list), block, list);
  }
  void split(HeapOffset block, std::uint32_t found, HeapOffset rest, std::uint32_t size, bool) {
    remove(block, found);
    insert(rest, size);
  }
  void remove(HeapOffset block, std::uint32_t size) { lists_.unlink(block, two_level_class(size)); }
  void take(HeapOffset block, std::uint32_t size) { remove(block, size); }
  void replace(HeapOffset old, HeapOffset now, std::uint32_t size);
  HeapOffset find(std::uint32_t size, std::uint64_t& steps);
  std::uint32_t largest();
  HeapOffset check(std::uint64_t blocks) const;

 protected:
  HeapOffset smallest_in(std::uint32_t list, std::uint32_t size, std::uint64_t& steps) const;
  ClassLists lists_;
};

/// The head of the first class whose every block is large enough.
class TlsfLists : public BestFitLists {
 public:
  using BestFitLists::BestFitLists;
  HeapOffset find(std::uint32_t size, std::uint64_t& steps);
};

/// Bins sorted by size, the remainder of the last split first, the block at the top last.
class NewlibBins {
 public:
  static constexpr bool kScatters = false;
  NewlibBins(const HeapArea& area, const HeapRules&) : bins_(area) {}

  std::uint64_t length() const {
    return bins_.length() + (remainder_ != 0 ? 1 : 0) + (wilderness_ != 0 ? 1 : 0);
  }
  bool holds(HeapOffset block, std::uint32_t size) const;
  void insert(HeapOffset block, std::uint32_t size, bool at_top);
  void split(HeapOffset block, std::uint32_t found, HeapOffset rest, std::uint32_t size,
             bool at_top);
  void remove(HeapOffset block, std::uint32_t size);
  void take(HeapOffset block, std::uint32_t size);
  void replace(HeapOffset old, HeapOffset now, std::uint32_t size);
  HeapOffset find(std::uint32_t size, std::uint64_t& steps);
  std::uint32_t largest();
  HeapOffset check(std::uint64_t blocks) const;

 private:
  static constexpr std::uint32_t kMark = 0x0F4EEB1C;  // of blocks that are in no bin
  static constexpr std::uint32_t kLeast_bytes = 16;
  static constexpr std::uint32_t kSmall_bytes = 512;

  void set_apart(HeapOffset& place, HeapOffset block);
  void put_in_bin(HeapOffset block, std::uint32_t size);
  HeapOffset find_in_own_bin(std::uint32_t size, std::uint32_t& next_bin, std::uint64_t& steps);
  HeapOffset use_remainder(std::uint32_t size, std::uint64_t& steps);

  ClassLists bins_;
  HeapOffset remainder_ = 0, wilderness_ = 0;
  bool joined_remainder_ = false;  // what is inserted next contains it, and takes its place
};

}  // namespace orrery::internal
