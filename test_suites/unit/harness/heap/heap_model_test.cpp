// Property: whatever is asked of it, the heap behaves as a map of disjoint ranges does.

#include <orrery/harness/heap/block_heap.hpp>
#include <orrery/harness/kernel/bytes.hpp>

#include <gtest/gtest.h>

#include <cctype>
#include <cstdint>
#include <cstring>
#include <iterator>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "test_arena.hpp"

namespace orrery {
namespace {

struct Case {
  std::uint64_t seed;
  HeapOptions options;
};

// The model: where each live range begins, how long it is, and a byte that fills it.
struct Range {
  std::size_t bytes = 0;
  unsigned char fill = 0;
};

class HeapModelTest : public testing::TestWithParam<Case> {
 protected:
  HeapModelTest() : t_(GetParam().options), random_(GetParam().seed) {}

  std::uint64_t below(std::uint64_t n) { return random_() % n; }
  // Mostly small, sometimes large, as flight code asks.
  std::size_t some_size() { return below(8) == 0 ? below(20'000) : below(200); }

  void enter(void* p, std::size_t bytes) {
    std::byte* begin = static_cast<std::byte*>(p);
    ASSERT_EQ(
        reinterpret_cast<std::uintptr_t>(p) % static_cast<unsigned>(GetParam().options.alignment),
        0u);
    const auto after = live_.lower_bound(begin);
    if (after != live_.end()) {
      ASSERT_LE(begin + bytes, after->first);
    }
    if (after != live_.begin()) {
      const auto before = std::prev(after);
      ASSERT_LE(before->first + before->second.bytes, begin);
    }
    const unsigned char fill = static_cast<unsigned char>(below(256));
    std::memset(p, fill, bytes);
    live_[begin] = {bytes, fill};
  }
  void expect_intact(const std::byte* p, std::size_t bytes, unsigned char fill) {
    for (std::size_t i = 0; i < bytes; ++i) {
      ASSERT_EQ(static_cast<unsigned char>(p[i]), fill) << "byte " << i << " of " << bytes;
    }
  }
  std::map<std::byte*, Range>::iterator any() {
    return std::next(live_.begin(), static_cast<std::ptrdiff_t>(below(live_.size())));
  }

  void allocate() {
    const std::size_t bytes = some_size();
    if (void* p = t_.heap.allocate(bytes)) enter(p, bytes);
  }
  void allocate_aligned() {
    const std::size_t alignment = std::size_t{1} << below(9);
    const std::size_t bytes = below(300);
    if (void* p = t_.heap.allocate_aligned(alignment, bytes)) {
      ASSERT_EQ(reinterpret_cast<std::uintptr_t>(p) % alignment, 0u);
      enter(p, bytes);
    }
  }
  void release() {
    const auto range = any();
    expect_intact(range->first, range->second.bytes, range->second.fill);
    t_.heap.release(range->first);
    live_.erase(range);
  }
  void reallocate() {
    const auto range = any();
    const Range old = range->second;
    const std::size_t bytes = 1 + some_size();
    void* p = t_.heap.reallocate(range->first, bytes);
    if (p == nullptr) return;
    live_.erase(range);
    expect_intact(static_cast<std::byte*>(p), std::min(old.bytes, bytes), old.fill);
    enter(p, bytes);
  }

  void expect_sums_hold() {
    ASSERT_TRUE(t_.heap.check());  // blocks fill the heap, none adjacent free, list = free blocks
    const HeapFigures f = t_.heap.figures();
    std::uint64_t blocks = 0, largest = 0;
    for (const auto& [begin, range] : live_) blocks += t_.heap.usable_bytes(begin) + 8;
    ASSERT_EQ(f.resting_bytes, blocks);
    ASSERT_EQ(f.live_blocks, live_.size());
    ASSERT_EQ(f.allocations - f.frees, live_.size());
    const bool scatters = GetParam().options.rules.policy == HeapPolicy::kScatter;
    ASSERT_LE(scatters ? f.resting_bytes : f.heap_bytes, f.limit_bytes);
    ASSERT_EQ(t_.faults, static_cast<int>(f.failures));  // none but those at the limit
    largest = largest_gap();
    ASSERT_EQ(f.largest_free_bytes, largest);
  }
  // Free blocks are joined, so they are exactly the gaps between live ones.
  std::uint64_t largest_gap() {
    std::uint64_t largest = 0;
    std::byte* end = t_.arena.base() + GetParam().options.alignment - 4;
    for (const auto& [begin, range] : live_) {
      largest = std::max<std::uint64_t>(largest, static_cast<std::uint64_t>(begin - 4 - end));
      end = begin + t_.heap.usable_bytes(begin) + 4;
    }
    std::byte* top = t_.arena.base() + GetParam().options.alignment - 4 + t_.heap.heap_bytes();
    return std::max<std::uint64_t>(largest, static_cast<std::uint64_t>(top - end));
  }

  TestHeap t_;
  std::mt19937_64 random_;
  std::map<std::byte*, Range> live_;
};

TEST_P(HeapModelTest, AgreesWithDisjointRanges) {
  for (int step = 0; step < 4000 && !HasFatalFailure(); ++step) {
    const std::uint64_t choice = below(16);
    if (live_.empty() || choice < 7) {
      allocate();
    } else if (choice < 8) {
      allocate_aligned();
    } else if (choice < 11) {
      reallocate();
    } else {
      release();
    }
    if (step % 64 == 0) expect_sums_hold();
  }
  expect_sums_hold();
  while (!live_.empty() && !HasFatalFailure()) release();
  const HeapFigures f = t_.heap.figures();
  EXPECT_EQ(f.resting_bytes, 0u);
  EXPECT_EQ(f.free_list_length, 1u);
  EXPECT_EQ(f.largest_free_bytes, f.heap_bytes);
  EXPECT_TRUE(t_.heap.check());
}

constexpr HeapPolicy kPolicies[] = {
    HeapPolicy::kFirstFit,  HeapPolicy::kBestFit, HeapPolicy::kNextFit, HeapPolicy::kTlsf,
    HeapPolicy::kFreeRtos4, HeapPolicy::kNewlib,  HeapPolicy::kScatter};

std::vector<Case> cases() {
  std::vector<Case> all;
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    for (const int alignment : {8, 16}) {
      for (const HeapPolicy policy : kPolicies) {
        for (const unsigned rules : {0u, 1u, 2u, 4u, 15u}) {
          if (policy > HeapPolicy::kNextFit && rules != 0 && rules != 15)
            continue;  // its own rules
          all.push_back({seed,
                         {.alignment = alignment,
                          .limit_bytes = 1 << 20,
                          .rules = {.policy = policy,
                                    .remainder_keeps_place = (rules & 1) != 0,
                                    .growth_joins_last_block = (rules & 2) != 0,
                                    .realloc_grows_top = (rules & 4) != 0,
                                    .least_block_bytes = (rules & 8) != 0 ? 48u : 16u,
                                    .poison = (rules & 8) != 0,
                                    .seed = seed}}});
        }
      }
    }
  }
  return all;
}
std::string name_of(const testing::TestParamInfo<Case>& info) {
  std::string name = to_string(info.param.options.rules.policy);
  for (char& c : name) {
    if (std::isalnum(static_cast<unsigned char>(c)) == 0) c = '_';
  }
  return name + "_" + std::to_string(info.index);
}
INSTANTIATE_TEST_SUITE_P(Seeds, HeapModelTest, testing::ValuesIn(cases()), name_of);

}  // namespace
}  // namespace orrery
