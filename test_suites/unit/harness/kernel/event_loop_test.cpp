#include <orrery/harness/kernel/event_loop.hpp>
#include <orrery/harness/kernel/random.hpp>
#include <orrery/harness/kernel/sim_state.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "allocations.hpp"

namespace orrery {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr EventKind kBeep = {1001, "beep"};
constexpr EventKind kRecord = {1002, "record"};

struct EventLoopTest : testing::Test {
  EventLoopTest() {
    chief = loop.add_owner("chief");
    deputy = loop.add_owner("deputy");
  }
  EventSpec spec(Phase phase = Phase::kDevice) const { return {phase, chief, chief, &kBeep}; }
  EventHandle note(Duration after, const char* text, Phase phase = Phase::kDevice) {
    return loop.schedule(start + after, spec(phase), [this, text] { notes.push_back(text); });
  }

  const SimTime start = gps_midnight(2025, 3, 20);
  EventLoop loop = EventLoop(start);
  OwnerId chief = 0;
  OwnerId deputy = 0;
  std::vector<std::string> notes;
};

TEST_F(EventLoopTest, RunsWhatIsDueIncludingTheLastInstant) {
  note(2s, "second");
  note(1s, "first");
  note(2s + 1ns, "late");
  loop.run_until(start + 2s);
  EXPECT_THAT(notes, ElementsAre("first", "second"));
  EXPECT_EQ(loop.now(), start + 2s);
  EXPECT_EQ(loop.events_pending(), 1u);
  EXPECT_EQ(loop.events_executed(), 2u);
}

TEST_F(EventLoopTest, NowIsTheEventsInstantWhileItRuns) {
  SimTime seen;
  loop.schedule(start + 1s, spec(), [&] { seen = loop.now(); });
  loop.run_until(start + 10s);
  EXPECT_EQ(seen, start + 1s);
}

TEST_F(EventLoopTest, EqualKeysOfOneOriginRunInTheOrderScheduled) {
  note(1s, "a");
  note(1s, "b");
  note(1s, "c");
  loop.run_until(start + 1s);
  EXPECT_THAT(notes, ElementsAre("a", "b", "c"));
}

TEST_F(EventLoopTest, EarlierPhaseAtTheCurrentInstantRunsNext) {
  loop.schedule(start + 1s, spec(Phase::kOutput), [this] {
    notes.push_back("output");
    note(1s, "delivery", Phase::kDelivery);
  });
  note(1s, "test", Phase::kTest);
  loop.run_until(start + 1s);
  EXPECT_THAT(notes, ElementsAre("output", "delivery", "test"));
}

TEST_F(EventLoopTest, EventInThePastGivesBothTimes) {
  loop.run_until(start + 1s);
  try {
    note(999ms, "late");
    FAIL() << "an event in the past was accepted";
  } catch (const std::invalid_argument& error) {
    EXPECT_STREQ(error.what(),
                 "EventLoop::schedule: t = 2025-03-20T00:00:00.999000000 GPST is before now, "
                 "2025-03-20T00:00:01.000000000 GPST");
  }
}

TEST_F(EventLoopTest, UnknownOwnersNullKindsAndEmptyActionsAreRejected) {
  const auto nothing = [] {};
  EXPECT_THROW(loop.schedule(start, {Phase::kTick, 2, chief, &kBeep}, nothing),
               std::invalid_argument);
  EXPECT_THROW(loop.schedule(start, {Phase::kTick, chief, 2, &kBeep}, nothing),
               std::invalid_argument);
  EXPECT_THROW(loop.schedule(start, {Phase::kTick, chief, chief, nullptr}, nothing),
               std::invalid_argument);
  EXPECT_THROW(loop.schedule(start, spec(), Action()), std::invalid_argument);
  EXPECT_EQ(loop.events_pending(), 0u);
}

// A rejected call must not use up a counter, or the keys of what follows would tell of it.
TEST_F(EventLoopTest, RejectedScheduleLeavesNoTraceInTheFingerprint) {
  EventLoop other(start);
  other.add_owner("chief");
  other.add_owner("deputy");
  EXPECT_THROW(loop.schedule(start, spec(), Action()), std::invalid_argument);
  loop.schedule(start, spec(), [] {});
  other.schedule(start, spec(), [] {});
  loop.run_until(start);
  other.run_until(start);
  EXPECT_EQ(loop.fingerprint().value(), other.fingerprint().value());
}

TEST_F(EventLoopTest, CancelledEventDoesNotRun) {
  const EventHandle handle = note(1s, "cancelled");
  note(2s, "kept");
  EXPECT_TRUE(loop.cancel(handle));
  EXPECT_FALSE(loop.cancel(handle));
  loop.run_until(start + 3s);
  EXPECT_THAT(notes, ElementsAre("kept"));
  EXPECT_EQ(loop.events_executed(), 1u);
}

TEST_F(EventLoopTest, RunningEventCannotCancelItself) {
  EventHandle self;
  bool cancelled = true;
  self = loop.schedule(start + 1s, spec(), [&] { cancelled = loop.cancel(self); });
  loop.run_until(start + 1s);
  EXPECT_FALSE(cancelled);
}

TEST_F(EventLoopTest, RunNextExecutesOneAndLeavesNowWhenNoneIsDue) {
  note(1s, "first");
  note(2s, "second");
  EXPECT_TRUE(loop.run_next(start + 1s));
  EXPECT_FALSE(loop.run_next(start + 1s + 999ms));
  EXPECT_EQ(loop.now(), start + 1s);
  EXPECT_THAT(notes, ElementsAre("first"));
}

TEST_F(EventLoopTest, RunUntilThePastIsRejected) {
  loop.run_until(start + 1s);
  EXPECT_THROW(loop.run_until(start), std::invalid_argument);
}

TEST_F(EventLoopTest, AdvanceStopsShortOfPendingEvents) {
  const EventHandle handle = note(5s, "pending");
  loop.advance_to(start + 5s - 1ns);
  EXPECT_EQ(loop.now(), start + 5s - 1ns);
  EXPECT_THROW(loop.advance_to(start + 5s), std::logic_error);
  EXPECT_THROW(loop.advance_to(start), std::logic_error);
  loop.cancel(handle);
  loop.advance_to(start + 1h);
  EXPECT_EQ(loop.now(), start + 1h);
  EXPECT_EQ(loop.next_event_time(), std::nullopt);
}

TEST_F(EventLoopTest, ActionsMayNotRunTheLoop) {
  loop.schedule(start + 1s, spec(), [&] { loop.run_until(start + 2s); });
  try {
    loop.run_until(start + 3s);
    FAIL() << "the loop ran inside itself";
  } catch (const std::logic_error& error) {
    EXPECT_THAT(error.what(), HasSubstr("called from event 'beep'"));
  }
}

TEST_F(EventLoopTest, ExceptionLeavesTheLoopWholeAndItCanGoOn) {
  loop.keep_log(true);
  loop.schedule(start + 1s, spec(), [&] {
    loop.fingerprint_payload(std::as_bytes(std::span("payload")));
    throw std::runtime_error("flight software said no");
  });
  note(2s, "after");
  EXPECT_THROW(loop.run_until(start + 3s), std::runtime_error);
  EXPECT_EQ(loop.now(), start + 1s);
  EXPECT_EQ(loop.current_kind(), nullptr);
  EXPECT_EQ(loop.events_executed(), 1u);
  ASSERT_EQ(loop.log().size(), 1u);
  EXPECT_EQ(loop.log()[0].chain, loop.fingerprint().chain(chief));
  loop.run_until(start + 3s);
  EXPECT_THAT(notes, ElementsAre("after"));
}

TEST_F(EventLoopTest, CurrentKindNamesTheRunningEvent) {
  const EventKind* during = nullptr;
  loop.schedule(start, spec(), [&] { during = loop.current_kind(); });
  EXPECT_EQ(loop.current_kind(), nullptr);
  loop.run_until(start);
  EXPECT_EQ(during, &kBeep);
  EXPECT_EQ(loop.current_kind(), nullptr);
}

TEST_F(EventLoopTest, DebuggerVariablesFollowTheLoop) {
  std::int64_t ns = 0;
  std::uint64_t number = 0;
  note(1s, "first");
  loop.schedule(start + 2s, spec(), [&] {
    ns = sim_now;
    number = sim_event;
  });
  EXPECT_EQ(sim_now, to_ns(start));
  EXPECT_EQ(sim_event, 0u);
  loop.run_until(start + 5s);
  EXPECT_EQ(ns, to_ns(start + 2s));
  EXPECT_EQ(number, 2u);
  EXPECT_EQ(sim_now, to_ns(start + 5s));
  EXPECT_STREQ(sim_process, "");
}

TEST_F(EventLoopTest, OwnersAreNumberedAsDeclared) {
  EXPECT_EQ(chief, 0);
  EXPECT_EQ(deputy, 1);
  EXPECT_EQ(loop.owner_name(deputy), "deputy");
  EXPECT_EQ(loop.owner_count(), 2u);
  EXPECT_THROW(loop.owner_name(2), std::out_of_range);
  for (int i = 2; i < 65535; ++i) loop.add_owner("more");
  EXPECT_THROW(loop.add_owner("one too many"), std::length_error);
}

TEST_F(EventLoopTest, PayloadOutsideAnEventIsRejected) {
  EXPECT_THROW(loop.fingerprint_payload({}), std::logic_error);
}

TEST_F(EventLoopTest, PayloadEntersTheFingerprintOfTheDestination) {
  loop.schedule(start, {Phase::kDelivery, deputy, chief, &kBeep}, [&] {
    const std::uint64_t chief_before = loop.fingerprint().chain(chief);
    const std::uint64_t deputy_before = loop.fingerprint().chain(deputy);
    loop.fingerprint_payload(std::as_bytes(std::span("payload")));
    EXPECT_EQ(loop.fingerprint().chain(chief), chief_before);
    EXPECT_NE(loop.fingerprint().chain(deputy), deputy_before);
  });
  loop.run_until(start);
}

TEST_F(EventLoopTest, LogKeepsKeyKindAndChainOfEachEvent) {
  note(1s, "before the log");
  loop.run_until(start + 1s);
  loop.keep_log(true);
  loop.schedule(start + 2s, {Phase::kTick, deputy, chief, &kBeep},
                [&] { loop.fingerprint_payload(std::as_bytes(std::span("x"))); });
  loop.run_until(start + 2s);
  ASSERT_EQ(loop.log().size(), 1u);
  EXPECT_EQ(loop.log()[0].key, (EventKey{start + 2s, Phase::kTick, deputy, chief, 1}));
  EXPECT_EQ(loop.log()[0].kind, &kBeep);
  EXPECT_EQ(loop.log()[0].chain, loop.fingerprint().chain(deputy));
}

// A small world of two spacecraft that answer each other after random delays.
struct PingPong {
  explicit PingPong(std::uint64_t seed, bool recording = false)
      : random(seed),
        loop(from_ns(0)),
        a(loop.add_owner("a")),
        b(loop.add_owner("b")),
        test(loop.add_owner("test")) {
    loop.keep_log(true);
    send(a, b);
    send(b, a);
    if (recording) record();
  }
  void send(OwnerId from, OwnerId to) {
    const Duration delay = from_seconds(random.exponential(1.0));
    loop.schedule(loop.now() + delay, {Phase::kDelivery, to, from, &kBeep}, [this, from, to] {
      const std::uint64_t payload = random.bits();
      loop.fingerprint_payload(std::as_bytes(std::span(&payload, 1)));
      send(to, from);
    });
  }
  void record() {
    loop.schedule(loop.now() + 1s, {Phase::kRecorder, a, a, &kRecord}, [this] {
      loop.fingerprint_payload(std::as_bytes(std::span("recorded")));
      record();
    });
  }
  RandomStream random;
  EventLoop loop;
  OwnerId a;
  OwnerId b;
  OwnerId test;
};

TEST(EventLoopFingerprintTest, EqualRunsHaveEqualFingerprintsAndLogs) {
  PingPong first(1);
  PingPong second(1);
  first.loop.run_until(from_ns(0) + 100s);
  second.loop.run_until(from_ns(0) + 100s);
  EXPECT_GT(first.loop.events_executed(), 100u);
  EXPECT_EQ(first.loop.fingerprint().value(), second.loop.fingerprint().value());
  EXPECT_FALSE(first_difference(first.loop.log(), second.loop.log()));
}

TEST(EventLoopFingerprintTest, AnotherSeedChangesTheFingerprint) {
  PingPong first(1);
  PingPong second(2);
  first.loop.run_until(from_ns(0) + 100s);
  second.loop.run_until(from_ns(0) + 100s);
  EXPECT_NE(first.loop.fingerprint().value(), second.loop.fingerprint().value());
  EXPECT_TRUE(first_difference(first.loop.log(), second.loop.log()));
}

TEST(EventLoopFingerprintTest, RecordingChangesNothing) {
  PingPong without(1, false);
  PingPong with(1, true);
  without.loop.run_until(from_ns(0) + 100s);
  with.loop.run_until(from_ns(0) + 100s);
  EXPECT_EQ(without.loop.fingerprint().value(), with.loop.fingerprint().value());
  EXPECT_EQ(without.loop.events_executed(), with.loop.events_executed());
  EXPECT_FALSE(first_difference(without.loop.log(), with.loop.log()));
}

TEST(EventLoopFingerprintTest, SplittingARunChangesNothing) {
  PingPong whole(3);
  PingPong pieces(3);
  whole.loop.run_until(from_ns(0) + 100s);
  for (int i = 1; i <= 1000; ++i) pieces.loop.run_until(from_ns(0) + i * 100ms);
  EXPECT_EQ(whole.loop.fingerprint().value(), pieces.loop.fingerprint().value());
}

TEST(EventLoopFingerprintTest, FirstDifferenceNamesTheEventThatWasAdded) {
  PingPong first(1);
  PingPong second(1);
  second.loop.schedule(from_ns(0) + 50s, {Phase::kTest, second.test, second.test, &kBeep}, [] {});
  first.loop.run_until(from_ns(0) + 100s);
  second.loop.run_until(from_ns(0) + 100s);
  const auto difference = first_difference(first.loop.log(), second.loop.log());
  ASSERT_TRUE(difference);
  EXPECT_EQ(difference->b->key.t, from_ns(0) + 50s);
  EXPECT_EQ(difference->b->key.phase, Phase::kTest);
}

TEST_F(EventLoopTest, SteadyStateAllocatesNothing) {
  RandomStream random(1);
  struct Hold {
    EventLoop* loop;
    RandomStream* random;
    void operator()() const {
      const Duration delay = from_seconds(random->exponential(1.0));
      loop->schedule(loop->now() + delay, {Phase::kDevice, 0, 0, &kBeep}, *this);
    }
  };
  for (int i = 0; i < 1000; ++i) Hold{&loop, &random}();
  loop.run_until(start + 10s);
  const std::uint64_t before = test::allocations();
  const std::uint64_t executed = loop.events_executed();
  loop.run_until(start + 100s);
  EXPECT_EQ(test::allocations(), before);
  EXPECT_GT(loop.events_executed(), executed + 80'000);
}

}  // namespace
}  // namespace orrery
