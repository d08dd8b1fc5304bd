// Property: the index over the paper's free list chooses the block that a walk of the list chooses,
// and counts the blocks that the walk would have looked at.

#include <orrery/harness/heap/block_heap.hpp>

#include <gtest/gtest.h>

#include <cstdint>
#include <iterator>
#include <list>
#include <map>
#include <random>
#include <vector>

#include "test_arena.hpp"

namespace orrery {
namespace {

// The paper's heap written down as naively as it reads: a map of blocks and a list that is walked.
class WalkedHeap {
 public:
  explicit WalkedHeap(const HeapOptions& options) : options_(options) {}

  // Offset of the block from the heap's first.
  std::uint64_t allocate(std::uint64_t payload) {
    const std::uint64_t align = static_cast<std::uint64_t>(options_.alignment);
    const std::uint64_t size = std::max<std::uint64_t>(
        16, (std::max<std::uint64_t>(payload, 1) + 8 + align - 1) / align * align);
    for (auto entry = list_.begin(); entry != list_.end(); ++entry) {
      ++steps;
      const std::uint64_t at = *entry, found = blocks_[at].size;
      if (found < size) continue;
      if (found - size >= 16) {
        blocks_[at].size = size;
        blocks_[at + size].size = found - size;
        if (options_.rules.remainder_keeps_place) {
          blocks_[at + size].place = list_.insert(entry, at + size);
          blocks_[at + size].is_free = true;
        } else {
          push_front(at + size);
        }
      }
      list_.erase(entry);
      blocks_[at].is_free = false;
      return at;
    }
    blocks_[top] = {size, false, {}};
    top += size;
    return top - size;
  }

  void release(std::uint64_t at) {
    auto block = blocks_.find(at);
    const auto after = std::next(block);
    if (after != blocks_.end() && after->second.is_free) {
      list_.erase(after->second.place);
      block->second.size += after->second.size;
      blocks_.erase(after);
    }
    if (block != blocks_.begin() && std::prev(block)->second.is_free) {
      const auto before = std::prev(block);
      list_.erase(before->second.place);
      before->second.size += block->second.size;
      blocks_.erase(block);
      block = before;
    }
    push_front(block->first);
  }

  std::uint64_t length() const { return list_.size(); }
  std::uint64_t largest() const {
    std::uint64_t most = 0;
    for (const std::uint64_t at : list_) most = std::max(most, blocks_.at(at).size);
    return most;
  }

  std::uint64_t top = 0, steps = 0;

 private:
  struct Block {
    std::uint64_t size = 0;
    bool is_free = false;
    std::list<std::uint64_t>::iterator place;
  };
  void push_front(std::uint64_t at) {
    blocks_[at].is_free = true;
    blocks_[at].place = list_.insert(list_.begin(), at);
  }

  HeapOptions options_;
  std::map<std::uint64_t, Block> blocks_;
  std::list<std::uint64_t> list_;
};

struct Case {
  int alignment;
  bool remainder_keeps_place;
  std::uint64_t live;     // blocks, once there are so many
  std::uint64_t steps;    // operations
  std::uint64_t largest;  // request
};

class RecencyListTest : public testing::TestWithParam<Case> {};

TEST_P(RecencyListTest, ChoosesTheBlockThatAWalkChooses) {
  const Case& c = GetParam();
  const HeapOptions options{.alignment = c.alignment,
                            .limit_bytes = 256 << 20,
                            .rules = {.remainder_keeps_place = c.remainder_keeps_place}};
  TestHeap t(options);
  WalkedHeap walked(options);
  std::mt19937_64 random(c.live + c.steps);
  struct Live {
    void* payload;
    std::uint64_t at;
  };
  std::vector<Live> live;
  for (std::uint64_t step = 0; step < c.steps; ++step) {
    // The number of live blocks swings between half and all, so that the list grows and shrinks.
    const bool shrinking = step / c.live % 2 == 1;
    const bool frees =
        live.size() >= c.live || (!live.empty() && random() % 8 < (shrinking ? 5 : 3));
    if (frees) {
      const std::size_t i = random() % live.size();
      t.heap.release(live[i].payload);
      walked.release(live[i].at);
      live[i] = live.back();
      live.pop_back();
    } else {
      const std::uint64_t bytes = random() % 16 == 0 ? random() % c.largest : random() % 100;
      void* payload = t.heap.allocate(bytes);
      const std::uint64_t at = walked.allocate(bytes);
      ASSERT_EQ(static_cast<std::byte*>(payload) - t.arena.base() - c.alignment,
                static_cast<std::ptrdiff_t>(at))
          << "step " << step;
      live.push_back({payload, at});
    }
    if (step % 1024 == 0) {
      ASSERT_EQ(t.heap.largest_free_bytes(), walked.largest());
    }
  }
  const HeapFigures f = t.heap.figures();
  EXPECT_EQ(f.search_steps, walked.steps);
  EXPECT_EQ(f.heap_bytes, walked.top);
  EXPECT_EQ(f.free_list_length, walked.length());
  EXPECT_TRUE(t.heap.check());
}

// The last one keeps some 10,000 blocks on the list: several groups.
INSTANTIATE_TEST_SUITE_P(Loads, RecencyListTest,
                         testing::Values(Case{8, false, 20, 200'000, 500},
                                         Case{16, true, 20, 200'000, 500},
                                         Case{16, false, 500, 1'000'000, 4'000},
                                         Case{8, true, 500, 1'000'000, 4'000},
                                         Case{8, false, 20'000, 120'000, 40'000},
                                         Case{16, true, 20'000, 120'000, 40'000}));

// 100,000 holes of 16 bytes, none of which takes 24: the walk that is not made is still counted.
TEST(RecencyListTest, PassesOverAHundredThousandUselessHoles) {
  constexpr std::uint64_t kHoles = 100'000;
  TestHeap t({.alignment = 8, .limit_bytes = 64 << 20});
  void* useful = t.heap.allocate(100);
  t.heap.allocate(8);
  std::vector<void*> blocks;
  for (std::uint64_t i = 0; i < 2 * kHoles; ++i) blocks.push_back(t.heap.allocate(8));
  t.heap.release(useful);
  for (std::uint64_t i = 0; i < 2 * kHoles; i += 2) t.heap.release(blocks[i]);
  const std::uint64_t before = t.heap.figures().search_steps;
  EXPECT_EQ(t.heap.allocate(100), useful);  // the very last of the list
  EXPECT_EQ(t.heap.figures().search_steps - before, kHoles + 1);
  EXPECT_EQ(t.heap.figures().largest_free_bytes, 16u);
}

}  // namespace
}  // namespace orrery
