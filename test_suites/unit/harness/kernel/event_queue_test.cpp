#include <orrery/harness/kernel/event_queue.hpp>
#include <orrery/harness/kernel/random.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "allocations.hpp"

namespace orrery {
namespace {

constexpr EventKind kKind = {1, "test"};
constexpr SimTime kForever = SimTime::max();

SimTime at(std::int64_t ns) {
  return from_ns(ns);
}

struct EventQueueTest : testing::Test {
  EventHandle push(const EventKey& key) {
    return queue.push(key, &kKind, [] {});
  }
  std::vector<EventKey> pop_all() {
    std::vector<EventKey> keys;
    Event event;
    while (queue.pop(kForever, event)) keys.push_back(event.key);
    return keys;
  }
  EventQueue queue;
};

TEST_F(EventQueueTest, EarlierEventsPopFirst) {
  push({.t = at(30)});
  push({.t = at(10)});
  push({.t = at(20)});
  EXPECT_EQ(pop_all(), (std::vector<EventKey>{{.t = at(10)}, {.t = at(20)}, {.t = at(30)}}));
}

// Of 300 origins, two messages each in two phases at two instants.
std::vector<EventKey> shuffled_keys(std::uint64_t seed) {
  EventQueue queue;
  queue.shuffle_ties(seed);
  for (OwnerId origin = 300; origin-- > 0;) {
    for (std::uint64_t counter = 4; counter-- > 0;) {
      const Phase phase = counter % 2 == 0 ? Phase::kDelivery : Phase::kTick;
      for (const SimTime t : {at(1), at(2)}) {
        queue.push({t, phase, static_cast<OwnerId>(origin % 7), origin, counter}, &kKind, [] {});
      }
    }
  }
  std::vector<EventKey> keys;
  Event event;
  while (queue.pop(kForever, event)) keys.push_back(event.key);
  return keys;
}

std::vector<OwnerId> origins_of(const std::vector<EventKey>& keys, SimTime t) {
  std::vector<OwnerId> origins;
  for (const EventKey& key : keys) {
    if (key.t == t && key.phase == Phase::kDelivery && key.counter == 0) {
      origins.push_back(key.origin);
    }
  }
  return origins;
}

TEST(ShuffledTiesTest, OriginsComeInADrawnOrderAndAllElseInItsOwn) {
  const std::vector<EventKey> keys = shuffled_keys(5);
  ASSERT_EQ(keys.size(), 2400u);
  std::map<std::pair<OwnerId, Phase>, EventKey> last;
  for (std::size_t i = 0; i < keys.size(); ++i) {
    if (i > 0) {
      EXPECT_LE(std::pair(keys[i - 1].t, keys[i - 1].phase), std::pair(keys[i].t, keys[i].phase));
    }
    const auto [of_origin, is_first] = last.try_emplace({keys[i].origin, keys[i].phase}, keys[i]);
    if (!is_first) {
      EXPECT_LT(of_origin->second, keys[i]);
    }
    of_origin->second = keys[i];
  }
  const std::vector<OwnerId> order = origins_of(keys, at(1));
  EXPECT_EQ(order.size(), 300u);
  EXPECT_FALSE(std::is_sorted(order.begin(), order.end()));
  EXPECT_NE(order, origins_of(keys, at(2)));  // anew at each instant
  EXPECT_EQ(keys, shuffled_keys(5));
  EXPECT_NE(order, origins_of(shuffled_keys(6), at(1)));
}

TEST_F(EventQueueTest, TiesAreShuffledBeforeTheFirstEventAlone) {
  push({.t = at(1)});
  EXPECT_THROW(queue.shuffle_ties(1), std::logic_error);
}

// Each key is less than the next by one field alone, the fields after it being larger.
TEST_F(EventQueueTest, EqualTimesPopByPhaseDestinationOriginCounter) {
  const std::vector<EventKey> ordered = {
      {at(-5), Phase::kRecorder, 9, 9, 9},        {at(0), Phase::kFault, 9, 9, 9},
      {at(0), Phase::kDevice, 1, 9, 9},           {at(0), Phase::kDevice, 2, 1, 9},
      {at(0), Phase::kDevice, 2, 2, 1},           {at(0), Phase::kDevice, 2, 2, 2},
      {at(0), Phase::kDevice, 2, 254, 9},         {at(0), Phase::kDevice, 2, 255, 9},
      {at(0), Phase::kDevice, 2, 256, 8},         {at(0), Phase::kDevice, 2, 256, 9},
      {at(0), Phase::kDevice, 2, 65534, 0},       {at(0), Phase::kDevice, 65534, 0, 0},
      {at(0), Phase::kRecorder, 0, 0, 0},         {at(0), Phase::kRecorder, 0, 0, 1ull << 40},
      {at(0), Phase::kRecorder, 0, 0, 1ull << 63}};
  for (auto key = ordered.rbegin(); key != ordered.rend(); ++key) push(*key);
  EXPECT_EQ(pop_all(), ordered);
}

TEST_F(EventQueueTest, PopsNothingAfterTheLatestTimeAsked) {
  push({.t = at(10)});
  Event event;
  EXPECT_FALSE(queue.pop(at(9), event));
  EXPECT_EQ(queue.size(), 1u);
  EXPECT_TRUE(queue.pop(at(10), event));
  EXPECT_FALSE(queue.pop(kForever, event));
}

TEST_F(EventQueueTest, PoppedEventCarriesKindAndAction) {
  int calls = 0;
  queue.push({.t = at(1)}, &kKind, [&calls] { ++calls; });
  Event event;
  ASSERT_TRUE(queue.pop(kForever, event));
  EXPECT_EQ(event.kind, &kKind);
  EXPECT_EQ(calls, 0);
  event.action();
  EXPECT_EQ(calls, 1);
}

TEST_F(EventQueueTest, EarlierPhaseOfTheCurrentInstantPopsNext) {
  push({.t = at(10), .phase = Phase::kTest});
  push({.t = at(10), .phase = Phase::kTest, .counter = 1});
  Event event;
  ASSERT_TRUE(queue.pop(kForever, event));
  push({.t = at(10), .phase = Phase::kDelivery, .counter = 2});
  ASSERT_TRUE(queue.pop(kForever, event));
  EXPECT_EQ(event.key.phase, Phase::kDelivery);
}

TEST_F(EventQueueTest, PushBeforeTheLastPoppedInstantGivesBothTimes) {
  push({.t = gps_midnight(2025, 3, 20)});
  pop_all();
  push({.t = gps_midnight(2025, 3, 20)});
  try {
    push({.t = gps_midnight(2025, 3, 20) - 1ns});
    FAIL() << "an event in the past was accepted";
  } catch (const std::invalid_argument& error) {
    EXPECT_STREQ(error.what(),
                 "EventQueue::push: t = 2025-03-19T23:59:59.999999999 GPST is before the last "
                 "popped event, 2025-03-20T00:00:00.000000000 GPST");
  }
  EXPECT_EQ(queue.size(), 1u);
}

TEST_F(EventQueueTest, EmptyActionIsRejected) {
  EXPECT_THROW(queue.push({.t = at(1)}, &kKind, Action()), std::invalid_argument);
}

TEST_F(EventQueueTest, CancelledEventDoesNotPop) {
  push({.t = at(1)});
  const EventHandle handle = push({.t = at(2)});
  push({.t = at(3)});
  EXPECT_TRUE(queue.cancel(handle));
  EXPECT_EQ(queue.size(), 2u);
  EXPECT_EQ(pop_all(), (std::vector<EventKey>{{.t = at(1)}, {.t = at(3)}}));
}

TEST_F(EventQueueTest, CancelIsFalseForWhatIsNotPending) {
  EXPECT_FALSE(queue.cancel(EventHandle()));
  EXPECT_FALSE(queue.cancel({.slot = 7, .generation = 1}));
  const EventHandle fired = push({.t = at(1)});
  pop_all();
  EXPECT_FALSE(queue.cancel(fired));
  const EventHandle twice = push({.t = at(2)});
  EXPECT_TRUE(queue.cancel(twice));
  EXPECT_FALSE(queue.cancel(twice));
}

TEST_F(EventQueueTest, StaleHandleDoesNotCancelTheSlotsNextEvent) {
  const EventHandle stale = push({.t = at(1)});
  pop_all();
  const EventHandle fresh = push({.t = at(2)});
  ASSERT_EQ(fresh.slot, stale.slot) << "the slot was not used again: the test shows nothing";
  EXPECT_FALSE(queue.cancel(stale));
  EXPECT_EQ(queue.size(), 1u);
  EXPECT_TRUE(queue.cancel(fresh));
}

TEST_F(EventQueueTest, CancelDestroysTheActionAtOnce) {
  auto resource = std::make_shared<int>(1);
  const EventHandle handle = queue.push({.t = at(1)}, &kKind, [resource] {});
  EXPECT_EQ(resource.use_count(), 2);
  queue.cancel(handle);
  EXPECT_EQ(resource.use_count(), 1);
}

TEST_F(EventQueueTest, DestructorOfACancelledActionMayPush) {
  struct PushesWhenDestroyed {
    explicit PushesWhenDestroyed(EventQueueTest* test) : test_(test) {}
    PushesWhenDestroyed(PushesWhenDestroyed&& other) noexcept
        : test_(std::exchange(other.test_, nullptr)) {}
    ~PushesWhenDestroyed() {
      if (test_ == nullptr) return;
      for (int i = 0; i < 100; ++i) test_->push({.t = at(i), .origin = 1});
    }
    void operator()() const {}
    EventQueueTest* test_;
  };
  const EventHandle handle = queue.push({.t = at(1)}, &kKind, PushesWhenDestroyed(this));
  EXPECT_TRUE(queue.cancel(handle));
  EXPECT_EQ(queue.size(), 100u);
  EXPECT_EQ(pop_all().size(), 100u);
}

TEST_F(EventQueueTest, NextTimePassesOverCancelledEvents) {
  EXPECT_EQ(queue.next_time(), std::nullopt);
  const EventHandle first = push({.t = at(1)});
  push({.t = at(2)});
  push({.t = at(3)});
  EXPECT_EQ(queue.next_time(), at(1));
  queue.cancel(first);
  EXPECT_EQ(queue.next_time(), at(2));
  EXPECT_EQ(queue.size(), 2u);
}

TEST_F(EventQueueTest, DeadEntriesNeverExceedHalfTheHeap) {
  std::vector<EventHandle> handles;
  for (int i = 0; i < 1000; ++i) handles.push_back(push({.t = at(i)}));
  for (int i = 999; i >= 0; --i) {
    queue.cancel(handles[i]);
    EXPECT_LE(queue.entries(), 2 * queue.size());
  }
  EXPECT_EQ(queue.entries(), 0u);
}

// A timer that is set again and again, as flight software does: its dead entries lie far ahead.
TEST_F(EventQueueTest, TimerSetAgainManyTimesKeepsTheQueueSmall) {
  EventHandle timer = push({.t = at(1'000'000)});
  for (int i = 0; i < 10'000; ++i) {
    ASSERT_TRUE(queue.cancel(timer));
    timer = push({.t = at(1'000'000 + i), .counter = static_cast<std::uint64_t>(i)});
  }
  EXPECT_EQ(queue.size(), 1u);
  EXPECT_LE(queue.slots(), 4u);
}

TEST_F(EventQueueTest, SteadyStateAllocatesNothing) {
  RandomStream random(1);
  std::uint64_t counter = 0;
  for (int i = 0; i < 1000; ++i) push({.t = at(random.integer(0, 1000)), .counter = counter++});
  const auto hold = [&](int events) {
    for (int i = 0; i < events; ++i) {
      Event event;
      queue.pop(kForever, event);
      const EventHandle cancelled =
          push({.t = event.key.t + Duration(random.integer(0, 1000)), .counter = counter++});
      push({.t = event.key.t + Duration(random.integer(0, 1000)), .counter = counter++});
      queue.cancel(cancelled);
    }
  };
  hold(10'000);
  const std::uint64_t before = test::allocations();
  hold(100'000);
  EXPECT_EQ(test::allocations(), before);
}

// The queue against a sorted map, over random operations with many ties, origins on both sides of
// 255, live and stale handles.
struct EventQueueModelTest : testing::TestWithParam<std::uint64_t> {
  struct Issued {
    EventHandle handle;
    EventKey key;
  };

  EventKey random_key() {
    EventKey key;
    key.t = now + Duration(random.integer(0, 20));
    key.phase = static_cast<Phase>(random.integer(0, 6));
    key.destination = static_cast<OwnerId>(random.integer(0, 2));
    key.origin = static_cast<OwnerId>(random.integer(0, 1) * 253 + random.integer(0, 3));
    key.counter = counter++;
    return key;
  }
  void push() {
    const EventKey key = random_key();
    const std::uint64_t id = key.counter;
    issued.push_back({queue.push(key, &kKind, [this, id] { ran = id; }), key});
    model.emplace(key, id);
  }
  void pop() {
    const SimTime latest = now + Duration(random.integer(0, 10));
    const bool expected = !model.empty() && model.begin()->first.t <= latest;
    Event event;
    ASSERT_EQ(queue.pop(latest, event), expected);
    if (!expected) {
      now = latest;
      return;
    }
    ASSERT_EQ(event.key, model.begin()->first);
    event.action();
    ASSERT_EQ(ran, model.begin()->second);
    now = event.key.t;
    model.erase(model.begin());
  }
  // Mostly one of the last hundred, which is likely to be pending still.
  void cancel() {
    if (issued.empty()) return;
    const auto count = static_cast<std::int64_t>(issued.size());
    const std::int64_t first = random.bernoulli(0.8) ? std::max<std::int64_t>(0, count - 100) : 0;
    const Issued& one = issued[random.integer(first, count - 1)];
    ASSERT_EQ(queue.cancel(one.handle), model.erase(one.key) == 1);
  }
  void check() {
    ASSERT_EQ(queue.size(), model.size());
    ASSERT_LE(queue.entries(), 2 * queue.size());
  }

  EventQueue queue;
  std::map<EventKey, std::uint64_t> model;
  std::vector<Issued> issued;
  RandomStream random = RandomStream(GetParam());
  SimTime now = from_ns(0);
  std::uint64_t counter = 0;
  std::uint64_t ran = 0;
};

TEST_P(EventQueueModelTest, AgreesWithASortedMap) {
  // Pushes and pops in ten operations; the rest cancel. The heap grows, is drained, grows, and is
  // thinned out until it is compacted.
  constexpr int kWaves[4][2] = {{6, 2}, {2, 6}, {6, 2}, {2, 1}};
  for (int wave = 0; wave < 12; ++wave) {
    const auto [pushes, pops] = kWaves[wave % 4];
    for (int i = 0; i < 1000; ++i) {
      const std::int64_t choice = random.integer(0, 9);
      if (choice < pushes) {
        push();
      } else if (choice < pushes + pops) {
        pop();
      } else {
        cancel();
      }
      check();
      if (HasFatalFailure()) return;
    }
  }
  now = now + 1h;
  while (!model.empty()) {
    pop();
    if (HasFatalFailure()) return;
  }
  EXPECT_EQ(queue.size(), 0u);
}

INSTANTIATE_TEST_SUITE_P(Seeds, EventQueueModelTest, testing::Range<std::uint64_t>(1, 41));

}  // namespace
}  // namespace orrery
