#include <orrery/harness/heap/block_heap.hpp>

#include <gtest/gtest.h>

#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <vector>

#include "test_arena.hpp"

namespace orrery {
namespace {

constexpr std::uint64_t kLimit = 1 << 20;

HeapOptions paper() {
  return {.alignment = 8, .limit_bytes = kLimit};
}
HeapOptions host() {
  return {.alignment = 16, .limit_bytes = kLimit};
}

std::ptrdiff_t distance(const void* from, const void* to) {
  return static_cast<const std::byte*>(to) - static_cast<const std::byte*>(from);
}

// The expected numbers of this trace were worked out by hand from the rules in the header:
// alignment 8, block = 8 + round_up(max(n, 1), 8), at least 16.
TEST(FirstFitHeapTest, FollowsTheHandWorkedTrace) {
  TestHeap t(paper());
  BlockHeap& heap = t.heap;
  void* a = heap.allocate(24);
  void* b = heap.allocate(40);
  void* c = heap.allocate(8);
  EXPECT_EQ(distance(t.arena.base(), a), 8);  // 4 padding, 4 header
  EXPECT_EQ(distance(a, b), 32);
  EXPECT_EQ(distance(b, c), 48);
  EXPECT_EQ(heap.figures().heap_bytes, 96u);
  EXPECT_EQ(heap.figures().resting_bytes, 96u);
  EXPECT_EQ(heap.figures().payload_bytes, 72u);

  heap.release(a);
  heap.release(c);  // list: c, a
  EXPECT_EQ(heap.figures().free_list_length, 2u);
  EXPECT_EQ(heap.figures().resting_bytes, 48u);
  EXPECT_EQ(heap.figures().largest_free_bytes, 32u);

  void* d = heap.allocate(20);  // needs 32: c has 16, a has exactly that, so no split
  EXPECT_EQ(d, a);
  EXPECT_EQ(heap.figures().search_steps, 2u);
  EXPECT_EQ(heap.figures().free_list_length, 1u);
  EXPECT_EQ(heap.figures().resting_bytes, 80u);

  heap.release(b);  // joins c: 64 bytes in front
  EXPECT_EQ(heap.figures().free_list_length, 1u);
  EXPECT_EQ(heap.figures().largest_free_bytes, 64u);
  heap.release(d);
  EXPECT_EQ(heap.figures().largest_free_bytes, 96u);
  EXPECT_EQ(heap.figures().resting_bytes, 0u);
  EXPECT_EQ(heap.figures().high_water_bytes, 96u);
  EXPECT_EQ(heap.figures().allocations, 4u);
  EXPECT_EQ(heap.figures().frees, 4u);
  EXPECT_TRUE(heap.check());
}

TEST(FirstFitHeapTest, TagsAreFourBytesBeforeThePayloadAndAtTheBlocksEnd) {
  TestHeap t(paper());
  std::byte* p = static_cast<std::byte*>(t.heap.allocate(24));
  std::uint32_t header = 0, footer = 0;
  std::memcpy(&header, p - 4, 4);
  std::memcpy(&footer, p + 24, 4);
  EXPECT_EQ(header, 32u | 1u);
  EXPECT_EQ(footer, header);
}

TEST(FirstFitHeapTest, PayloadCapacitiesAreThoseOfTheAlignment) {
  TestHeap eight(paper()), sixteen(host());
  const auto capacity = [](BlockHeap& heap, std::size_t n) {
    return heap.usable_bytes(heap.allocate(n));
  };
  EXPECT_EQ(capacity(eight.heap, 0), 8u);
  EXPECT_EQ(capacity(eight.heap, 8), 8u);
  EXPECT_EQ(capacity(eight.heap, 9), 16u);
  EXPECT_EQ(capacity(eight.heap, 17), 24u);
  EXPECT_EQ(capacity(sixteen.heap, 0), 8u);
  EXPECT_EQ(capacity(sixteen.heap, 8), 8u);
  EXPECT_EQ(capacity(sixteen.heap, 9), 24u);
  EXPECT_EQ(capacity(sixteen.heap, 25), 40u);
}

TEST(FirstFitHeapTest, ZeroBytesAreABlockOfTheirOwn) {
  TestHeap t(host());
  void* a = t.heap.allocate(0);
  void* b = t.heap.allocate(0);
  EXPECT_NE(a, nullptr);
  EXPECT_NE(a, b);
}

TEST(FirstFitHeapTest, MostRecentlyFreedBlockIsTakenFirst) {
  TestHeap t(paper());
  void* blocks[6];
  for (void*& p : blocks) p = t.heap.allocate(24);
  t.heap.release(blocks[0]);
  t.heap.release(blocks[4]);
  t.heap.release(blocks[2]);
  EXPECT_EQ(t.heap.allocate(24), blocks[2]);
  EXPECT_EQ(t.heap.allocate(24), blocks[4]);
  EXPECT_EQ(t.heap.allocate(24), blocks[0]);
}

TEST(FirstFitHeapTest, RemainderGoesToTheFrontUnlessItKeepsItsPlace) {
  for (const bool keeps_place : {false, true}) {
    HeapOptions options = paper();
    options.rules.remainder_keeps_place = keeps_place;
    TestHeap t(options);
    void* large = t.heap.allocate(120);  // 128
    t.heap.allocate(8);
    void* small = t.heap.allocate(24);  // 32
    t.heap.allocate(8);
    t.heap.release(large);
    t.heap.release(small);                  // list: small, large
    EXPECT_EQ(t.heap.allocate(56), large);  // 64 of large's 128; 64 remain
    void* rest = static_cast<std::byte*>(large) + 64;
    EXPECT_EQ(t.heap.allocate(8), keeps_place ? small : rest);
    EXPECT_TRUE(t.heap.check());
  }
}

TEST(FirstFitHeapTest, GrowthLeavesAFreeLastBlockUnlessItJoinsIt) {
  for (const bool joins : {false, true}) {
    HeapOptions options = paper();
    options.rules.growth_joins_last_block = joins;
    TestHeap t(options);
    void* last = t.heap.allocate(24);  // 32
    t.heap.release(last);
    void* larger = t.heap.allocate(56);  // 64
    EXPECT_EQ(larger == last, joins);
    EXPECT_EQ(t.heap.heap_bytes(), joins ? 64u : 96u);
    EXPECT_TRUE(t.heap.check());
  }
}

TEST(FirstFitHeapTest, ReallocShrinksBySplitting) {
  TestHeap t(paper());
  void* p = t.heap.allocate(120);  // 128
  t.heap.allocate(8);
  EXPECT_EQ(t.heap.reallocate(p, 24), p);  // 32, and 96 free
  EXPECT_EQ(t.heap.figures().largest_free_bytes, 96u);
  EXPECT_EQ(t.heap.figures().resting_bytes, 32u + 16u);
  EXPECT_EQ(t.heap.reallocate(p, 17), p);  // nothing to split
  EXPECT_EQ(t.heap.figures().resting_bytes, 32u + 16u);
  EXPECT_TRUE(t.heap.check());
}

TEST(FirstFitHeapTest, ReallocGrowsIntoAFreeSuccessorAndSplitsTheExcess) {
  TestHeap t(paper());
  void* p = t.heap.allocate(24);   // 32
  void* q = t.heap.allocate(120);  // 128
  t.heap.allocate(8);
  t.heap.release(q);
  t.heap.mark();
  EXPECT_EQ(t.heap.reallocate(p, 56), p);  // 64; 96 remain
  EXPECT_EQ(t.heap.figures().largest_free_bytes, 96u);
  EXPECT_EQ(t.heap.figures().transient_peak_bytes, 64u + 16u);  // the excess never was live
  EXPECT_EQ(t.heap.reallocate(p, 152), p);                      // 160: all of it
  EXPECT_EQ(t.heap.figures().free_list_length, 0u);
  EXPECT_TRUE(t.heap.check());
}

TEST(FirstFitHeapTest, ReallocMovesWhenItMustAndCountsBothBlocksAtThePeak) {
  TestHeap t(paper());
  char* p = static_cast<char*>(t.heap.allocate(24));
  std::memcpy(p, "the payload is kept", 20);
  t.heap.allocate(8);
  t.heap.mark();
  char* moved = static_cast<char*>(t.heap.reallocate(p, 40));
  EXPECT_NE(moved, p);
  EXPECT_STREQ(moved, "the payload is kept");
  EXPECT_EQ(t.heap.figures().transient_peak_bytes, 32u + 16u + 48u);
  EXPECT_EQ(t.heap.figures().resting_bytes, 16u + 48u);
}

TEST(FirstFitHeapTest, LastBlockMovesUnlessReallocGrowsTheTop) {
  for (const bool grows_top : {false, true}) {
    HeapOptions options = paper();
    options.rules.realloc_grows_top = grows_top;
    TestHeap t(options);
    void* p = t.heap.allocate(24);
    EXPECT_EQ(t.heap.reallocate(p, 56) == p, grows_top);
    EXPECT_EQ(t.heap.heap_bytes(), grows_top ? 64u : 96u);
    EXPECT_TRUE(t.heap.check());
  }
}

TEST(FirstFitHeapTest, ReallocOfNothingAllocatesAndToNothingFrees) {
  TestHeap t(paper());
  void* p = t.heap.reallocate(nullptr, 24);
  EXPECT_NE(p, nullptr);
  EXPECT_EQ(t.heap.reallocate(p, 0), nullptr);
  EXPECT_EQ(t.heap.live_bytes(), 0u);
}

TEST(FirstFitHeapTest, CallocZeroesAndRefusesAProductThatOverflows) {
  TestHeap t(paper());
  void* dirty = t.heap.allocate(64);
  std::memset(dirty, 0xAA, 64);
  t.heap.release(dirty);
  const unsigned char* p = static_cast<unsigned char*>(t.heap.allocate_zeroed(8, 8));
  for (int i = 0; i < 64; ++i) EXPECT_EQ(p[i], 0) << i;
  EXPECT_EQ(t.heap.allocate_zeroed(SIZE_MAX / 2, 3), nullptr);
  EXPECT_EQ(t.heap.figures().failures, 1u);
}

TEST(FirstFitHeapTest, AlignedBlocksAreAlignedAndTheFrontIsFree) {
  for (const HeapOptions& options : {paper(), host()}) {
    TestHeap t(options);
    std::vector<void*> blocks;
    for (std::size_t alignment = 1; alignment <= 4096; alignment *= 2) {
      t.heap.allocate(8);
      void* p = t.heap.allocate_aligned(alignment, 40);
      ASSERT_NE(p, nullptr);
      EXPECT_EQ(reinterpret_cast<std::uintptr_t>(p) % alignment, 0u);
      EXPECT_LT(t.heap.usable_bytes(p), 40u + 16u);  // what was asked for beyond it went back
      blocks.push_back(p);
      ASSERT_TRUE(t.heap.check());
    }
    for (void* p : blocks) t.heap.release(p);
    EXPECT_TRUE(t.heap.check());
    EXPECT_EQ(t.heap.figures().live_blocks, 13u);
  }
  TestHeap t(host());
  EXPECT_EQ(t.heap.allocate_aligned(24, 8), nullptr);
}

TEST(FirstFitHeapTest, LimitRefusesAndTheHeapGoesOn) {
  HeapOptions options = paper();
  options.limit_bytes = 128;
  TestHeap t(options);
  void* a = t.heap.allocate(56);  // 64
  void* b = t.heap.allocate(56);  // 64: the limit itself is allowed
  ASSERT_NE(b, nullptr);
  EXPECT_EQ(t.heap.allocate(1), nullptr);
  EXPECT_EQ(t.last.kind, HeapFault::Kind::kExhausted);
  EXPECT_EQ(t.last.bytes, 16u);
  EXPECT_EQ(t.heap.allocate(SIZE_MAX), nullptr);
  EXPECT_EQ(t.heap.allocate_aligned(64, SIZE_MAX - 100), nullptr);
  EXPECT_EQ(t.heap.reallocate(a, SIZE_MAX), nullptr);
  EXPECT_EQ(t.heap.figures().failures, 4u);
  EXPECT_EQ(t.heap.figures().heap_bytes, 128u);
  t.heap.release(a);
  EXPECT_EQ(t.heap.allocate(56), a);
  t.heap.set_limit(100);  // below what there is: no more growth, nothing else
  EXPECT_EQ(t.heap.allocate(1), nullptr);
  t.heap.release(b);
  EXPECT_EQ(t.heap.allocate(56), b);
}

// Robson's kind of trace: after n blocks of 16 bytes every other one is freed, so that half the
// heap is free and no hole takes 24 bytes. Sizes: 8 -> 16 bytes per block, 24 -> 32.
TEST(FirstFitHeapTest, FragmentationMakesItGrowWhileHalfOfItIsFree) {
  TestHeap t(paper());
  constexpr int kBlocks = 1000;
  std::vector<void*> blocks;
  for (int i = 0; i < kBlocks; ++i) blocks.push_back(t.heap.allocate(8));
  for (int i = 0; i < kBlocks; i += 2) t.heap.release(blocks[static_cast<std::size_t>(i)]);
  EXPECT_EQ(t.heap.figures().heap_bytes, 16'000u);
  EXPECT_EQ(t.heap.figures().resting_bytes, 8'000u);
  for (int i = 0; i < 100; ++i) ASSERT_NE(t.heap.allocate(24), nullptr);
  EXPECT_EQ(t.heap.figures().heap_bytes, 16'000u + 3'200u);
  EXPECT_EQ(t.heap.figures().free_list_length, 500u);
  EXPECT_EQ(t.heap.figures().search_steps, 100u * 500u);
}

TEST(FirstFitHeapTest, FindsDoubleFree) {
  TestHeap t(paper());
  void* a = t.heap.allocate(24);
  void* b = t.heap.allocate(24);
  void* c = t.heap.allocate(24);
  t.heap.allocate(24);
  t.heap.release(a);
  t.heap.release(b);  // joins a
  t.heap.release(c);  // joins both
  for (void* again : {a, b, c}) {
    t.heap.release(again);
    EXPECT_EQ(t.last.kind, HeapFault::Kind::kDoubleFree);
    EXPECT_EQ(t.last.address, again);
  }
  EXPECT_EQ(t.faults, 3);
  EXPECT_EQ(t.heap.figures().frees, 3u);
  EXPECT_TRUE(t.heap.check());
}

TEST(FirstFitHeapTest, FindsPointersThatAreNoBlocks) {
  TestHeap t(host());
  std::byte* a = static_cast<std::byte*>(t.heap.allocate(100));
  std::memset(a, 0, 100);
  int elsewhere = 0;
  t.heap.release(a + 16);
  EXPECT_EQ(t.last.kind, HeapFault::Kind::kInteriorPointer);
  t.heap.release(a + 1);
  EXPECT_EQ(t.last.kind, HeapFault::Kind::kInteriorPointer);
  t.heap.release(&elsewhere);
  EXPECT_EQ(t.last.kind, HeapFault::Kind::kForeignPointer);
  t.heap.release(a + 4096);
  EXPECT_EQ(t.last.kind, HeapFault::Kind::kForeignPointer);
  EXPECT_EQ(t.heap.reallocate(a + 32, 8), nullptr);
  EXPECT_EQ(t.last.kind, HeapFault::Kind::kInteriorPointer);
  EXPECT_STREQ(t.last.during, "realloc");
  EXPECT_EQ(t.faults, 5);
  EXPECT_TRUE(t.heap.check());
}

TEST(FirstFitHeapTest, FindsAnOverrunIntoTheNextBlock) {
  TestHeap t(paper());
  std::byte* a = static_cast<std::byte*>(t.heap.allocate(24));
  void* b = t.heap.allocate(24);
  std::memset(a, 0x41, 24 + 8);  // own footer and b's header
  EXPECT_FALSE(t.heap.check());
  t.heap.release(b);
  EXPECT_EQ(t.last.kind, HeapFault::Kind::kCorruptBlock);
  t.heap.release(a);
  EXPECT_EQ(t.last.kind, HeapFault::Kind::kCorruptBlock);
  EXPECT_EQ(t.heap.figures().frees, 0u);
}

TEST(FirstFitHeapTest, FindsAWriteAfterFreeIntoTheLinks) {
  for (const std::uint32_t value : {0xDEADBEEFu, 0xFFFFFFF8u, 12u, 56u}) {  // 56: itself
    TestHeap t(paper());
    void* a = t.heap.allocate(24);
    t.heap.allocate(8);
    void* c = t.heap.allocate(24);
    t.heap.allocate(8);
    t.heap.release(a);
    t.heap.release(c);
    std::memcpy(c, &value, 4);
    EXPECT_FALSE(t.heap.check()) << value;
    const int found = t.faults;
    EXPECT_EQ(t.heap.allocate(24), nullptr) << value;  // would take c
    EXPECT_GT(t.faults, found) << value;
    EXPECT_EQ(t.last.kind, HeapFault::Kind::kCorruptBlock);
  }
}

// The list moves what is in front when the second block grows or is split; that writes a link anew,
// which must not hide what was written there.
TEST(FirstFitHeapTest, AnOverwrittenLinkStaysSoWhenTheListMoves) {
  for (const bool splits : {false, true}) {
    TestHeap t(paper());
    BlockHeap& heap = t.heap;
    void* second = heap.allocate(100);
    void* neighbour = heap.allocate(8);
    heap.allocate(8);
    void* front = heap.allocate(8);
    heap.allocate(8);
    heap.release(second);
    heap.release(front);
    std::memset(front, 0x55, 8);
    splits ? static_cast<void>(heap.allocate(40)) : heap.release(neighbour);
    EXPECT_EQ(t.faults, 0);
    EXPECT_FALSE(heap.check());
    EXPECT_EQ(t.last.kind, HeapFault::Kind::kCorruptBlock);
    EXPECT_EQ(t.last.address, front);
  }
}

TEST(FirstFitHeapTest, OptionsOutsideTheirRangesAreRefused) {
  TestArena arena(4096);
  EXPECT_THROW(make_heap(arena.base(), {.alignment = 4}), std::invalid_argument);
  EXPECT_THROW(make_heap(arena.base(), {.limit_bytes = BlockHeap::kMaxLimit_bytes + 1}),
               std::invalid_argument);
  EXPECT_THROW(make_heap(arena.base() + 8, {.limit_bytes = 1024}), std::invalid_argument);
}

}  // namespace
}  // namespace orrery
