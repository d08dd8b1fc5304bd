#include <orrery/harness/heap/class_lists.hpp>

#include <algorithm>
#include <bit>

namespace orrery::internal {

// ---- lists

bool ClassLists::linked(HeapOffset block, std::uint32_t list) const {
  const HeapOffset before = previous(block), after = next(block);
  if ((before != 0 && !area_.within(before)) || (after != 0 && !area_.within(after))) return false;
  if ((before == 0 ? front_[list] : next(before)) != block) return false;
  return (after == 0 ? back_[list] : previous(after)) == block;
}

void ClassLists::insert_before(HeapOffset after, HeapOffset block, std::uint32_t list) {
  const HeapOffset before = after == 0 ? back_[list] : previous(after);
  area_.word(block) = after;
  area_.word(block + 4) = before;
  if (before == 0) {
    front_[list] = block;
  } else {
    area_.word(before) = block;
  }
  if (after == 0) {
    back_[list] = block;
  } else {
    area_.word(after + 4) = block;
  }
  used_[list / 64] |= std::uint64_t{1} << (list % 64);
  ++length_;
}

void ClassLists::unlink(HeapOffset block, std::uint32_t list) {
  const HeapOffset before = previous(block), after = next(block);
  if (before == 0) {
    front_[list] = after;
  } else {
    area_.word(before) = after;
  }
  if (after == 0) {
    back_[list] = before;
  } else {
    area_.word(after + 4) = before;
  }
  if (front_[list] == 0) used_[list / 64] &= ~(std::uint64_t{1} << (list % 64));
  --length_;
}

std::uint32_t ClassLists::first_used(std::uint32_t list) const {
  if (list >= kMostClasses) return kMostClasses;
  std::uint64_t bits = used_[list / 64] & (~std::uint64_t{0} << (list % 64));
  for (std::uint32_t w = list / 64;; bits = used_[w]) {
    if (bits != 0) return w * 64 + static_cast<std::uint32_t>(std::countr_zero(bits));
    if (++w == used_.size()) return kMostClasses;
  }
}

std::uint32_t two_level_class(std::uint32_t size) {
  constexpr std::uint32_t kSmall_bytes = 256;
  if (size < kSmall_bytes) return size / 8;
  const std::uint32_t log2 = static_cast<std::uint32_t>(std::bit_width(size)) - 1;
  return (log2 - 7) * 32 + ((size >> (log2 - 5)) & 31);
}

std::uint32_t newlib_bin(std::uint32_t size) {
  if (size < 512) return size >> 3;
  const std::uint32_t s = size >> 9;
  if (s <= 4) return 56 + (size >> 6);
  if (s <= 20) return 91 + (size >> 9);
  if (s <= 84) return 110 + (size >> 12);
  if (s <= 340) return 119 + (size >> 15);
  if (s <= 1364) return 124 + (size >> 18);
  return 126;
}

// ---- best fit

// The smallest of the list of at least `size`; 0: none, kBad: a link is broken.
HeapOffset BestFitLists::smallest_in(std::uint32_t list, std::uint32_t size,
                                     std::uint64_t& steps) const {
  HeapOffset best = 0;
  std::uint32_t best_bytes = UINT32_MAX;
  std::uint64_t left = lists_.length();
  for (HeapOffset block = lists_.front(list); block != 0; block = lists_.next(block)) {
    ++steps;
    if (!lists_.plausible(block) || left-- == 0) return HeapArea::kBad;
    const std::uint32_t found = lists_.area().header(block);
    if (found < size || found >= best_bytes) continue;
    best = block;
    best_bytes = found;
    if (found == size) break;
  }
  return best;
}

HeapOffset BestFitLists::find(std::uint32_t size, std::uint64_t& steps) {
  std::uint32_t list = two_level_class(size);
  const HeapOffset found = smallest_in(list, size, steps);
  if (found != 0) return found;
  list = lists_.first_used(list + 1);
  return list == ClassLists::kMostClasses ? 0 : smallest_in(list, size, steps);
}

void BestFitLists::replace(HeapOffset old, HeapOffset now, std::uint32_t size) {
  remove(old, lists_.area().size(old));
  insert(now, size);
}

std::uint32_t BestFitLists::largest() {
  std::uint32_t last = ClassLists::kMostClasses, best = 0;
  for (std::uint32_t list = lists_.first_used(0); list != ClassLists::kMostClasses;
       list = lists_.first_used(list + 1)) {
    last = list;
  }
  if (last == ClassLists::kMostClasses) return 0;
  std::uint64_t left = lists_.length();
  for (HeapOffset block = lists_.front(last); block != 0 && left-- > 0;
       block = lists_.next(block)) {
    if (!lists_.plausible(block)) break;
    best = std::max<std::uint32_t>(best, lists_.area().header(block));
  }
  return best;
}

HeapOffset BestFitLists::check(std::uint64_t blocks) const {
  return lists_.length() == blocks ? 0 : HeapArea::kBad;  // holds() was asked of every block
}

HeapOffset TlsfLists::find(std::uint32_t size, std::uint64_t& steps) {
  std::uint32_t rounded = size;
  if (size >= 256) rounded += (1u << (std::bit_width(size) - 6)) - 1;
  if (rounded < size) return 0;
  const std::uint32_t list = lists_.first_used(two_level_class(rounded));
  if (list == ClassLists::kMostClasses) return 0;
  ++steps;
  return lists_.plausible(lists_.front(list)) ? lists_.front(list) : HeapArea::kBad;
}

// ---- newlib

void NewlibBins::set_apart(HeapOffset& place, HeapOffset block) {
  place = block;
  bins_.area().word(block) = kMark;
  bins_.area().word(block + 4) = ~kMark;
}

bool NewlibBins::holds(HeapOffset block, std::uint32_t size) const {
  if (block != remainder_ && block != wilderness_) return bins_.linked(block, newlib_bin(size));
  return bins_.area().word(block) == kMark && bins_.area().word(block + 4) == ~kMark;
}

// Ascending by size. Of equal blocks the one freed first is taken first.
void NewlibBins::put_in_bin(HeapOffset block, std::uint32_t size) {
  const std::uint32_t bin = newlib_bin(size);
  HeapOffset after = 0;
  std::uint64_t left = bins_.length();
  if (size >= kSmall_bytes) {
    after = bins_.front(bin);
    while (after != 0 && left-- > 0 && bins_.plausible(after) &&
           bins_.area().header(after) <= size) {
      after = bins_.next(after);
    }
  }
  if (after != 0 && !bins_.plausible(after)) after = 0;
  bins_.insert_before(after, block, bin);
}

void NewlibBins::insert(HeapOffset block, std::uint32_t size, bool at_top) {
  const bool is_remainder = joined_remainder_;
  joined_remainder_ = false;
  if (at_top) {
    set_apart(wilderness_, block);
  } else if (is_remainder) {
    set_apart(remainder_, block);
  } else {
    put_in_bin(block, size);
  }
}

void NewlibBins::split(HeapOffset block, std::uint32_t found, HeapOffset rest, std::uint32_t,
                       bool at_top) {
  take(block, found);
  if (at_top) {
    set_apart(wilderness_, rest);
    return;
  }
  if (remainder_ != 0) put_in_bin(remainder_, bins_.area().header(remainder_));
  set_apart(remainder_, rest);
}

void NewlibBins::remove(HeapOffset block, std::uint32_t size) {
  joined_remainder_ = joined_remainder_ || block == remainder_;
  take(block, size);
}

void NewlibBins::take(HeapOffset block, std::uint32_t size) {
  if (block == remainder_) {
    remainder_ = 0;
  } else if (block == wilderness_) {
    wilderness_ = 0;
  } else {
    bins_.unlink(block, newlib_bin(size));
  }
}

void NewlibBins::replace(HeapOffset old, HeapOffset now, std::uint32_t size) {
  take(old, bins_.area().size(old));
  insert(now, size, false);
}

// A block of the request's own bin that needs no split, or the first of the next small one.
HeapOffset NewlibBins::find_in_own_bin(std::uint32_t size, std::uint32_t& next_bin,
                                       std::uint64_t& steps) {
  const std::uint32_t bin = newlib_bin(size);
  if (size < kSmall_bytes) {
    next_bin = bin + 2;
    for (const std::uint32_t b : {bin, bin + 1}) {
      if (bins_.front(b) == 0) continue;
      ++steps;
      return bins_.front(b);
    }
    return 0;
  }
  next_bin = bin + 1;
  std::uint64_t left = bins_.length();
  for (HeapOffset block = bins_.front(bin); block != 0; block = bins_.next(block)) {
    ++steps;
    if (!bins_.plausible(block) || left-- == 0) return HeapArea::kBad;
    const std::uint32_t found = bins_.area().header(block);
    if (found < size) continue;
    if (found - size < kLeast_bytes) return block;
    next_bin = bin;  // too large for now, but of this bin
    return 0;
  }
  return 0;
}

// The remainder of the last split, if it is large enough; else it goes to its bin.
HeapOffset NewlibBins::use_remainder(std::uint32_t size, std::uint64_t& steps) {
  if (remainder_ == 0) return 0;
  ++steps;
  if (!bins_.plausible(remainder_)) return HeapArea::kBad;
  const std::uint32_t found = bins_.area().header(remainder_);
  if (found >= size) return remainder_;
  const HeapOffset block = remainder_;
  remainder_ = 0;
  put_in_bin(block, found);
  return 0;
}

HeapOffset NewlibBins::find(std::uint32_t size, std::uint64_t& steps) {
  std::uint32_t bin = 0;
  if (const HeapOffset found = find_in_own_bin(size, bin, steps); found != 0) return found;
  if (const HeapOffset found = use_remainder(size, steps); found != 0) return found;
  for (bin = bins_.first_used(bin); bin != ClassLists::kMostClasses;
       bin = bins_.first_used(bin + 1)) {
    std::uint64_t left = bins_.length();
    for (HeapOffset block = bins_.front(bin); block != 0; block = bins_.next(block)) {
      ++steps;
      if (!bins_.plausible(block) || left-- == 0) return HeapArea::kBad;
      if (bins_.area().header(block) >= size) return block;
    }
  }
  if (wilderness_ == 0) return 0;
  ++steps;
  if (!bins_.plausible(wilderness_)) return HeapArea::kBad;
  return bins_.area().header(wilderness_) >= size ? wilderness_ : 0;
}

std::uint32_t NewlibBins::largest() {
  std::uint32_t best = 0;
  for (const HeapOffset apart : {remainder_, wilderness_}) {
    if (apart != 0) best = std::max<std::uint32_t>(best, bins_.area().size(apart));
  }
  std::uint32_t last = ClassLists::kMostClasses;
  for (std::uint32_t b = bins_.first_used(0); b != ClassLists::kMostClasses;
       b = bins_.first_used(b + 1)) {
    last = b;
  }
  if (last == ClassLists::kMostClasses || !bins_.area().within(bins_.back(last))) return best;
  return std::max<std::uint32_t>(best, bins_.area().size(bins_.back(last)));
}

HeapOffset NewlibBins::check(std::uint64_t blocks) const {
  return length() == blocks ? 0 : HeapArea::kBad;  // holds() was asked of every block
}

}  // namespace orrery::internal
