#include <orrery/harness/heap/scatter_list.hpp>

#include <algorithm>

namespace orrery::internal {

std::uint64_t ScatterList::below(std::uint64_t n) {
  return static_cast<std::uint64_t>(random_.integer(0, static_cast<std::int64_t>(n) - 1));
}

void ScatterList::insert(HeapOffset block, std::uint32_t, bool) {
  blocks_.grow(length_ + 1);
  blocks_[length_] = block;
  area_.word(block) = length_;
  area_.word(block + 4) = ~length_;
  ++length_;
}

void ScatterList::remove(HeapOffset block, std::uint32_t) {
  const std::uint32_t i = area_.word(block);
  const HeapOffset last = blocks_[--length_];
  if (last == block) return;
  blocks_[i] = last;
  area_.word(last) = i;
  area_.word(last + 4) = ~i;
}

void ScatterList::replace(HeapOffset old, HeapOffset now, std::uint32_t size) {
  remove(old, size);
  insert(now, size);
}

// A few draws, so that large blocks are not the only ones taken; then all, from a drawn one on.
HeapOffset ScatterList::find(std::uint32_t size, std::uint64_t& steps) {
  if (length_ == 0) return 0;
  std::uint32_t i = 0;
  for (int draw = 0; draw < 8; ++draw) {
    ++steps;
    i = static_cast<std::uint32_t>(below(length_));
    if (area_.header(blocks_[i]) >= size) return blocks_[i];
  }
  for (std::uint32_t k = 0; k < length_; ++k) {
    ++steps;
    i = i + 1 == length_ ? 0 : i + 1;
    if (area_.header(blocks_[i]) >= size) return blocks_[i];
  }
  return 0;
}

std::uint32_t ScatterList::gap(std::uint32_t slack) {
  return static_cast<std::uint32_t>(below(slack / area_.align + 1)) * area_.align;
}

std::uint32_t ScatterList::largest() {
  std::uint32_t best = 0;
  for (std::uint32_t i = 0; i < length_; ++i) {
    best = std::max<std::uint32_t>(best, area_.header(blocks_[i]));
  }
  return best;
}

HeapOffset ScatterList::check(std::uint64_t blocks) const {
  return length_ == blocks ? 0 : HeapArea::kBad;  // holds() was asked of every block
}

}  // namespace orrery::internal
