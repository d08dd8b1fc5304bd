/// BlockHeap over a list of free blocks of the policy's own. For the policies' sources only.
#pragma once

#include <orrery/harness/heap/block_heap.hpp>

#include <cerrno>
#include <cstring>

namespace orrery::internal {

inline bool is_power_of_two(std::size_t n) {
  return n != 0 && (n & (n - 1)) == 0;
}

/// Where policies differ beyond the choice of a block.
struct BlockRules {
  std::uint32_t least_bytes = 16;  // of a block
  std::uint32_t least_rest = 16;   // of a split; what is smaller stays with the block
  bool rest_keeps_place = false, growth_joins = false, realloc_in_place = true,
       realloc_grows_top = false;
};

/// List has: holds, insert, remove, take, split, replace, find, largest, length,
/// check (see RecencyList), and `static constexpr bool kScatters`.
template <class List>
class TaggedHeap : public BlockHeap {
 public:
  TaggedHeap(void* arena, const HeapOptions& options, const BlockRules& rules)
      : BlockHeap(arena, options, rules.least_bytes),
        list_(area_, options_.rules),
        rules_(rules),
        poison_(options.rules.poison) {}

  // Flattened, like release: these two are what flight software waits for.
  [[gnu::flatten]] void* allocate(std::size_t bytes) noexcept override {
    const Offset block = take(block_size(bytes), "malloc");
    if (block == 0) return nullptr;
    count_allocation(block);
    return pointer(block);
  }

  void* allocate_zeroed(std::size_t count, std::size_t bytes) noexcept override {
    std::size_t total = 0;
    if (__builtin_mul_overflow(count, bytes, &total)) total = SIZE_MAX;  // above any limit
    const Offset block = take(block_size(total), "calloc");
    if (block == 0) return nullptr;
    count_allocation(block);
    return std::memset(pointer(block), 0, total);
  }

  void* allocate_aligned(std::size_t alignment, std::size_t bytes) noexcept override;
  void* reallocate(void* payload, std::size_t bytes) noexcept override;
  void release(void* payload) noexcept override;
  std::uint64_t largest_free_bytes() const override { return list_.largest(); }
  std::uint64_t free_list_length() const override { return list_.length(); }
  bool check() override;

 protected:
  mutable List list_;  // looking for the largest block tightens its bounds

 private:
  // Of the bytes from a free block's start, what belongs to the list.
  static constexpr std::uint32_t kLink_bytes = 8;
  static constexpr int kPoison = 0xDD;

  Offset take(std::uint64_t size, const char* during);
  Offset take_free(std::uint32_t size, const char* during);
  Offset scatter(Offset block, std::uint32_t found, std::uint32_t size);
  bool grow_to_scatter(std::uint64_t size);
  Offset grow(std::uint64_t size, const char* during);
  Offset exhausted(std::uint64_t size, const char* during);
  Offset grow_in_place(Offset payload, std::uint32_t size, std::uint64_t wanted);
  void trim(Offset payload, std::uint32_t wanted);
  bool push_joined(Offset payload, std::uint32_t size);
  void insert(Offset payload, std::uint32_t size) {
    area_.tag(payload, size, 0);
    list_.insert(payload, size, payload + size == area_.top);
  }
  bool sound_free(Offset payload, std::uint32_t tag) const {
    return area_.sound(payload, tag) && list_.holds(payload, tag);
  }
  // True if a sound free block of `size` ends where the block of `payload` begins.
  bool leads(Offset payload, std::uint32_t size) const {
    return size >= kLeastBlock_bytes && size <= payload - area_.first &&
           area_.within(payload - size) && area_.header(payload - size) == size &&
           list_.holds(payload - size, size);
  }
  bool corrupt(Offset payload, const char* during) const {
    fail(HeapFault::Kind::kCorruptBlock, pointer(payload), during);
    return false;
  }
  bool check_blocks(std::uint64_t& free_blocks);

  void poison_joined(Offset payload, std::uint32_t size, bool join_after,
                     std::uint32_t leader) const;
  void poison(Offset from, std::uint32_t bytes) const {
    std::memset(pointer(from), kPoison, bytes);
  }
  bool poison_holds(Offset payload, std::uint32_t size, const char* during) const;

