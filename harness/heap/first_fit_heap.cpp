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

// From the front of the list, where most searches end: a leaf, so that no register is saved.
void* FirstFitHeap::allocate(std::size_t bytes) noexcept {
  const std::uint32_t size = small_block_size(bytes);
  const RecencyList::Slot slot = list_.end() - 1;
  const std::uint64_t entry = list_[slot];
  if (entry < RecencyList::entry(0, size) || bytes > kMaxLimit_bytes) return allocate_behind(bytes);
  const Offset block = static_cast<Offset>(entry);
  const std::uint32_t found = static_cast<std::uint32_t>(entry >> 32);
  std::byte* const payload = area_.at(block);
  if (!agrees(payload, slot, found)) return TaggedHeap::allocate(bytes);
  ++search_steps_;
  ++allocations_;
  const std::uint32_t rest = found - size;
  if (rest < least_) {
    list_.remove(slot);
    tag(payload, found, kLive);
    add_live(found);
  } else {
    std::byte* const after = payload + size;
    link(after) = list_.shrink(slot, block + size, rest);
    tag(after, rest, 0);
    tag(payload, size, kLive);
    add_live(size);
  }
  return payload;
}

[[gnu::noinline]] void* FirstFitHeap::allocate_behind(std::size_t bytes) noexcept {
  if (bytes > kMaxLimit_bytes || list_.full()) return TaggedHeap::allocate(bytes);
  const std::uint32_t size = small_block_size(bytes);
  std::uint64_t steps = 0;
  const RecencyList::Slot slot = list_.find_slot(size, steps);
  const Offset block = list_.block_of(slot);
  const std::uint32_t found = list_.size_of(slot);
  std::byte* const payload = area_.at(block);
  if (slot == 0 || !agrees(payload, slot, found)) return TaggedHeap::allocate(bytes);
  search_steps_ += steps;
  ++allocations_;
  list_.remove(slot);
  const std::uint32_t rest = found - size;
  const std::uint32_t kept = rest < least_ ? found : size;
  if (kept == size && rest != 0) {
    std::byte* const after = payload + size;
    link(after) = list_.push(block + size, rest);
    tag(after, rest, 0);
  }
  tag(payload, kept, kLive);
  add_live(kept);
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
  live_bytes_ -= size;
  ++frees_;
}

// A neighbour of the block, or both, are free.
[[gnu::noinline]] void FirstFitHeap::release_joined(std::byte* at, Offset block,
                                                    std::uint32_t size) noexcept {
  std::byte* const after = at + size;
  const std::uint32_t follower = header(after), leader = word(at, -8);
  RecencyList::Slot slot_after = 0, slot_before = 0;
  if ((follower & kLive) == 0) {
    slot_after = word(after, 0);
    if (!lists(list_, slot_after, after, block + size, follower)) return TaggedHeap::release(at);
  }
  if ((leader & kLive) == 0) {
    if (leader > block - area_.first) return TaggedHeap::release(at);
    slot_before = word(at - leader, 0);
    if (!lists(list_, slot_before, at - leader, block - leader, leader)) {
      return TaggedHeap::release(at);
    }
  }

  live_bytes_ -= size;
  ++frees_;
  if (slot_after != 0) {
    list_.remove(slot_after);
    size += follower;
  }
  if (slot_before != 0) {
    list_.remove(slot_before);
    // Within a joined block the old header must not pass for a live block's.
    header(at) = 0;
    at -= leader;
    block -= leader;
    size += leader;
  }
  tag(at, size, 0);
  link(at) = list_.push(block, size);
}

}  // namespace orrery::internal
