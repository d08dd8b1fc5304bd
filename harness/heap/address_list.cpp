#include <orrery/harness/heap/address_list.hpp>

#include <algorithm>
#include <bit>

namespace orrery::internal {
namespace {

std::uint64_t from_bit(std::uint32_t bit) {
  return ~std::uint64_t{0} << bit;
}

}  // namespace

void AddressList::insert(HeapOffset block, std::uint32_t size, bool) {
  const std::uint32_t unit = block / area_.align;
  const std::uint32_t b = unit / 64;
  if (b >= buckets_.size()) {
    buckets_.grow(std::max<std::size_t>(b + 1, 2 * buckets_.size()));
    groups_.grow(buckets_.size() / 64 + 1);
  }
  end_ = std::max(end_, b + 1);
  Bucket& bucket = buckets_[b];
  bucket.starts |= std::uint64_t{1} << (unit % 64);
  bucket.bound = std::max(bucket.bound, size);
  Group& group = groups_[b / 64];
  group.bound = std::max(group.bound, size);
  ++group.live;
  ++length_;
  area_.word(block) = kMark;
  area_.word(block + 4) = ~kMark;
}

void AddressList::remove(HeapOffset block, std::uint32_t) {
  const std::uint32_t unit = block / area_.align;
  Bucket& bucket = buckets_[unit / 64];
  bucket.starts &= ~(std::uint64_t{1} << (unit % 64));
  if (bucket.starts == 0) bucket.bound = 0;
  --groups_[unit / 4096].live;
  --length_;
}

HeapOffset AddressList::find(std::uint32_t size, std::uint64_t& steps) {
  if (!roves_) return find_between(0, end_ * 64, size, steps);
  HeapOffset found = find_between(rover_, end_ * 64, size, steps);
  if (found == 0) found = find_between(0, rover_, size, steps);
  // The search goes on behind the block, in what was split off it.
  if (found != 0) rover_ = (found + size) / area_.align;
  return found;
}

// The first free block of at least `size` that begins in [begin, end), both units.
HeapOffset AddressList::find_between(std::uint32_t begin, std::uint32_t end, std::uint32_t size,
                                     std::uint64_t& steps) {
  for (std::uint32_t b = begin / 64; b < end_ && b * 64 < end;) {
    Group& group = groups_[b / 64];
    const bool whole_group = b % 64 == 0 && begin <= b * 64 && (b + 64) * 64 <= end;
    if (whole_group && group.bound < size) {
      steps += group.live;
      b += 64;
      continue;
    }
    std::uint32_t group_bound = 0;
    const std::uint32_t group_end = std::min(b / 64 * 64 + 64, end_);
    for (; b < group_end && b * 64 < end; ++b) {
      std::uint64_t mask = ~std::uint64_t{0};
      if (b * 64 < begin) mask &= from_bit(begin % 64);
      if (end - b * 64 < 64) mask &= ~from_bit(end % 64);
      const HeapOffset found = find_in_bucket(b, mask, size, steps);
      if (found != 0) return found;
      group_bound = std::max(group_bound, buckets_[b].bound);
    }
    if (whole_group) group.bound = group_bound;
  }
  return 0;
}

HeapOffset AddressList::find_in_bucket(std::uint32_t b, std::uint64_t mask, std::uint32_t size,
                                       std::uint64_t& steps) {
  Bucket& bucket = buckets_[b];
  if (bucket.bound < size) {
    steps += static_cast<std::uint64_t>(std::popcount(bucket.starts & mask));
    return 0;
  }
  std::uint32_t bound = 0;
  for (std::uint64_t left = bucket.starts & mask; left != 0; left &= left - 1) {
    const HeapOffset block =
        (b * 64 + static_cast<std::uint32_t>(std::countr_zero(left))) * area_.align;
    ++steps;
    const std::uint32_t found = area_.header(block);
    if (found >= size) return block;
    bound = std::max(bound, found);
  }
  if (mask == ~std::uint64_t{0}) bucket.bound = bound;
  return 0;
}

std::uint32_t AddressList::largest() {
  std::uint32_t best = 0;
  for (std::uint32_t g = 0; g * 64 < end_; ++g) {
    if (groups_[g].bound <= best) continue;
    std::uint32_t group_bound = 0;
    for (std::uint32_t b = g * 64; b < std::min(g * 64 + 64, end_); ++b) {
      Bucket& bucket = buckets_[b];
      if (bucket.bound > best) {
        bucket.bound = 0;
        for (std::uint64_t left = bucket.starts; left != 0; left &= left - 1) {
          const std::uint32_t unit = b * 64 + static_cast<std::uint32_t>(std::countr_zero(left));
          bucket.bound = std::max<std::uint32_t>(bucket.bound, area_.header(unit * area_.align));
        }
        best = std::max(best, bucket.bound);
      }
      group_bound = std::max(group_bound, bucket.bound);
    }
    groups_[g].bound = group_bound;
  }
  return best;
}

HeapOffset AddressList::check(std::uint64_t blocks) const {
  std::uint64_t counted = 0;
  for (std::uint32_t b = 0; b < end_; ++b) {
    const Bucket& bucket = buckets_[b];
    for (std::uint64_t left = bucket.starts; left != 0; left &= left - 1, ++counted) {
      const HeapOffset block =
          (b * 64 + static_cast<std::uint32_t>(std::countr_zero(left))) * area_.align;
      const std::uint32_t found = area_.header(block);
      if (!area_.within(block) || (found & HeapArea::kLive) != 0 || found > bucket.bound) {
        return block;
      }
    }
  }
  return counted == blocks && counted == length_ ? 0 : HeapArea::kBad;
}

}  // namespace orrery::internal
