#include <orrery/harness/heap/first_fit_heap.hpp>

namespace orrery::internal {
namespace {

// Words of the arena around a payload: fewer instructions than by offset.
using Word = HeapArea::Word;
using Link = HeapArea::Link;

Word& word(std::byte* at, std::ptrdiff_t offset) {
  return *reinterpret_cast<Word*>(at + offset);
}
Word& header(std::byte* payload) {
  return word(payload, -4);
}
Word& footer(std::byte* payload, std::uint32_t size) {
  return word(payload, std::ptrdiff_t{size} - 8);
}
Link& link(std::byte* payload) {
  return *reinterpret_cast<Link*>(payload);
}
void tag(std::byte* payload, std::uint32_t size, std::uint32_t live) {
  header(payload) = size | live;
  footer(payload, size) = size | live;
}

// True if what the arena says of a free block is what the list holds in `slot`. The list's memory
// is out of flight software's reach, so nothing else need be asked.
bool agrees(std::byte* payload, RecencyList::Slot slot, std::uint32_t size) {
  return word(payload, 0) == slot && word(payload, 4) == ~slot && header(payload) == size &&
         footer(payload, size) == size;
}
// The same for a block of which only its own tag was seen so far.
bool lists(const RecencyList& list, RecencyList::Slot slot, std::byte* payload, HeapOffset block,
           std::uint32_t size) {
  return slot < list.end() && list[slot] == RecencyList::entry(block, size) &&
         agrees(payload, slot, size);
}

}  // namespace

// The first block of the list is where most searches end, the second where most others do. These
// are leaves of few variables, so that no register is saved.
void* FirstFitHeap::allocate(std::size_t bytes) noexcept {
  const std::uint32_t size = small_block_size(bytes);
  const Slot front = list_.end() - 1;
  if (!leaves_rest(front, size) || bytes > kMaxLimit_bytes) return allocate_second(bytes);
  std::byte* const payload = area_.at(list_.block_of(front));
  if (!agrees(payload, front, list_.size_of(front))) return TaggedHeap::allocate(bytes);
  return split(payload, front, size, 1);
}

[[gnu::noinline]] void* FirstFitHeap::allocate_second(std::size_t bytes) noexcept {
  const std::uint32_t size = small_block_size(bytes);
  const Slot front = list_.end() - 1, second = front - 1;
  if (!leaves_rest(second, size) || list_.size_of(front) >= size || list_.full() ||
      bytes > kMaxLimit_bytes) {
    return allocate_behind(bytes);
  }
  std::byte* const payload = area_.at(list_.block_of(second));
  if (!agrees(payload, second, list_.size_of(second))) return TaggedHeap::allocate(bytes);
  return split(payload, second, size, 2);
}

[[gnu::noinline]] void* FirstFitHeap::allocate_behind(std::size_t bytes) noexcept {
  if (bytes > kMaxLimit_bytes || list_.full()) return TaggedHeap::allocate(bytes);
  const std::uint32_t size = small_block_size(bytes);
  std::uint64_t steps = 0;
  const Slot slot = list_.find_slot(size, steps);
  std::byte* const payload = area_.at(list_.block_of(slot));
  const std::uint32_t found = list_.size_of(slot);
  if (found == 0 || !agrees(payload, slot, found)) return TaggedHeap::allocate(bytes);
  if (leaves_rest(slot, size)) return split(payload, slot, size, steps);
  list_.remove(slot);
  list_.add_length(-1);
  tag(payload, found, kLive);
  search_steps_ += steps;
  ++allocations_;
  add_live(found);
  return payload;
}

// What is left of the block goes to the front of the list.
[[gnu::always_inline]] inline void* FirstFitHeap::split(std::byte* payload, Slot slot,
                                                        std::uint32_t size, std::uint64_t steps) {
  const std::uint32_t rest = list_.size_of(slot) - size;
  std::byte* const after = payload + size;
  link(after) = list_.push_for(slot, list_.block_of(slot) + size, rest);
  tag(after, rest, 0);
  tag(payload, size, kLive);
  search_steps_ += steps;
  ++allocations_;
  add_live(size);
  return payload;
}

void FirstFitHeap::release(void* payload) noexcept {
  std::byte* const at = static_cast<std::byte*>(payload);
  const std::uint64_t distance = area_.distance(payload);
  const Offset block = static_cast<Offset>(distance);
  if (distance >= area_.top || block < area_.first || (block & (area_.align - 1)) != 0) {
    return TaggedHeap::release(payload);
  }
  const std::uint32_t tagged = header(at);
  const std::uint32_t size = tagged - kLive;  // odd if it was not live
  if ((size & (area_.align - 1)) != 0 || size < kLeastBlock_bytes || size > area_.top - block ||
      footer(at, size) != tagged || list_.full()) {
    return TaggedHeap::release(payload);
  }
  if ((header(at + size) & word(at, -8) & kLive) == 0) return release_joined(at, block, size);
  tag(at, size, 0);
  link(at) = list_.push(block, size);
  list_.add_length(1);
  live_bytes_ -= size;
  ++frees_;
}

// One neighbour of the block is free, or both.
[[gnu::noinline]] void FirstFitHeap::release_joined(std::byte* at, Offset block,
                                                    std::uint32_t size) noexcept {
  std::byte* const after = at + size;
  const std::uint32_t follower = header(after), leader = word(at, -8);
  if (((follower | leader) & kLive) == 0) return release_between(at, block, size);
  Slot slot = 0;
  std::uint32_t joined = size;
  if ((follower & kLive) == 0) {
    slot = word(after, 0);
    if (!lists(list_, slot, after, block + size, follower)) return TaggedHeap::release(at);
    joined += follower;
  } else {
    if (leader > block - area_.first) return TaggedHeap::release(at);
    slot = word(at - leader, 0);
    if (!lists(list_, slot, at - leader, block - leader, leader)) return TaggedHeap::release(at);
    // Within a joined block the old header must not pass for a live block's.
    header(at) = 0;
    at -= leader;
    block -= leader;
    joined += leader;
  }
  tag(at, joined, 0);
  link(at) = list_.push_for(slot, block, joined);
  live_bytes_ -= size;
  ++frees_;
}

[[gnu::noinline]] void FirstFitHeap::release_between(std::byte* at, Offset block,
                                                     std::uint32_t size) noexcept {
  std::byte* const after = at + size;
  const std::uint32_t follower = header(after), leader = word(at, -8);
  if (leader > block - area_.first) return TaggedHeap::release(at);
  std::byte* const before = at - leader;
  const Slot slot_after = word(after, 0), slot_before = word(before, 0);
  if (!lists(list_, slot_after, after, block + size, follower) ||
      !lists(list_, slot_before, before, block - leader, leader)) {
    return TaggedHeap::release(at);
  }
  header(at) = 0;
  const std::uint32_t joined = leader + size + follower;
  tag(before, joined, 0);
  list_.remove(std::max(slot_after, slot_before));  // of which the other may come to be the front
  list_.add_length(-1);
  link(before) = list_.push_for(std::min(slot_after, slot_before), block - leader, joined);
  live_bytes_ -= size;
  ++frees_;
}

}  // namespace orrery::internal
