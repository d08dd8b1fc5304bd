// What distinguishes one policy from another, on traces short enough to follow by hand. Alignment
// 8: malloc(n) makes a block of 8 + n rounded up to 8 bytes.

#include <orrery/harness/heap/block_heap.hpp>

#include <gtest/gtest.h>

#include <cstdint>
#include <set>
#include <vector>

#include "test_arena.hpp"

namespace orrery {
namespace {

HeapOptions policy(HeapPolicy p) {
  return {.alignment = 8, .limit_bytes = 1 << 20, .rules = {.policy = p}};
}

// Blocks of these payloads in a row, each followed by a live one of 16 bytes that keeps it apart.
std::vector<void*> apart(BlockHeap& heap, const std::vector<std::size_t>& payloads) {
  std::vector<void*> blocks;
  for (const std::size_t bytes : payloads) {
    blocks.push_back(heap.allocate(bytes));
    heap.allocate(8);
  }
  return blocks;
}
void release(BlockHeap& heap, const std::vector<void*>& blocks) {
  for (void* block : blocks) heap.release(block);
}

TEST(HeapPoliciesTest, BestFitTakesTheSmallestThatIsLargeEnough) {
  TestHeap t(policy(HeapPolicy::kBestFit));
  const std::vector<void*> b = apart(t.heap, {1000, 504, 2000, 520, 600});
  release(t.heap, b);
  EXPECT_EQ(t.heap.allocate(510), b[3]);
  EXPECT_EQ(t.heap.allocate(500), b[1]);
  EXPECT_EQ(t.heap.allocate(601), b[0]);
  EXPECT_EQ(t.heap.allocate(1800), b[2]);
}

TEST(HeapPoliciesTest, BestFitTakesOfEqualBlocksTheOneFreedLast) {
  TestHeap t(policy(HeapPolicy::kBestFit));
  const std::vector<void*> b = apart(t.heap, {504, 504, 504});
  release(t.heap, {b[0], b[2], b[1]});
  EXPECT_EQ(t.heap.allocate(504), b[1]);
  EXPECT_EQ(t.heap.allocate(504), b[2]);
}

TEST(HeapPoliciesTest, NextFitGoesOnWhereItStoppedAndRoundTheHeap) {
  TestHeap t(policy(HeapPolicy::kNextFit));
  const std::vector<void*> b = apart(t.heap, {104, 104, 104, 104});
  release(t.heap, b);
  EXPECT_EQ(t.heap.allocate(48), b[0]);   // 56 of 112; 56 remain
  EXPECT_EQ(t.heap.allocate(104), b[1]);  // first fit by address would look at the rest first, too
  EXPECT_EQ(t.heap.allocate(48), b[2]);   // but not go on behind b[1]
  EXPECT_EQ(t.heap.allocate(48), static_cast<std::byte*>(b[2]) + 56);
  EXPECT_EQ(t.heap.allocate(104), b[3]);
  EXPECT_EQ(t.heap.allocate(48), static_cast<std::byte*>(b[0]) + 56);  // round the end
}

TEST(HeapPoliciesTest, FreeRtos4TakesTheLowestAddress) {
  TestHeap t(policy(HeapPolicy::kFreeRtos4));
  const std::vector<void*> b = apart(t.heap, {56, 104, 200});
  release(t.heap, {b[1], b[0], b[2]});
  EXPECT_EQ(t.heap.allocate(48), b[0]);
  EXPECT_EQ(t.heap.allocate(48), b[1]);
  EXPECT_EQ(t.heap.allocate(150), b[2]);
}

// heap_4 leaves a rest of exactly two headers (16 bytes) with the block.
TEST(HeapPoliciesTest, FreeRtos4SplitsOnlyIfMoreThanTwoHeadersRemain) {
  TestHeap t(policy(HeapPolicy::kFreeRtos4));
  const std::vector<void*> b = apart(t.heap, {104, 104});  // 112 each
  release(t.heap, b);
  void* exact = t.heap.allocate(88);  // 96 + 16
  EXPECT_EQ(t.heap.usable_bytes(exact), 104u);
  void* split = t.heap.allocate(80);  // 88 + 24
  EXPECT_EQ(t.heap.usable_bytes(split), 80u);
}

TEST(HeapPoliciesTest, FreeRtos4ReallocAlwaysMoves) {
  TestHeap t(policy(HeapPolicy::kFreeRtos4));
  void* p = t.heap.allocate(100);
  void* shrunk = t.heap.reallocate(p, 10);
  EXPECT_NE(shrunk, p);
  EXPECT_EQ(t.heap.figures().live_blocks, 1u);
}

// Blocks of 1000 bytes belong to the class [992, 1008). A request of that class might be larger
// than they are, so the head of the next class is taken without a look at them.
TEST(HeapPoliciesTest, TlsfPassesOverItsOwnClass) {
  TestHeap t(policy(HeapPolicy::kTlsf));
  const std::vector<void*> b = apart(t.heap, {992, 1200});  // blocks of 1000 and 1208
  release(t.heap, b);
  EXPECT_EQ(t.heap.allocate(988), b[1]);                    // 1000 would have fitted
  EXPECT_EQ(t.heap.allocate(980), b[0]);                    // 992: the class's lower bound
  EXPECT_EQ(t.heap.usable_bytes(t.heap.allocate(1)), 24u);  // three words at least
  EXPECT_EQ(t.heap.figures().search_steps, 3u);             // never more than one per request
}

TEST(HeapPoliciesTest, NewlibCarvesSmallRequestsFromTheLastRemainder) {
  TestHeap t(policy(HeapPolicy::kNewlib));
  const std::vector<void*> b = apart(t.heap, {1000, 2000, 104});
  release(t.heap, {b[1], b[0]});
  std::byte* first = static_cast<std::byte*>(t.heap.allocate(40));
  EXPECT_EQ(first, b[0]);                      // best fit of the bins
  t.heap.release(b[2]);                        // a block of 112, which fits better, but
  EXPECT_EQ(t.heap.allocate(40), first + 48);  // the remainder goes first,
  EXPECT_EQ(t.heap.allocate(104), b[2]);       // except before a block of the exact size
  EXPECT_EQ(t.heap.allocate(600), first + 96);
}

TEST(HeapPoliciesTest, NewlibKeepsTheTopForLast) {
  TestHeap t(policy(HeapPolicy::kNewlib));
  const std::vector<void*> b = apart(t.heap, {4000});
  void* last = t.heap.allocate(5000);
  release(t.heap, {b[0], last});
  EXPECT_EQ(t.heap.allocate(100), b[0]);  // although the top was freed last
  EXPECT_EQ(t.heap.allocate(4900), last);
  EXPECT_EQ(t.heap.allocate(6000), static_cast<std::byte*>(last) + 4912);  // and grows with it
}

TEST(HeapPoliciesTest, ScatterDependsOnItsSeedAndOnNothingElse) {
  const auto places = [](std::uint64_t seed) {
    HeapOptions options = policy(HeapPolicy::kScatter);
    options.rules.seed = seed;
    TestHeap t(options);
    std::vector<std::ptrdiff_t> all;
    for (int i = 0; i < 200; ++i) {
      all.push_back(static_cast<std::byte*>(t.heap.allocate(24)) - t.arena.base());
    }
    EXPECT_TRUE(t.heap.check());
    return all;
  };
  const std::vector<std::ptrdiff_t> first = places(1), other = places(2);
  EXPECT_EQ(places(1), first);
  int equal = 0, ascending = 0;
  for (std::size_t i = 0; i < first.size(); ++i) {
    equal += first[i] == other[i] ? 1 : 0;
    ascending += i > 0 && first[i] > first[i - 1] ? 1 : 0;
  }
  EXPECT_LE(equal, 2);
  EXPECT_NEAR(ascending, 100, 35);  // no order: 199 coin throws, 5 sigma
}

TEST(HeapPoliciesTest, ScatterLimitsLiveBytes) {
  HeapOptions options = policy(HeapPolicy::kScatter);
  options.limit_bytes = 4096;
  TestHeap t(options);
  std::vector<void*> blocks;
  while (void* block = t.heap.allocate(56)) blocks.push_back(block);  // 64
  EXPECT_LE(t.heap.live_bytes(), 4096u);
  EXPECT_GE(t.heap.live_bytes(), 4096u - 63);
  EXPECT_EQ(t.last.kind, HeapFault::Kind::kExhausted);
  t.heap.release(blocks.back());
  EXPECT_NE(t.heap.allocate(56), nullptr);
}

TEST(HeapPoliciesTest, ReallocToZeroKeepsABlockIfTold) {
  HeapOptions options = policy(HeapPolicy::kFirstFit);
  options.rules.realloc_to_zero_keeps = true;
  TestHeap t(options);
  void* p = t.heap.allocate(100);
  EXPECT_EQ(t.heap.reallocate(p, 0), p);
  EXPECT_EQ(t.heap.live_bytes(), 16u);
}

TEST(HeapPoliciesTest, LeastBlockBoundsBlocksAndRests) {
  HeapOptions options = policy(HeapPolicy::kFirstFit);
  options.rules.least_block_bytes = 64;
  TestHeap t(options);
  EXPECT_EQ(t.heap.usable_bytes(t.heap.allocate(1)), 56u);
  void* p = t.heap.allocate(120);  // 128
  t.heap.allocate(1);
  t.heap.release(p);
  EXPECT_EQ(t.heap.usable_bytes(t.heap.allocate(64)), 120u);  // 72, and 56 are no block
  options.rules.least_block_bytes = 20;
  EXPECT_THROW(TestHeap{options}, std::invalid_argument);
}

TEST(HeapPoliciesTest, PoisonShowsAWriteAfterFreeAtCheckAndAtReuse) {
  for (const HeapPolicy p : {HeapPolicy::kFirstFit, HeapPolicy::kBestFit, HeapPolicy::kNextFit,
                             HeapPolicy::kTlsf, HeapPolicy::kFreeRtos4, HeapPolicy::kNewlib}) {
    HeapOptions options = policy(p);
    options.rules.poison = true;
    TestHeap t(options);
    std::byte* block = static_cast<std::byte*>(t.heap.allocate(100));
    t.heap.allocate(8);
    t.heap.release(block);
    EXPECT_EQ(block[50], std::byte{0xDD});
    EXPECT_TRUE(t.heap.check());
    block[50] = std::byte{0};
    EXPECT_FALSE(t.heap.check()) << to_string(p);
    EXPECT_EQ(t.last.kind, HeapFault::Kind::kWriteAfterFree);
    EXPECT_EQ(t.last.address, block + 50);
    EXPECT_EQ(t.heap.allocate(100), nullptr) << to_string(p);
    EXPECT_EQ(t.faults, 2) << to_string(p);
    EXPECT_STREQ(t.last.during, "malloc");
  }
}

}  // namespace
}  // namespace orrery
