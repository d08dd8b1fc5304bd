#include <orrery/harness/heap/recency_list.hpp>

#include <algorithm>

namespace orrery::internal {

std::uint32_t RecencyList::last_bucket(std::uint32_t g) const {
  return std::min(g * 64 + 63, (end_ - 1) / 64);
}

HeapOffset RecencyList::search(std::uint32_t size, std::uint64_t& steps) {
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

HeapOffset RecencyList::find_in_group(std::uint32_t g, std::uint32_t size, std::uint64_t& steps) {
  std::uint32_t group_bound = 0;
  const std::uint32_t first = g * 64;
  for (std::uint32_t b = last_bucket(g) + 1; b-- > first;) {
    Bucket& bucket = buckets_[b];
    if (bucket.bound >= size) {
      std::uint32_t bound = 0;
      for (std::uint64_t left = bucket.live; left != 0;) {
        const int i = 63 - std::countl_zero(left);
        ++steps;
        if (bucket.size[i] >= size) return bucket.block[i];
        bound = std::max(bound, bucket.size[i]);
        left &= ~(std::uint64_t{1} << i);
      }
      bucket.bound = bound;
    } else {
      steps += static_cast<std::uint64_t>(std::popcount(bucket.live));
    }
    group_bound = std::max(group_bound, bucket.bound);
  }
  groups_[g].bound = group_bound;
  return 0;
}

std::uint32_t RecencyList::largest() {
  std::uint32_t best = 0;
  if (end_ == 0) return best;
  for (std::uint32_t g = (end_ - 1) / 4096 + 1; g-- > 0;) {
    if (groups_[g].bound <= best) continue;
    std::uint32_t group_bound = 0;
    for (std::uint32_t b = last_bucket(g) + 1; b-- > g * 64;) {
      Bucket& bucket = buckets_[b];
      if (bucket.bound > best) {
        bucket.bound = 0;
        for (std::uint64_t left = bucket.live; left != 0; left &= left - 1) {
          bucket.bound = std::max(bucket.bound, bucket.size[std::countr_zero(left)]);
        }
        best = std::max(best, bucket.bound);
      }
      group_bound = std::max(group_bound, bucket.bound);
    }
    groups_[g].bound = group_bound;
  }
  return best;
}

// More slots if most are in use; then what is left moves together, in order.
void RecencyList::make_room() {
  if (length_ * 2 >= capacity_) {
    buckets_.grow(std::max<std::size_t>(2 * buckets_.size(), 1));
    groups_.grow((buckets_.size() + 63) / 64);
    capacity_ = static_cast<std::uint32_t>(buckets_.size() * 64);
  }
  const std::uint32_t old_end = end_;
  end_ = 0;
  for (std::uint32_t g = 0; g * 4096 < old_end; ++g) groups_[g] = {};
  for (std::uint32_t b = 0; b * 64 < old_end; ++b) {
    const Bucket old = buckets_[b];  // a copy: its place is filled anew
    buckets_[b].live = 0;
    buckets_[b].bound = 0;
    for (std::uint64_t left = old.live; left != 0; left &= left - 1) {
      const int i = std::countr_zero(left);
      put(end_++, old.block[i], old.size[i]);
    }
  }
}

HeapOffset RecencyList::check(std::uint64_t blocks) const {
  std::uint64_t counted = 0;
  for (std::uint32_t b = 0; b * 64 < end_; ++b) {
    const Bucket& bucket = buckets_[b];
    for (std::uint64_t left = bucket.live; left != 0; left &= left - 1, ++counted) {
      const int i = std::countr_zero(left);
      const HeapOffset block = bucket.block[i];
      if (!area_.within(block) || area_.header(block) != bucket.size[i] ||
          !holds(block, bucket.size[i]) || bucket.size[i] > bucket.bound) {
        return block;
      }
    }
  }
  return counted == blocks && counted == length_ ? 0 : HeapArea::kBad;
}

}  // namespace orrery::internal
