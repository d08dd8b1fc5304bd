#include <orrery/harness/record/call_queue.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cstdint>
#include <optional>
#include <sched.h>
#include <stdexcept>
#include <string>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>
#include <vector>

namespace orrery {
namespace {

struct Point {
  double x = 0, y = 0;
};

/// Keeps what it is told, and on which thread.
struct Listener {
  void number(int n) { numbers.push_back(n); }
  void mixed(std::string_view text, const Point& point, Bytes bytes, std::optional<int> perhaps,
             char letter) {
    lines.push_back(std::string(text) + " " + std::to_string(point.x) + " " +
                    std::to_string(point.y) + " " + std::to_string(bytes.size()) + " " +
                    (perhaps ? std::to_string(*perhaps) : "none") + " " + letter);
    if (!bytes.empty()) last_byte = bytes.back();
  }
  void nothing() { thread = std::this_thread::get_id(); }
  void count_cores() { sched_getaffinity(0, sizeof cores, &cores); }
  void refuse_from(int n, int last) {
    if (n >= last) throw std::runtime_error("refused " + std::to_string(n));
    numbers.push_back(n);
  }
  void dawdle(int n) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    number(n);
  }

  std::vector<int> numbers;
  std::vector<std::string> lines;
  std::byte last_byte{};
  std::thread::id thread;
  cpu_set_t cores{};
};

// More than all blocks hold at once: 400,000 calls of 32 bytes are 12.8 MB.
TEST(CallQueueTest, CallsAreMadeInOrderAndAllOfThem) {
  Listener listener;
  CallQueue queue;
  for (int i = 0; i < 400'000; ++i) queue.put(listener, &Listener::number, i);
  queue.finish();
  ASSERT_EQ(listener.numbers.size(), 400'000u);
  for (int i = 0; i < 400'000; ++i) ASSERT_EQ(listener.numbers[i], i);
}

TEST(CallQueueTest, ArgumentsAreCopiedWhenPut) {
  Listener listener;
  CallQueue queue;
  std::string text = "seven c";  // a word less one, so that what follows must find its place
  ByteBuffer bytes(300'000, std::byte{1});  // longer than a block
  bytes.back() = std::byte{42};
  queue.put(listener, &Listener::mixed, text, Point{1, 2}, bytes, std::nullopt, 'a');
  text = "changed";
  bytes.assign(bytes.size(), std::byte{0});
  queue.put(listener, &Listener::mixed, text, Point{3, 4}, {}, 5, 'b');
  queue.put(listener, &Listener::mixed, "", {}, {}, {}, 'c');
  queue.finish();
  EXPECT_THAT(listener.lines, testing::ElementsAre("seven c 1.000000 2.000000 300000 none a",
                                                   "changed 3.000000 4.000000 0 5 b",
                                                   " 0.000000 0.000000 0 none c"));
  EXPECT_EQ(listener.last_byte, std::byte{42});
}

TEST(CallQueueTest, AnotherThreadMakesTheCalls) {
  Listener listener;
  CallQueue queue;
  queue.put(listener, &Listener::nothing);
  queue.finish();
  EXPECT_NE(listener.thread, std::thread::id());
  EXPECT_NE(listener.thread, std::this_thread::get_id());
}

TEST(CallQueueTest, TheOtherThreadRunsAnywhereThoughThisOneKeepsToACore) {
  cpu_set_t before, one;
  ASSERT_EQ(sched_getaffinity(0, sizeof before, &before), 0);
  CPU_ZERO(&one);
  CPU_SET(sched_getcpu(), &one);
  ASSERT_EQ(sched_setaffinity(0, sizeof one, &one), 0);
  Listener listener;
  CallQueue queue;
  queue.put(listener, &Listener::count_cores);
  queue.finish();
  sched_setaffinity(0, sizeof before, &before);
  EXPECT_TRUE(CPU_EQUAL(&listener.cores, &before));
}

TEST(CallQueueTest, WhatIsLeftIsDoneBeforeItGoes) {
  Listener listener;
  {
    CallQueue queue;
    for (int i = 0; i < 20; ++i) queue.put(listener, &Listener::dawdle, i);
  }
  EXPECT_EQ(listener.numbers.size(), 20u);
}

TEST(CallQueueTest, AnErrorEndsTheCallsAndIsThrownHere) {
  Listener listener;
  CallQueue queue;
  for (int i = 0; i < 10; ++i) queue.put(listener, &Listener::refuse_from, i, 3);
  EXPECT_THAT([&] { queue.finish(); }, testing::ThrowsMessage<std::runtime_error>("refused 3"));
  EXPECT_THAT(listener.numbers, testing::ElementsAre(0, 1, 2));
  // A producer that goes on learns of it as well: at the latest when all blocks were full once.
  EXPECT_THROW(for (int i = 0; i < 400'000; ++i) queue.put(listener, &Listener::number, i),
               std::runtime_error);
  EXPECT_EQ(listener.numbers.size(), 3u);
}

// Whoever gives up goes without finish(), and the queue with the thread still there.
TEST(CallQueueTest, GoesQuietlyAfterAnError) {
  Listener listener;
  {
    CallQueue queue;
    queue.put(listener, &Listener::refuse_from, 0, 0);
    EXPECT_THROW(for (int i = 0; i < 400'000; ++i) queue.put(listener, &Listener::number, i),
                 std::runtime_error);
  }
  EXPECT_TRUE(listener.numbers.empty());
}

// As a world's branches do: both processes go on with calls of their own.
TEST(CallQueueTest, BothSidesOfAForkGoOn) {
  Listener listener;
  CallQueue queue;
  queue.put(listener, &Listener::number, 1);
  queue.finish();
  const pid_t child = fork();
  if (child == 0) {
    queue.put(listener, &Listener::number, 2);
    queue.finish();
    _exit(listener.numbers == std::vector<int>{1, 2} ? 0 : 1);
  }
  queue.put(listener, &Listener::number, 3);
  queue.finish();
  EXPECT_THAT(listener.numbers, testing::ElementsAre(1, 3));
  int status = -1;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  EXPECT_EQ(status, 0);
}

// A death test's child has the queue but not its thread: it must not wait for it.
TEST(CallQueueTest, AChildWithoutTheThreadDropsItsCalls) {
  Listener listener;
  CallQueue queue;
  for (int i = 0; i < 20'000; ++i) queue.put(listener, &Listener::number, i);  // two blocks
  const pid_t child = fork();
  if (child == 0) {
    const std::size_t before = listener.numbers.size();
    for (int i = 0; i < 400'000; ++i) queue.put(listener, &Listener::number, i);
    queue.finish();
    _exit(listener.numbers.size() == before ? 0 : 1);
  }
  queue.finish();
  EXPECT_EQ(listener.numbers.size(), 20'000u);
  int status = -1;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  EXPECT_EQ(status, 0);
}

}  // namespace
}  // namespace orrery
