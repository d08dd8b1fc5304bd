#include <orrery/harness/heap/arena.hpp>

#include <gtest/gtest.h>

#include <optional>
#include <stdexcept>

namespace orrery {
namespace {

TEST(ArenaTest, LowestFreeSlotIsTaken) {
  std::optional<Arena> first(std::in_place), second(std::in_place);
  const std::byte* first_base = first->base();
  EXPECT_EQ(reinterpret_cast<std::uintptr_t>(first_base),
            Arena::kBase + first->slot() * Arena::kSlot_bytes);
  EXPECT_EQ(second->slot(), first->slot() + 1);
  first.reset();
  first.emplace();
  EXPECT_EQ(first->base(), first_base);
  EXPECT_EQ(Arena::slot_of(second->base() + 12345), second->slot());
  EXPECT_TRUE(Arena::contains(first_base));
  EXPECT_FALSE(Arena::contains(&first));
}

TEST(ArenaTest, MemoryIsZeroAfterReset) {
  Arena arena;
  arena.open(10'000);
  arena.base()[9'999] = std::byte{7};
  arena.reset();
  EXPECT_EQ(arena.base()[9'999], std::byte{0});
}

TEST(ArenaTest, OpensNoMoreThanASlot) {
  Arena arena;
  EXPECT_THROW(arena.open(Arena::kSlot_bytes + 1), std::invalid_argument);
}

TEST(ArenaDeathTest, WhatIsNotOpenFaults) {
  Arena arena;
  arena.open(4096);
  EXPECT_DEATH(const_cast<volatile std::byte*>(arena.base())[4096] = std::byte{1}, "");
}

}  // namespace
}  // namespace orrery
