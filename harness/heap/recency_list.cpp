#include <orrery/harness/heap/recency_list.hpp>

#include <algorithm>

namespace orrery::internal {

std::uint32_t RecencyList::last_bucket(std::uint32_t g) const {
  return std::min(g * 64 + 63, (end_ - 1) / 64);
}

std::uint32_t RecencyList::live_in_group(std::uint32_t g) const {
  std::uint32_t live = 0;
  for (std::uint32_t b = g * 64; b < g * 64 + 64; ++b) live += live_[b];
  return live;
}

RecencyList::Slot RecencyList::search(std::uint32_t size, std::uint64_t& steps) {
  for (std::uint32_t g = (end_ - 1) / 4096 + 1; g-- > 0;) {
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
  for (std::uint32_t b = last_bucket(g) + 1; b-- > g * 64;) {
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
  for (Slot slot = std::min(b * 64 + 64, end_), first = std::max(b * 64, kFirst); slot-- > first;) {
    const std::uint64_t e = entries_[slot];
    steps += e != 0 ? 1 : 0;
    if (e >= wanted) return slot;
    most = std::max(most, e);
  }
  bounds_[b] = static_cast<std::uint32_t>(most >> 32);
  return 0;
}

std::uint32_t RecencyList::bound_of_bucket(std::uint32_t b) const {
  std::uint32_t bound = 0;
  for (Slot slot = b * 64; slot < std::min(b * 64 + 64, end_); ++slot) {
    bound = std::max(bound, size_of(slot));
  }
  return bound;
}

std::uint32_t RecencyList::largest() {
  std::uint32_t best = 0;
  for (std::uint32_t g = (end_ - 1) / 4096 + 1; g-- > 0;) {
    if (group_bounds_[g] <= best) continue;
    std::uint32_t group_bound = 0;
    for (std::uint32_t b = last_bucket(g) + 1; b-- > g * 64;) {
      if (bounds_[b] > best) {
        bounds_[b] = bound_of_bucket(b);
        best = std::max(best, bounds_[b]);
      }
      group_bound = std::max(group_bound, bounds_[b]);
    }
    group_bounds_[g] = group_bound;
  }
  return best;
}

void RecencyList::grow() {
  entries_.grow(std::max<std::size_t>(2 * entries_.size(), 1));
  capacity_ = static_cast<Slot>(entries_.size());
  const std::size_t groups = (capacity_ + 4095) / 4096;
  live_.grow(groups * 64);
  bounds_.grow(groups * 64);
  group_bounds_.grow(groups);
}

// More slots if most are in use; then what is left moves together, in order.
void RecencyList::make_room() {
  if (length_ * 2 >= capacity_) grow();
  const Slot old_end = end_;
  for (std::uint32_t b = 0; b * 64 < old_end; ++b) {
    live_[b] = 0;
    bounds_[b] = group_bounds_[b / 64] = 0;
  }
  end_ = kFirst;
  length_ = 0;
  for (Slot slot = kFirst; slot < old_end; ++slot) {
    const std::uint64_t e = entries_[slot];
    entries_[slot] = 0;
    if (e == 0) continue;
    const HeapOffset block = static_cast<HeapOffset>(e);
    area_.link(block) = push(block, static_cast<std::uint32_t>(e >> 32));
  }
}

HeapOffset RecencyList::check(std::uint64_t blocks) const {
  std::uint64_t counted = 0;
  for (Slot slot = kFirst; slot < end_; ++slot) {
    if (entries_[slot] == 0) continue;
    ++counted;
    const HeapOffset block = block_of(slot);
    const std::uint32_t size = size_of(slot);
    if (!area_.within(block) || area_.header(block) != size || !holds(block, size) ||
        size > bounds_[slot / 64] || size > group_bounds_[slot / 4096]) {
      return block;
    }
  }
  return counted == blocks && counted == length_ ? 0 : HeapArea::kBad;
}

}  // namespace orrery::internal
