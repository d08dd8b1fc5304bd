#include <orrery/harness/kernel/inline_function.hpp>

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <memory>
#include <utility>

#include "allocations.hpp"

namespace orrery {
namespace {

using Function = InlineFunction<int(int), 48>;

// Counts the objects alive, to show that moves destroy what they leave.
struct Counted {
  explicit Counted(int& alive) : alive_(&alive) { ++*alive_; }
  Counted(Counted&& other) noexcept : alive_(other.alive_) { ++*alive_; }
  ~Counted() { --*alive_; }
  int operator()(int x) const { return x + 1; }
  int* alive_;
};

TEST(InlineFunctionTest, EmptyIsFalseAndFilledIsTrue) {
  Function empty;
  EXPECT_FALSE(empty);
  Function filled = [](int x) { return 2 * x; };
  ASSERT_TRUE(filled);
  EXPECT_EQ(filled(21), 42);
}

TEST(InlineFunctionTest, MovedFromIsEmptyAndMovedToCalls) {
  int offset = 5;
  Function a = [offset](int x) { return x + offset; };
  Function b = std::move(a);
  EXPECT_FALSE(a);  // NOLINT(bugprone-use-after-move): that is the property
  EXPECT_EQ(b(1), 6);
  a = std::move(b);
  EXPECT_FALSE(b);  // NOLINT(bugprone-use-after-move)
  EXPECT_EQ(a(1), 6);
}

TEST(InlineFunctionTest, HoldsMoveOnlyCaptures) {
  Function f = [p = std::make_unique<int>(7)](int x) { return *p * x; };
  Function g = std::move(f);
  EXPECT_EQ(g(6), 42);
}

TEST(InlineFunctionTest, EveryObjectMadeIsDestroyedOnce) {
  int alive = 0;
  {
    Function a = Counted(alive);
    EXPECT_EQ(alive, 1);
    Function b = std::move(a);
    EXPECT_EQ(alive, 1);
    Function c = Counted(alive);
    EXPECT_EQ(alive, 2);
    c = std::move(b);
    EXPECT_EQ(alive, 1);
    EXPECT_EQ(c(1), 2);
    c = Function();
    EXPECT_EQ(alive, 0);
    a = Counted(alive);
  }
  EXPECT_EQ(alive, 0);
}

TEST(InlineFunctionTest, SelfMoveKeepsTheCallable) {
  int alive = 0;
  Function f = Counted(alive);
  Function& same = f;
  f = std::move(same);
  ASSERT_TRUE(f);
  EXPECT_EQ(f(1), 2);
  EXPECT_EQ(alive, 1);
}

TEST(InlineFunctionTest, FullCapacityIsKeptWithoutAllocation) {
  std::array<std::int64_t, 6> numbers = {1, 2, 3, 4, 5, 6};
  const std::uint64_t before = test::allocations();
  Function f = [numbers](int i) { return static_cast<int>(numbers[i]); };
  Function g = std::move(f);
  const int last = g(5);
  EXPECT_EQ(test::allocations(), before);
  EXPECT_EQ(last, 6);
}

TEST(InlineFunctionTest, CallableKeepsItsStateBetweenCalls) {
  Function f = [sum = 0](int x) mutable { return sum += x; };
  f(1);
  f(2);
  EXPECT_EQ(f(3), 6);
}

TEST(InlineFunctionTest, VoidSignatureDropsTheResult) {
  int calls = 0;
  InlineFunction<void(), 48> f = [&calls] { return ++calls; };
  f();
  EXPECT_EQ(calls, 1);
}

TEST(InlineFunctionTest, ArgumentsAreForwardedNotCopied) {
  InlineFunction<int(std::unique_ptr<int>), 16> f = [](std::unique_ptr<int> p) { return *p; };
  EXPECT_EQ(f(std::make_unique<int>(9)), 9);
}

}  // namespace
}  // namespace orrery
