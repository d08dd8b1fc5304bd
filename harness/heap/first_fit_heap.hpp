/// The paper's heap under its default rules: TaggedHeap<RecencyList>, written out for speed.
/// For the policies' sources only.
#pragma once

#include <orrery/harness/heap/recency_list.hpp>
#include <orrery/harness/heap/tagged_heap.hpp>

namespace orrery::internal {

/// malloc and free decide everything before they write anything. What is out of the ordinary
/// (growth at the top, a full list, anything that is not sound) is left to TaggedHeap, which begins
/// anew: so every check is made, and reported, as there.
/// @pre neither HeapRules::poison nor remainder_keeps_place.
class FirstFitHeap final : public TaggedHeap<RecencyList> {
 public:
  using TaggedHeap::TaggedHeap;
  void* allocate(std::size_t bytes) noexcept override;
  void release(void* payload) noexcept override;

 private:
  using Slot = RecencyList::Slot;
  // block_size() for requests up to kMaxLimit_bytes.
  std::uint32_t small_block_size(std::size_t bytes) const {
    const std::uint32_t mask = area_.align - 1;
    const std::uint32_t size = (static_cast<std::uint32_t>(bytes) + kTags_bytes + mask) & ~mask;
    return std::max(size, least_);
  }
  bool leaves_rest(Slot slot, std::uint32_t size) const {
    return list_[slot] >= RecencyList::entry(0, size + least_);
  }
  void* allocate_second(std::size_t bytes) noexcept;
  void* allocate_behind(std::size_t bytes) noexcept;
  void* split(std::byte* payload, Slot slot, std::uint32_t size, std::uint64_t steps);
  void release_joined(std::byte* at, Offset block, std::uint32_t size) noexcept;
  void release_between(std::byte* at, Offset block, std::uint32_t size) noexcept;
};

}  // namespace orrery::internal
