#include <orrery/harness/flight/flight_computer.hpp>
#include <orrery/harness/heap/simulated_heap.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "orders.hpp"

namespace orrery {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr SimTime kStart = from_ns(1'000'000'000'000);

// One spacecraft and somebody who talks to it. What comes out is noted as "<time from start, us>
// <text>".
class FlightComputerTest : public testing::Test {
 protected:
  FlightComputerTest() : loop_(kStart), test_(loop_.add_owner("test")) {
    spacecraft_ = loop_.add_owner("dsc");
  }
  void fly(FlightProcessOptions options) {
    options.spacecraft = "dsc";
    if (options.library.empty()) options.library = "flight_test_subject";
    FlightComputer::Hooks hooks;
    hooks.on_output = [this](std::string_view port, Bytes bytes) {
      note(port == "times" ? std::string(1, static_cast<char>(bytes[0])) + " " +
                                 std::to_string((time_of(bytes) - to_ns(kStart)) / 1000)
                           : text_of(bytes));
    };
    hooks.on_log = [this](LogLevel, std::string_view line) { logs_.emplace_back(line); };
    hooks.on_crash = [this](const CrashReport& crash) { crashes_.push_back(crash); };
    hooks.on_call = [this](const CallRecord& record) { records_.push_back(record); };
    computer_ = std::make_unique<FlightComputer>(loop_, spacecraft_, std::move(options), hooks);
    computer_->boot();
  }
  void note(const std::string& text) {
    notes_.push_back(std::to_string(to_ns(loop_.now() - kStart) / 1000) + " " + text);
  }
  void at(Duration after_start, const ByteBuffer& message, const std::string& port = "do") {
    loop_.schedule(kStart + after_start, {Phase::kDevice, test_, test_, &kTell},
                   [this, message = std::make_shared<ByteBuffer>(message),
                    port = std::make_shared<std::string>(port)] {
                     computer_->deliver(*port, *message, test_);
                   });
  }
  void run_for(Duration d) { loop_.run_until(loop_.now() + d); }

