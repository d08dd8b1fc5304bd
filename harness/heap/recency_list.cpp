#include <orrery/harness/heap/recency_list.hpp>

#include <algorithm>

namespace orrery::internal {

std::uint32_t RecencyList::end_bucket(std::uint32_t g) const {
  return std::min(g * 64 + 64, hot_ / 64);
}

std::uint32_t RecencyList::live_in_group(std::uint32_t g) const {
  std::uint32_t live = 0;
  for (std::uint32_t b = g * 64; b < g * 64 + 64; ++b) live += live_[b];
  return live;
}

RecencyList::Slot RecencyList::search(std::uint32_t size, std::uint64_t& steps) {
  for (std::uint32_t g = (hot_ + 4095) / 4096; g-- > 0;) {
    if (group_bounds_[g] < size) {
      steps += live_in_group(g);
      continue;
    }
    const Slot found = find_in_group(g, size, steps);
    if (found != 0) return found;
  }
  return 0;
}

RecencyList::Slot RecencyList::find_in_group(std::uint32_t g, std::uint32_t size,
                                             std::uint64_t& steps) {
  std::uint32_t group_bound = 0;
  for (std::uint32_t b = end_bucket(g); b-- > g * 64;) {
    if (bounds_[b] < size) {
      steps += live_[b];
    } else if (const Slot found = find_in_bucket(b, size, steps); found != 0) {
      return found;
    }
    group_bound = std::max(group_bound, bounds_[b]);
  }
  group_bounds_[g] = group_bound;
  return 0;
}

RecencyList::Slot RecencyList::find_in_bucket(std::uint32_t b, std::uint32_t size,
                                              std::uint64_t& steps) {
  const std::uint64_t wanted = entry(0, size);
  std::uint64_t most = 0;
  for (Slot slot = b * 64 + 64, first = std::max(b * 64, kFirst); slot-- > first;) {
    const std::uint64_t e = entries_[slot];
    steps += e != 0 ? 1 : 0;
    if (e >= wanted) return slot;
    most = std::max(most, e);
  }
  bounds_[b] = static_cast<std::uint32_t>(most >> 32);
  return 0;
}

std::uint32_t RecencyList::largest_between(Slot first, Slot end) const {
  std::uint64_t most = 0;
  for (Slot slot = first; slot < end; ++slot) most = std::max(most, entries_[slot]);
  return static_cast<std::uint32_t>(most >> 32);
}

std::uint32_t RecencyList::largest() {
  std::uint32_t best = largest_between(hot_, end_);
  for (std::uint32_t g = (hot_ + 4095) / 4096; g-- > 0;) {
    if (group_bounds_[g] <= best) continue;
    std::uint32_t group_bound = 0;
    for (std::uint32_t b = end_bucket(g); b-- > g * 64;) {
      if (bounds_[b] > best) {
        bounds_[b] = largest_between(b * 64, b * 64 + 64);
        best = std::max(best, bounds_[b]);
      }
      group_bound = std::max(group_bound, bounds_[b]);
    }
    group_bounds_[g] = group_bound;
  }
  return best;
}

// All hot slots are gone: the bucket in which the front is now is hot again.
void RecencyList::reheat() {
  hot_ = (end_ - 1) / 64 * 64;
  live_[hot_ / 64] = 0;  // there is nothing in those that lay between
  limit_ = std::min(static_cast<Slot>(entries_.size()), hot_ + kMostHot);
}

void RecencyList::index_bucket(std::uint32_t b) {
  std::uint8_t live = 0;
  for (Slot slot = std::max(b * 64, kFirst); slot < b * 64 + 64; ++slot) {
    live = static_cast<std::uint8_t>(live + (entries_[slot] != 0 ? 1 : 0));
  }
  live_[b] = live;
  bounds_[b] = largest_between(b * 64, b * 64 + 64);
  if (b % 64 == 0) group_bounds_[b / 64] = 0;
  group_bounds_[b / 64] = std::max(group_bounds_[b / 64], bounds_[b]);
}

void RecencyList::grow() {
  entries_.grow(std::max<std::size_t>(2 * entries_.size(), 1));
  const std::size_t groups = (entries_.size() + 4095) / 4096;
  live_.grow(groups * 64);
  bounds_.grow(groups * 64);
  group_bounds_.grow(groups);
}

// Where most hot slots are empty, their blocks move together; else, where most of all are empty,
// all blocks do. Then the hindmost hot ones are indexed, so that there is room for more.
void RecencyList::make_room() {
  const Slot capacity = static_cast<Slot>(entries_.size());
  std::uint64_t hot_blocks = length_;
  for (std::uint32_t b = 0; b < hot_ / 64; ++b) hot_blocks -= live_[b];
  if (hot_blocks * 2 < end_ - hot_) {
    move_together(hot_);
  } else if (end_ == capacity) {
    if (length_ * 2 < capacity) {
      for (std::uint32_t b = 0; b < hot_ / 64; ++b) live_[b] = 0;
      hot_ = 0;
      move_together(0);
    } else {
      grow();
    }
  }
  for (; end_ - hot_ > kMostHot / 2; hot_ += 64) index_bucket(hot_ / 64);
  limit_ = std::min(static_cast<Slot>(entries_.size()), hot_ + kMostHot);
}

// Those from `first` on close up, in order.
void RecencyList::move_together(Slot first) {
  const Slot old_end = end_;
  const Slot begin = std::max(first, kFirst);
  end_ = begin;
  for (Slot slot = begin; slot < old_end; ++slot) {  // without a branch that nobody could foresee
    const std::uint64_t e = entries_[slot];
    entries_[end_] = e;
    end_ += e != 0 ? 1 : 0;
  }
  for (Slot slot = end_; slot < old_end; ++slot) entries_[slot] = 0;
  for (Slot slot = begin; slot < end_; ++slot) area_.link(block_of(slot)) = mark(slot);
}

HeapOffset RecencyList::check(std::uint64_t blocks) const {
  std::uint64_t counted = 0;
  for (Slot slot = kFirst; slot < end_; ++slot) {
    if (entries_[slot] == 0) continue;
    ++counted;
    const HeapOffset block = block_of(slot);
    const std::uint32_t size = size_of(slot);
    if (!area_.within(block) || area_.header(block) != size || !holds(block, size) ||
        (slot < hot_ && (size > bounds_[slot / 64] || size > group_bounds_[slot / 4096]))) {
      return block;
    }
  }
  return counted == blocks && counted == length_ ? 0 : HeapArea::kBad;
}

}  // namespace orrery::internal