  BlockRules rules_;
  bool poison_;
};

// ---- requests

template <class List>
void* TaggedHeap<List>::allocate_aligned(std::size_t alignment, std::size_t bytes) noexcept {
  if (!is_power_of_two(alignment)) return nullptr;
  const std::size_t natural = area_.align;
  if (alignment <= natural) return allocate(bytes);
  const std::uint64_t wanted = block_size(bytes);
  // What lies before the aligned payload becomes a free block, so it is nothing or a least block.
  const bool too_large = alignment > kMaxLimit_bytes || wanted > kMaxLimit_bytes;
  Offset block = take(too_large ? UINT64_MAX : wanted + alignment + (least_ - natural), "memalign");
  if (block == 0) return nullptr;

  const std::uint32_t size = area_.size(block);
  const std::uintptr_t address = reinterpret_cast<std::uintptr_t>(pointer(block));
  std::uint32_t gap = static_cast<std::uint32_t>(-address & (alignment - 1));
  while (gap != 0 && gap < least_) gap += static_cast<std::uint32_t>(alignment);
  if (gap != 0) {
    area_.tag(block + gap, size - gap, kLive);
    if (!push_joined(block, gap)) return nullptr;
    block += gap;
  }
  trim(block, static_cast<std::uint32_t>(wanted));
  count_allocation(block);
  return pointer(block);
}

template <class List>
void* TaggedHeap<List>::reallocate(void* payload, std::size_t bytes) noexcept {
  if (payload == nullptr) return allocate(bytes);
  if (bytes == 0 && !options_.rules.realloc_to_zero_keeps) {
    release(payload);
    return nullptr;
  }
  const Offset block = live_block(payload, "realloc");
  if (block == 0) return nullptr;
  const std::uint32_t size = area_.size(block);
  const std::uint64_t wanted = block_size(bytes);
  Offset kept = 0;
  if (rules_.realloc_in_place) {
    kept = wanted <= size ? (trim(block, static_cast<std::uint32_t>(wanted)), block)
                          : grow_in_place(block, size, wanted);
  }
  if (kept == internal::HeapArea::kBad) return nullptr;
  if (kept != 0) {
    live_bytes_ -= size;
    add_live(area_.size(block));
    return payload;
  }
  const Offset moved = take(wanted, "realloc");
  if (moved == 0) return nullptr;
  count_allocation(moved);
  std::memcpy(pointer(moved), payload,
              std::min<std::size_t>(size, static_cast<std::size_t>(wanted)) - kTags_bytes);
  release(payload);
  return pointer(moved);
}

template <class List>
[[gnu::flatten]] void TaggedHeap<List>::release(void* payload) noexcept {
  if (payload == nullptr) return;
  const Offset block = live_block(payload, "free");
  if (block == 0) return;
  const std::uint32_t size = area_.size(block);
  if (!push_joined(block, size)) return;
  live_bytes_ -= size;
  ++frees_;
}

// ---- blocks

// A live block of at least `size`; 0 past the limit or where the heap is corrupt.
template <class List>
HeapOffset TaggedHeap<List>::take(std::uint64_t size, const char* during) {
  if constexpr (List::kScatters) {
    if (size > kMaxLimit_bytes || live_bytes_ + size > options_.limit_bytes ||
        !grow_to_scatter(size)) {
      return exhausted(size, during);
    }
  }
  if (size <= kMaxLimit_bytes) {
    const Offset block = take_free(static_cast<std::uint32_t>(size), during);
    if (block != 0) return block == HeapArea::kBad ? 0 : block;
  }
  return List::kScatters ? exhausted(size, during) : grow(size, during);
}

template <class List>
HeapOffset TaggedHeap<List>::take_free(std::uint32_t size, const char* during) {
  const Offset block = list_.find(size, search_steps_);
  if (block <= HeapArea::kBad) return block;
  const std::uint32_t found = area_.header(block);
  if (found < size || (found & kLive) != 0 || !sound_free(block, found)) {
    corrupt(block, during);
    return HeapArea::kBad;
  }
  if (poison_ && !poison_holds(block, found, during)) return HeapArea::kBad;
  if constexpr (List::kScatters) return scatter(block, found, size);
  const std::uint32_t rest = found - size;
  if (rest < rules_.least_rest) {
    list_.take(block, found);
    area_.tag(block, found, kLive);
  } else if (rules_.rest_keeps_place) {
    list_.replace(block, block + size, rest);
    area_.tag(block + size, rest, 0);
    area_.tag(block, size, kLive);
  } else {
    const HeapArea area = area_;  // a copy, which stores to the arena cannot change
    list_.split(block, found, block + size, rest, block + found == area.top);
    area.tag(block, size, kLive);
    area.tag(block + size, rest, 0);
  }
  return block;
}

// Somewhere within the free block, chosen by the list; what is left on both sides is free.
template <class List>
HeapOffset TaggedHeap<List>::scatter(Offset block, std::uint32_t found, std::uint32_t size) {
  list_.take(block, found);
  std::uint32_t gap = list_.gap(found - size);
  if (gap < least_) gap = 0;
  const std::uint32_t rest = found - size - gap;
  const std::uint32_t kept = rest < rules_.least_rest ? size + rest : size;
  if (gap != 0) insert(block, gap);
  if (kept == size && rest != 0) insert(block + gap + size, rest);
  area_.tag(block + gap, kept, kLive);
  return block + gap;
}

// The area to choose from is four times what is live, and some more.
template <class List>
bool TaggedHeap<List>::grow_to_scatter(std::uint64_t size) {
  const std::uint64_t most = arena_bytes(options_) - 64;
  const std::uint64_t wanted = std::min(
      most & ~std::uint64_t{15}, (4 * (live_bytes_ + size) + (1u << 16)) & ~std::uint64_t{15});
  if (wanted <= heap_bytes()) return true;
  // By an eighth at least: an area that grows with every request would be filled from the top.
  const std::uint64_t growth =
      std::min((most & ~std::uint64_t{15}) - heap_bytes(),
               std::max(wanted - heap_bytes(), heap_bytes() / 8 & ~std::uint64_t{15}));
  const Offset block = area_.top;
  area_.top += static_cast<Offset>(growth);
  area_.header(area_.top) = kLive;
  area_.tag(block, static_cast<std::uint32_t>(growth), 0);
  return push_joined(block, static_cast<std::uint32_t>(growth));
}

template <class List>
HeapOffset TaggedHeap<List>::exhausted(std::uint64_t size, const char* during) {
  ++failures_;
  errno = ENOMEM;
  fail(HeapFault::Kind::kExhausted, nullptr, during, size);
  return 0;
}

template <class List>
HeapOffset TaggedHeap<List>::grow(std::uint64_t size, const char* during) {
  const std::uint32_t last = area_.word(area_.top - 8);
  // Smaller than the request, unless the policy overlooked it: then it stays as it is.
  const bool join = rules_.growth_joins && (last & kLive) == 0 && last < size;
  const std::uint64_t growth = join ? size - last : size;
  if (size > kMaxLimit_bytes || heap_bytes() + growth > options_.limit_bytes) {
    return exhausted(size, during);
  }
  Offset block = area_.top;
  if (join) {
    if (!leads(area_.top, last)) {
      corrupt(area_.top, during);
      return 0;
    }
    block -= last;
    if (poison_ && !poison_holds(block, last, during)) return 0;
    list_.take(block, last);
  }
  area_.top += static_cast<Offset>(growth);
  area_.tag(block, static_cast<std::uint32_t>(size), kLive);
  area_.header(area_.top) = kLive;
  return block;
}

// Makes the block `wanted` large without moving it, if what follows it allows that: the block, 0 if
// not, kBad where the heap is corrupt.
template <class List>
HeapOffset TaggedHeap<List>::grow_in_place(Offset payload, std::uint32_t size,
                                           std::uint64_t wanted) {
  const Offset after = payload + size;
  const std::uint32_t follower = area_.header(after);
  if ((follower & kLive) == 0) {
    if (!sound_free(after, follower)) {
      corrupt(after, "realloc");
      return HeapArea::kBad;
    }
    if (size + std::uint64_t{follower} < wanted) return 0;
    if (poison_ && !poison_holds(after, follower, "realloc")) return HeapArea::kBad;
    list_.take(after, follower);
    area_.tag(payload, size + follower, kLive);
    trim(payload, static_cast<std::uint32_t>(wanted));
    return payload;
  }
  const std::uint64_t growth = wanted - size;
  if (!rules_.realloc_grows_top || after != area_.top || wanted > kMaxLimit_bytes ||
      heap_bytes() + growth > options_.limit_bytes) {
    return 0;
  }
  area_.top += static_cast<Offset>(growth);
  area_.tag(payload, static_cast<std::uint32_t>(wanted), kLive);
  area_.header(area_.top) = kLive;
  return payload;
}

// Cuts a live block down to `wanted` if what remains makes a block.
template <class List>
void TaggedHeap<List>::trim(Offset payload, std::uint32_t wanted) {
  const std::uint32_t size = area_.size(payload);
  if (size - wanted < rules_.least_rest) return;
  area_.tag(payload, wanted, kLive);
  push_joined(payload + wanted, size - wanted);
}

// Joins the block with its free neighbours and puts the result on the list. False: a neighbour was
// corrupt, and nothing was done.
template <class List>
bool TaggedHeap<List>::push_joined(Offset payload, std::uint32_t size) {
  const Offset after = payload + size;
  const std::uint32_t follower = area_.header(after);
  const std::uint32_t leader = area_.word(payload - 8);
  const bool join_after = (follower & kLive) == 0;
  const bool join_before = (leader & kLive) == 0;
  if (join_after && !sound_free(after, follower)) return corrupt(after, "free");
  if (join_before && !leads(payload, leader)) return corrupt(payload, "free");
  // Within a joined block the old header must not pass for a live block's.
  if (join_before) area_.header(payload) = 0;
  if (poison_) poison_joined(payload, size, join_after, join_before ? leader : 0);
  if (join_after) {
    list_.remove(after, follower);
    if (poison_) poison(after, kLink_bytes);
    size += follower;
  }
  if (join_before) {
    payload -= leader;
    list_.remove(payload, leader);
    size += leader;
  }
  insert(payload, size);
  return true;
}

// What will be the inside of a free block: the new one, and tags between it and its neighbours. The
// links of the one behind it follow when it has left the list.
template <class List>
void TaggedHeap<List>::poison_joined(Offset payload, std::uint32_t size, bool join_after,
                                     std::uint32_t leader) const {
  poison(payload + kLink_bytes, size - kTags_bytes - kLink_bytes);
  if (join_after) poison(payload + size - kTags_bytes, kTags_bytes);
  if (leader != 0) poison(payload - kTags_bytes, kTags_bytes + kLink_bytes);
}

// ---- checks

template <class List>
bool TaggedHeap<List>::poison_holds(Offset payload, std::uint32_t size, const char* during) const {
  const std::byte* begin = area_.at(payload);
  for (std::uint32_t i = kLink_bytes; i + kTags_bytes < size; ++i) {
    if (begin[i] == std::byte{kPoison}) continue;
    fail(HeapFault::Kind::kWriteAfterFree, begin + i, during);
    return false;
  }
  return true;
}

template <class List>
bool TaggedHeap<List>::check() {
  std::uint64_t free_blocks = 0;
  if (!check_blocks(free_blocks)) return false;
  const Offset bad = list_.check(free_blocks);
  if (bad == 0) return true;
  fail(HeapFault::Kind::kCorruptBlock, bad == HeapArea::kBad ? nullptr : pointer(bad), "check");
  return false;
}

template <class List>
bool TaggedHeap<List>::check_blocks(std::uint64_t& free_blocks) {
  bool after_free = false;
  Offset block = area_.first;
  while (block < area_.top) {
    const std::uint32_t found = area_.header(block);
    const bool is_free = (found & kLive) == 0;
    if (!area_.sound(block, found) || (is_free && after_free)) break;
    if (is_free && !list_.holds(block, found)) break;
    if (is_free && poison_ && !poison_holds(block, found, "check")) return false;
    free_blocks += is_free ? 1 : 0;
    after_free = is_free;
    block += found & ~kLive;
  }
  if (block == area_.top && area_.header(area_.top) == kLive) return true;
  return corrupt(block, "check");
}

}  // namespace orrery::internal