  static constexpr EventKind kTell{1000, "tell"};
  EventLoop loop_;
  OwnerId test_, spacecraft_ = 0;
  std::unique_ptr<FlightComputer> computer_;
  std::vector<std::string> notes_, logs_;
  std::vector<CrashReport> crashes_;
  std::vector<CallRecord> records_;
};

TEST_F(FlightComputerTest, InputIsAnsweredAtTheSameInstant) {
  fly({});
  at(5us, order("eping"));
  run_for(1ms);
  EXPECT_THAT(notes_, ElementsAre("5 ping"));
  EXPECT_EQ(computer_->calls(), 2u);
  EXPECT_EQ(records_.size(), 2u);
  EXPECT_EQ(records_[1].t, kStart + 5us);
}

TEST_F(FlightComputerTest, BeaconOfTheApiPageKeepsItsPace) {
  fly({.library = "beacon"});
  loop_.schedule(kStart + 15s, {Phase::kDevice, test_, test_, &kTell}, [this] {
    const std::byte message[4] = {};
    computer_->deliver("crosslink", message, test_);
    computer_->deliver("crosslink", Bytes(message).first(3), test_);
  });
  run_for(1h);
  EXPECT_EQ(notes_.size(), 361u);  // every 10 s, both ends included
  EXPECT_EQ(notes_[0], "0 " + std::string(4, '\0'));
  EXPECT_EQ(notes_[2], "20000000 " + std::string("\1\0\0\0", 4));  // has heard one by then
  EXPECT_EQ(computer_->rejected(), 1u);
  EXPECT_EQ(computer_->crashes(), 0u);
}

TEST_F(FlightComputerTest, NewTickRequestReplacesTheOldAndANegativeOneWithdraws) {
  fly({});
  at(0us, request_tick(to_ns(kStart + 50us)));
  at(10us, request_tick(to_ns(kStart + 30us)));
  at(40us, request_tick(to_ns(kStart + 60us)));
  at(50us, request_tick(-1));
  run_for(1ms);
  EXPECT_THAT(notes_, ElementsAre("30 t 30"));
}

TEST_F(FlightComputerTest, TickInThePastFiresWhenTheCallHasEnded) {
  fly({});
  at(20us, request_tick(to_ns(kStart - 900s)));
  run_for(1ms);
  EXPECT_THAT(notes_, ElementsAre("20 t 20"));
}

TEST_F(FlightComputerTest, AtOneInstantInputsComeBeforeTheTickUnlessOneReplacesIt) {
  fly({});
  at(0us, request_tick(to_ns(kStart + 50us)));
  at(50us, order("efirst"));
  at(60us, request_tick(to_ns(kStart + 70us)));
  at(70us, request_tick(to_ns(kStart + 80us)));
  run_for(1ms);
  EXPECT_THAT(notes_, ElementsAre("50 first", "50 t 50", "80 t 80"));
}

TEST_F(FlightComputerTest, TickThatNeverGetsOnEndsTheProcess) {
  fly({});
  at(5us, order('P', std::int64_t{-1'000'000}));  // a period where a time ahead is meant
  run_for(1ms);
  ASSERT_EQ(crashes_.size(), 1u);
  EXPECT_EQ(crashes_[0].kind, CrashKind::kNoProgress);
  EXPECT_EQ(loop_.now(), kStart + 1ms);
}

TEST_F(FlightComputerTest, OutputsLeaveWhenTheExecutionTimeHasPassed) {
  fly({.execution_time = 30us});
  at(100us, order("eone"));
  run_for(1ms);
  EXPECT_THAT(notes_, ElementsAre("130 one"));
}

TEST_F(FlightComputerTest, InputsWaitWhileTheProcessorIsBusy) {
  fly({.execution_time = 30us});
  at(100us, order("eone"));
  at(105us, order("etwo"));
  at(110us, order("n"));
  run_for(1ms);
  // Calls at 100, 130, 160: each output 30 us later. Flight code sees when its call began.
  EXPECT_THAT(notes_, ElementsAre("130 one", "160 two", "190 n 160"));
}

TEST_F(FlightComputerTest, TickThatFellDueEarlierGoesBeforeAWaitingInput) {
  fly({.execution_time = 30us});
  at(50us, request_tick(to_ns(kStart + 105us)));
  at(100us, order("eone"));    // busy until 130
  at(110us, order("elater"));  // after the tick fell due
  run_for(1ms);
  EXPECT_THAT(notes_, ElementsAre("130 one", "160 t 130", "190 later"));
}

TEST_F(FlightComputerTest, InputsThatFellDueNoLaterThanTheTickGoFirst) {
  fly({.execution_time = 30us});
  at(50us, request_tick(to_ns(kStart + 110us)));
  at(100us, order("eone"));
  at(110us, order("eequal"));
  run_for(1ms);
  EXPECT_THAT(notes_, ElementsAre("130 one", "160 equal", "190 t 160"));
}

TEST_F(FlightComputerTest, FullQueueDropsTheNewestAndCountsPerPort) {
  fly({.execution_time = 1us});
  at(100us, order("eunder way"));
  for (int i = 0; i < 66; ++i) at(100us, order("e" + std::to_string(i)));
  run_for(1ms);
  EXPECT_EQ(computer_->dropped("do"), 2u);  // one in the call, 64 waiting
  EXPECT_EQ(computer_->dropped("bits"), 0u);
  EXPECT_EQ(notes_.size(), 65u);
  EXPECT_EQ(notes_.back(), "165 63");
}

TEST_F(FlightComputerTest, StreamIsCutIntoCallsAndAPacketTooLongIsRejected) {
  fly({});
  at(5us, order("0123456789abcdefXYZ"), "bits");  // 8 bytes per call
  at(6us, ByteBuffer(65));
  at(7us, ByteBuffer(0), "bits");
  run_for(1ms);
  EXPECT_THAT(notes_, ElementsAre("5 01234567", "5 89abcdef", "5 XYZ", "7 "));
  EXPECT_EQ(computer_->rejected(), 1u);
  EXPECT_THAT(logs_, ElementsAre(HasSubstr("65 bytes is too long for port do, which takes 64")));
}

TEST_F(FlightComputerTest, RejectedInputsAreCounted) {
  fly({});
  at(5us, return_status(1));
  at(6us, order("unknown order"));
  run_for(1ms);
  EXPECT_EQ(computer_->rejected(), 1u);  // 'u' is an order; see subject.c
  EXPECT_TRUE(computer_->alive());
}

TEST_F(FlightComputerTest, CrashIsReportedOnceAndTheDeadGetNothing) {
  fly({});
  at(5us, request_tick(to_ns(kStart + 50us)));
  at(10us, order("!s"));
  at(20us, order("eanyone there"));
  run_for(1ms);
  EXPECT_EQ(computer_->crashes(), 1u);
  EXPECT_FALSE(computer_->alive());
  ASSERT_EQ(crashes_.size(), 1u);
  EXPECT_EQ(crashes_[0].t, kStart + 10us);
  EXPECT_EQ(crashes_[0].onboard_ns, to_ns(kStart + 10us));
  EXPECT_EQ(computer_->inputs_lost(), 1u);
  EXPECT_THAT(notes_, IsEmpty());  // neither last words nor the tick
  EXPECT_THAT(logs_, ElementsAre("going down"));
}

TEST_F(FlightComputerTest, CrashDiscardsOutputsThatHadNotLeftAndInputsThatWaited) {
  fly({.execution_time = 30us});
  at(100us, order("ewill have left"));  // leaves at 130, when the next call starts, and crashes
  at(110us, order("!s"));
  at(115us, order("ewaits in vain"));
  run_for(1ms);
  EXPECT_THAT(notes_, ElementsAre("130 will have left"));
  EXPECT_EQ(computer_->outputs_discarded(), 0u);
  EXPECT_EQ(computer_->inputs_lost(), 1u);
}

TEST_F(FlightComputerTest, OutputsThatHadNotLeftDieWithTheProcess) {
  fly({.execution_time = 30us});
  at(50us, order("D"));  // its destroy will crash
  at(100us, order("enever leaves"));
  run_for(110us);
  computer_->shut_down();
  run_for(1ms);
  EXPECT_THAT(notes_, IsEmpty());
  EXPECT_EQ(computer_->outputs_discarded(), 1u);
  ASSERT_EQ(crashes_.size(), 1u);
  EXPECT_EQ(crashes_[0].call, "destroy");
}

// The simulator is made to allocate from a heap that counts; that is there first and goes last.
TEST(FlightComputerSteadyStateTest, MessagesAllocateNothing) {
  if (!heap_simulation_available()) GTEST_SKIP() << "a sanitizer owns malloc";
  SimulatedHeap counting({.limit_bytes = 1 << 20});
  EventLoop loop(kStart);
  const OwnerId owner = loop.add_owner("dsc");
  FlightComputer computer(loop, owner, {.spacecraft = "dsc", .library = "flight_test_subject"}, {});
  const ByteBuffer message = order("eeverything has its buffer by now");
  const HeapGuard guard(&counting);
  computer.boot();
  const auto exchange = [&](int messages) {
    for (int i = 0; i < messages; ++i) {
      computer.deliver("do", message, owner);
      loop.run_until(loop.now() + 1us);
    }
  };
  exchange(100);
  const std::uint64_t before = counting.blocks().allocations();
  EXPECT_GT(before, 0u);
  exchange(1000);
  EXPECT_EQ(counting.blocks().allocations(), before);
  EXPECT_EQ(computer.calls(), 1101u);
}

TEST_F(FlightComputerTest, ExceptionOfAHookPassesThroughTheLoop) {
  FlightComputer::Hooks hooks;
  hooks.on_crash = [](const CrashReport& crash) { throw std::runtime_error(crash.message); };
  FlightComputer computer(loop_, spacecraft_,
                          {.spacecraft = "dsc", .library = "flight_test_subject"}, hooks);
  computer.boot();
  computer.deliver("do", order("!a"), test_);
  EXPECT_THROW(run_for(1ms), std::runtime_error);
  EXPECT_EQ(computer.crashes(), 1u);
  EXPECT_NO_THROW(run_for(1ms));
}

TEST_F(FlightComputerTest, ShutDownLetsOutputsLeave) {
  fly({.execution_time = 30us});
  at(100us, order("elast"));
  run_for(110us);
  computer_->shut_down();
  computer_->shut_down();
  at(120us, order("etoo late"));
  run_for(1ms);
  EXPECT_THAT(notes_, ElementsAre("130 last"));
  EXPECT_THAT(logs_, ElementsAre("destroyed"));
  EXPECT_EQ(computer_->inputs_lost(), 1u);
  EXPECT_EQ(computer_->crashes(), 0u);
}

TEST_F(FlightComputerTest, InputsBeforeTheBootAreLost) {
  FlightComputer computer(loop_, spacecraft_,
                          {.spacecraft = "dsc", .library = "flight_test_subject"}, {});
  computer.deliver("do", order("e"), test_);
  run_for(1us);
  EXPECT_EQ(computer.inputs_lost(), 1u);
}

TEST_F(FlightComputerTest, BootComesBeforeInputsOfItsInstant) {
  fly({});
  computer_->deliver("do", order("eat once"), test_);
  run_for(1us);
  EXPECT_THAT(notes_, ElementsAre("0 at once"));
}

TEST_F(FlightComputerTest, FlightSoftwareSeesTheOnboardClock) {
  fly({});
  run_for(1us);
  computer_->processor().clock().set_offset(-3us, loop_.now());
  at(10us, order("n"));
  at(20us, request_tick(to_ns(kStart + 40us)));  // onboard, so 43 of truth
  run_for(1ms);
  EXPECT_THAT(notes_, ElementsAre("10 n 7", "43 t 40"));
  EXPECT_EQ(computer_->onboard_ns(), to_ns(loop_.now()) - 3000);
}

TEST_F(FlightComputerTest, UnknownPortIsReportedWithThoseThereAre) {
  fly({});
  EXPECT_TRUE(computer_->has_input("do"));
  EXPECT_FALSE(computer_->has_input("say"));
  EXPECT_TRUE(computer_->has_output("say"));
  try {
    computer_->deliver("gnss", {}, test_);
    ADD_FAILURE() << "no exception";
  } catch (const std::invalid_argument& error) {
    EXPECT_THAT(error.what(), HasSubstr("dsc/gnc has no input port \"gnss\"; it has do, bits"));
  }
}

TEST_F(FlightComputerTest, MistakesOfTheCallerAreRefused) {
  EXPECT_THROW(fly({.execution_time = Duration{-1}}), std::invalid_argument);
  fly({});
  EXPECT_THROW(computer_->boot(), std::logic_error);
}

TEST_F(FlightComputerTest, EqualRunsHaveEqualFingerprintsAndAnotherPayloadAnother) {
  const auto fingerprint = [](const char* payload) {
    EventLoop loop(kStart);
    const OwnerId test = loop.add_owner("test");
    const OwnerId owner = loop.add_owner("dsc");
    FlightComputer computer(loop, owner, {.spacecraft = "dsc", .library = "flight_test_subject"},
                            {});
    computer.boot();
    computer.deliver("do", order(payload), test);
    loop.run_until(kStart + 1ms);
    return loop.fingerprint().value();
  };
  EXPECT_EQ(fingerprint("eone"), fingerprint("eone"));
  EXPECT_NE(fingerprint("eone"), fingerprint("etwo"));
}

}  // namespace
}  // namespace orrery
