#include <orrery/harness/heap/first_fit_heap.hpp>

#include <algorithm>
#include <cstring>
#include <stdexcept>
#include <string>

namespace orrery {
namespace {

constexpr std::uint32_t kLive = 1;
constexpr std::uint32_t kTags_bytes = 8;  // header and footer
constexpr std::uint32_t kLeastBlock_bytes = 16;

bool is_power_of_two(std::size_t n) {
  return n != 0 && (n & (n - 1)) == 0;
}

void check_limit(const char* function, std::uint64_t bytes) {
  if (bytes > FirstFitHeap::kMaxLimit_bytes) {
    throw std::invalid_argument(std::string(function) + ": limit = " + std::to_string(bytes) +
                                " bytes is above " + std::to_string(FirstFitHeap::kMaxLimit_bytes));
  }
}

}  // namespace

const char* to_string(HeapFault::Kind kind) {
  switch (kind) {
    case HeapFault::Kind::kDoubleFree:
      return "double free";
    case HeapFault::Kind::kInteriorPointer:
      return "pointer into a block";
    case HeapFault::Kind::kForeignPointer:
      return "pointer to no block of this heap";
    case HeapFault::Kind::kCorruptBlock:
      return "overwritten block header, footer or link";
    case HeapFault::Kind::kExhausted:
      return "heap limit passed";
  }
  return "unknown heap fault";
}

FirstFitHeap::FirstFitHeap(void* arena, const FirstFitOptions& options)
    : arena_(static_cast<std::byte*>(arena)), options_(options) {
  if (options.alignment != 8 && options.alignment != 16) {
    throw std::invalid_argument("FirstFitHeap: alignment = " + std::to_string(options.alignment) +
                                " bytes; it is 8 or 16");
  }
  check_limit("FirstFitHeap", options.limit_bytes);
  if (reinterpret_cast<std::uintptr_t>(arena) % 16 != 0) {
    throw std::invalid_argument("FirstFitHeap: the arena is not aligned to 16 bytes");
  }
  first_ = top_ = static_cast<Offset>(options.alignment);
  word(first_ - 8) = kLive;  // footer of a block before the first: nothing to join
  header(top_) = kLive;      // header of a block after the last
}

void FirstFitHeap::set_fault_handler(FaultHandler handler, void* context) {
  handler_ = handler;
  handler_context_ = context;
}

void FirstFitHeap::set_limit(std::uint64_t bytes) {
  check_limit("FirstFitHeap::set_limit", bytes);
  options_.limit_bytes = bytes;
}

// ---- requests

void* FirstFitHeap::allocate(std::size_t bytes) {
  const Offset block = take(block_size(bytes), "malloc");
  if (block == 0) return nullptr;
  count_allocation(block);
  return pointer(block);
}

void* FirstFitHeap::allocate_zeroed(std::size_t count, std::size_t bytes) {
  std::size_t total = 0;
  if (__builtin_mul_overflow(count, bytes, &total)) total = SIZE_MAX;  // above any limit
  const Offset block = take(block_size(total), "calloc");
  if (block == 0) return nullptr;
  count_allocation(block);
  return std::memset(pointer(block), 0, total);
}

void* FirstFitHeap::allocate_aligned(std::size_t alignment, std::size_t bytes) {
  if (!is_power_of_two(alignment)) return nullptr;
  const std::size_t natural = static_cast<std::size_t>(options_.alignment);
  if (alignment <= natural) return allocate(bytes);
  const std::uint64_t wanted = block_size(bytes);
  // What lies before the aligned payload becomes a free block, so it is nothing or at least 16.
  const bool too_large = alignment > kMaxLimit_bytes || wanted > kMaxLimit_bytes;
  Offset block =
      take(too_large ? UINT64_MAX : wanted + alignment + (kLeastBlock_bytes - natural), "memalign");
  if (block == 0) return nullptr;

  const std::uint32_t size = header(block) & ~kLive;
  const std::uintptr_t address = reinterpret_cast<std::uintptr_t>(pointer(block));
  std::uint32_t gap = static_cast<std::uint32_t>(-address & (alignment - 1));
  if (gap != 0 && gap < kLeastBlock_bytes) gap += static_cast<std::uint32_t>(alignment);
  if (gap != 0) {
    tag(block + gap, size - gap, kLive);
    if (!push_joined(block, gap)) return nullptr;
    block += gap;
  }
  trim(block, static_cast<std::uint32_t>(wanted));
  count_allocation(block);
  return pointer(block);
}

void* FirstFitHeap::reallocate(void* payload, std::size_t bytes) {
  if (payload == nullptr) return allocate(bytes);
  if (bytes == 0) {
    release(payload);
    return nullptr;
  }
  const Offset block = live_block(payload, "realloc");
  if (block == 0) return nullptr;
  const std::uint32_t size = header(block) & ~kLive;
  const std::uint64_t wanted = block_size(bytes);
  const Offset kept = wanted <= size ? (trim(block, static_cast<std::uint32_t>(wanted)), block)
                                     : grow_in_place(block, size, wanted);
  if (kept == kBad) return nullptr;
  if (kept != 0) {
    live_bytes_ -= size;
    add_live(header(block) & ~kLive);
    return payload;
  }
  const Offset moved = take(wanted, "realloc");
  if (moved == 0) return nullptr;
  count_allocation(moved);
  std::memcpy(pointer(moved), payload, size - kTags_bytes);
  release(payload);
  return pointer(moved);
}

void FirstFitHeap::release(void* payload) {
  if (payload == nullptr) return;
  const Offset block = live_block(payload, "free");
  if (block == 0) return;
  const std::uint32_t size = header(block) & ~kLive;
  // Joined blocks leave old tags in the payload: they must not pass for a live block's.
  tag(block, size, 0);
  if (!push_joined(block, size)) {
    tag(block, size, kLive);
    return;
  }
  live_bytes_ -= size;
  --live_blocks_;
  ++frees_;
}

std::size_t FirstFitHeap::usable_bytes(void* payload) {
  if (payload == nullptr) return 0;
  const Offset block = live_block(payload, "malloc_usable_size");
  return block == 0 ? 0 : (header(block) & ~kLive) - kTags_bytes;
}

// ---- blocks

// Size of the block for a payload. Requests that cannot be met come out above any limit.
std::uint64_t FirstFitHeap::block_size(std::size_t bytes) const {
  if (bytes > kMaxLimit_bytes) return UINT64_MAX;
  const std::uint64_t align = static_cast<std::uint64_t>(options_.alignment);
  const std::uint64_t size = std::max<std::uint64_t>(bytes, 1) + kTags_bytes;
  return std::max<std::uint64_t>((size + align - 1) & ~(align - 1), kLeastBlock_bytes);
}

// A live block of at least `size`; 0 past the limit or where the heap is corrupt.
FirstFitHeap::Offset FirstFitHeap::take(std::uint64_t size, const char* during) {
  if (size <= kMaxLimit_bytes) {
    const Offset block = take_from_list(static_cast<std::uint32_t>(size), during);
    if (block != 0) return block == kBad ? 0 : block;
  }
  return grow(size, during);
}

FirstFitHeap::Offset FirstFitHeap::take_from_list(std::uint32_t size, const char* during) {
  std::uint64_t left = list_length_;
  for (Offset block = list_; block != 0; block = next(block)) {
    ++search_steps_;
    if (!within(block) || left-- == 0) {
      fail(HeapFault::Kind::kCorruptBlock, pointer(block), during);
      return kBad;
    }
    const std::uint32_t found = header(block);
    if (found < size) continue;
    if ((found & kLive) != 0 || !sound(block, found) || !linked(block)) {
      fail(HeapFault::Kind::kCorruptBlock, pointer(block), during);
      return kBad;
    }
    const std::uint32_t rest = found - size;
    if (rest < kLeastBlock_bytes) {
      unlink(block, found);
      tag(block, found, kLive);
    } else if (options_.remainder_keeps_place) {
      replace(block, block + size, found, rest);
      tag(block, size, kLive);
    } else {
      unlink(block, found);
      tag(block, size, kLive);
      push_front(block + size, rest);
    }
    return block;
  }
  return 0;
}

FirstFitHeap::Offset FirstFitHeap::grow(std::uint64_t size, const char* during) {
  const std::uint32_t last = word(top_ - 8);
  const bool join = options_.growth_joins_last_block && (last & kLive) == 0;
  // A free last block is smaller than the request: else it would have been taken from the list.
  const std::uint64_t growth = join ? size - last : size;
  if (size > kMaxLimit_bytes || heap_bytes() + growth > options_.limit_bytes) {
    ++failures_;
    fail(HeapFault::Kind::kExhausted, nullptr, during, size);
    return 0;
  }
  Offset block = top_;
  if (join) {
    if (!leads(top_, last)) {
      fail(HeapFault::Kind::kCorruptBlock, pointer(top_), during);
      return 0;
    }
    block -= last;
    unlink(block, last);
  }
  top_ += static_cast<Offset>(growth);
  tag(block, static_cast<std::uint32_t>(size), kLive);
  header(top_) = kLive;
  return block;
}

// Makes the block `wanted` large without moving it, if what follows it allows that: the block, 0 if
// not, kBad where the heap is corrupt.
FirstFitHeap::Offset FirstFitHeap::grow_in_place(Offset payload, std::uint32_t size,
                                                 std::uint64_t wanted) {
  const Offset after = payload + size;
  const std::uint32_t follower = header(after);
  if ((follower & kLive) == 0) {
    if (!sound(after, follower) || !linked(after)) {
      fail(HeapFault::Kind::kCorruptBlock, pointer(after), "realloc");
      return kBad;
    }
    if (size + std::uint64_t{follower} < wanted) return 0;
    unlink(after, follower);
    tag(payload, size + follower, kLive);
    trim(payload, static_cast<std::uint32_t>(wanted));
    return payload;
  }
  const std::uint64_t growth = wanted - size;
  if (!options_.realloc_grows_top || after != top_ || wanted > kMaxLimit_bytes ||
      heap_bytes() + growth > options_.limit_bytes) {
    return 0;
  }
  top_ += static_cast<Offset>(growth);
  tag(payload, static_cast<std::uint32_t>(wanted), kLive);
  header(top_) = kLive;
  return payload;
}

// Cuts a live block down to `wanted` if what remains makes a block.
void FirstFitHeap::trim(Offset payload, std::uint32_t wanted) {
  const std::uint32_t size = header(payload) & ~kLive;
  if (size - wanted < kLeastBlock_bytes) return;
  tag(payload, wanted, kLive);
  push_joined(payload + wanted, size - wanted);
}

// ---- the free list

// Joins the block with its free neighbours and puts the result in front. False: a neighbour was
// corrupt, and nothing was done.
bool FirstFitHeap::push_joined(Offset payload, std::uint32_t size) {
  const Offset after = payload + size;
  const std::uint32_t follower = header(after);
  const std::uint32_t leader = word(payload - 8);
  const bool join_after = (follower & kLive) == 0;
  const bool join_before = (leader & kLive) == 0;
  if (join_after && (!sound(after, follower) || !linked(after))) {
    fail(HeapFault::Kind::kCorruptBlock, pointer(after), "free");
    return false;
  }
  if (join_before && !leads(payload, leader)) {
    fail(HeapFault::Kind::kCorruptBlock, pointer(payload), "free");
    return false;
  }
  if (join_after) {
    unlink(after, follower);
    size += follower;
  }
  if (join_before) {
    payload -= leader;
    unlink(payload, leader);
    size += leader;
  }
  push_front(payload, size);
  return true;
}

void FirstFitHeap::push_front(Offset payload, std::uint32_t size) {
  tag(payload, size, 0);
  next(payload) = list_;
  previous(payload) = 0;
  if (list_ != 0) previous(list_) = payload;
  list_ = payload;
  ++list_length_;
  if (size >= largest_free_bytes_) {
    largest_free_bytes_ = size;
    largest_is_known_ = true;
  }
}

// The new block, cut from the old one, takes its place in the list.
void FirstFitHeap::replace(Offset old_block, Offset new_block, std::uint32_t old_size,
                           std::uint32_t size) {
  const Offset before = previous(old_block);
  const Offset after = next(old_block);
  tag(new_block, size, 0);
  next(new_block) = after;
  previous(new_block) = before;
  (before == 0 ? list_ : next(before)) = new_block;
  if (after != 0) previous(after) = new_block;
  forget_largest(old_size);
}

void FirstFitHeap::unlink(Offset payload, std::uint32_t size) {
  const Offset before = previous(payload);
  const Offset after = next(payload);
  (before == 0 ? list_ : next(before)) = after;
  if (after != 0) previous(after) = before;
  --list_length_;
  forget_largest(size);
}

void FirstFitHeap::forget_largest(std::uint32_t size) {
  if (size == largest_free_bytes_) largest_is_known_ = false;
}

std::uint64_t FirstFitHeap::largest_free_bytes() const {
  if (!largest_is_known_) {
    largest_free_bytes_ = 0;
    // The user may have overwritten a link: a count keeps the walk finite, bounds keep it inside.
    std::uint64_t left = list_length_;
    for (Offset block = list_; block != 0 && left > 0; block = next(block), --left) {
      if (!within(block)) break;
      largest_free_bytes_ = std::max<std::uint32_t>(largest_free_bytes_, header(block));
    }
    largest_is_known_ = true;
  }
  return largest_free_bytes_;
}

void FirstFitHeap::count_allocation(Offset payload) {
  add_live(header(payload) & ~kLive);
  ++live_blocks_;
  ++allocations_;
}

void FirstFitHeap::add_live(std::uint64_t bytes) {
  live_bytes_ += bytes;
  peak_bytes_ = std::max(peak_bytes_, live_bytes_);
  high_water_bytes_ = std::max(high_water_bytes_, live_bytes_);
}

// ---- checks

// True if `tag` can be this block's header, and its footer says the same.
bool FirstFitHeap::sound(Offset payload, std::uint32_t tag) const {
  const std::uint32_t align = static_cast<std::uint32_t>(options_.alignment);
  const std::uint32_t size = tag & ~kLive;
  if (size < kLeastBlock_bytes || size % align != 0 || size > top_ - payload) return false;
  return footer(payload, size) == tag;
}

// True if the free block's neighbours in the list know it.
bool FirstFitHeap::linked(Offset payload) const {
  const Offset before = previous(payload);
  const Offset after = next(payload);
  if ((before != 0 && !within(before)) || (after != 0 && !within(after))) return false;
  if ((before == 0 ? list_ : next(before)) != payload) return false;
  return after == 0 || previous(after) == payload;
}

// True if a sound free block of `size` ends where the block of `payload` begins.
bool FirstFitHeap::leads(Offset payload, std::uint32_t size) const {
  if (size < kLeastBlock_bytes || size > payload - first_ || !within(payload - size)) return false;
  return header(payload - size) == size && linked(payload - size);
}

FirstFitHeap::Offset FirstFitHeap::live_block(void* payload, const char* during) {
  const std::uintptr_t distance =
      reinterpret_cast<std::uintptr_t>(payload) - reinterpret_cast<std::uintptr_t>(arena_);
  const Offset block = static_cast<Offset>(distance);
  if (distance < top_ && within(block)) {
    const std::uint32_t found = header(block);
    if ((found & kLive) != 0 && sound(block, found)) return block;
  }
  fail(diagnose(payload), payload, during);
  return 0;
}

// Walks all blocks, which is dear, but something is wrong anyway.
HeapFault::Kind FirstFitHeap::diagnose(const void* payload) const {
  const std::uintptr_t distance =
      reinterpret_cast<std::uintptr_t>(payload) - reinterpret_cast<std::uintptr_t>(arena_);
  if (distance < first_ || distance >= top_) return HeapFault::Kind::kForeignPointer;
  for (Offset block = first_; block < top_;) {
    const std::uint32_t found = header(block);
    if (!sound(block, found)) return HeapFault::Kind::kCorruptBlock;
    const std::uint32_t size = found & ~kLive;
    if (distance < std::uint64_t{block} - 4 + size) {
      return (found & kLive) != 0 ? HeapFault::Kind::kInteriorPointer
                                  : HeapFault::Kind::kDoubleFree;
    }
    block += size;
  }
  return HeapFault::Kind::kForeignPointer;
}

void* FirstFitHeap::fail(HeapFault::Kind kind, const void* address, const char* during,
                         std::uint64_t bytes) const {
  if (handler_ != nullptr) handler_(handler_context_, HeapFault{kind, address, bytes, during});
  return nullptr;
}

bool FirstFitHeap::check() {
  std::uint64_t free_blocks = 0;
  return check_blocks(free_blocks) && check_list(free_blocks);
}

bool FirstFitHeap::check_blocks(std::uint64_t& free_blocks) {
  bool after_free = false;
  Offset block = first_;
  while (block < top_) {
    const std::uint32_t found = header(block);
    const bool is_free = (found & kLive) == 0;
    if (!sound(block, found) || (is_free && after_free)) break;
    free_blocks += is_free ? 1 : 0;
    after_free = is_free;
    block += found & ~kLive;
  }
  if (block == top_ && header(top_) == kLive) return true;
  fail(HeapFault::Kind::kCorruptBlock, pointer(block), "check");
  return false;
}

bool FirstFitHeap::check_list(std::uint64_t free_blocks) {
  std::uint64_t counted = 0;
  Offset block = list_;
  while (block != 0 && counted < free_blocks) {
    if (!within(block) || (header(block) & kLive) != 0 || !linked(block)) break;
    ++counted;
    block = next(block);
  }
  if (block == 0 && counted == free_blocks && counted == list_length_) return true;
  fail(HeapFault::Kind::kCorruptBlock, block == 0 ? nullptr : pointer(block), "check");
  return false;
}

HeapFigures FirstFitHeap::figures() const {
  HeapFigures f;
  f.limit_bytes = options_.limit_bytes;
  f.alignment = options_.alignment;
  f.resting_bytes = live_bytes_;
  f.payload_bytes = live_bytes_ - kTags_bytes * live_blocks_;
  f.live_blocks = live_blocks_;
  f.transient_peak_bytes = peak_bytes_;
  f.high_water_bytes = high_water_bytes_;
  f.heap_bytes = heap_bytes();
  f.largest_free_bytes = largest_free_bytes();
  f.free_list_length = list_length_;
  f.allocations = allocations_;
  f.frees = frees_;
  f.failures = failures_;
  f.search_steps = search_steps_;
  return f;
}

}  // namespace orrery
