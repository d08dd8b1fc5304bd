// Property: what survives a reboot, a power cycle, a kill is what the table of README.md says.

#include <orrery/harness/flight/flight_computer.hpp>

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

constexpr SimTime kStart = from_ns(1'000'000'000'000);

// Boots are noted as "boot <count>/<cause>", times as "<letter> <us from start>", all with the
// instant [us from start] in front.
class FlightLifecycleTest : public testing::TestWithParam<Isolation> {
 protected:
  FlightLifecycleTest() : loop_(kStart), test_(loop_.add_owner("test")) {
    spacecraft_ = loop_.add_owner("dsc");
  }
  void fly(FlightProcessOptions options = {}) {
    options.spacecraft = "dsc";
    options.library = "flight_test_subject";
    options.config = "say";
    options.isolation = GetParam();
    FlightComputer::Hooks hooks;
    hooks.on_output = [this](std::string_view port, Bytes bytes) { hear(port, bytes); };
    hooks.on_log = [this](LogLevel, std::string_view line) { logs_.emplace_back(line); };
    hooks.on_crash = [this](const CrashReport&) {
      if (boot_after_crash_ > Duration{0}) {
        computer_->reboot(loop_.now(), boot_after_crash_, ResetCause::kCrash);
      }
    };
    hooks.on_power_cycle = [this] { note("devices cold"); };
    computer_ = std::make_unique<FlightComputer>(loop_, spacecraft_, std::move(options), hooks);
    computer_->boot();
  }
  void hear(std::string_view port, Bytes bytes) {
    if (port == "times") {
      const std::string what(1, static_cast<char>(bytes[0]));
      if (what != "b") note(what + " " + std::to_string((time_of(bytes) - to_ns(kStart)) / 1000));
      boot_clock_ns_ = what == "b" ? time_of(bytes) : boot_clock_ns_;
    } else if (bytes.size() == 8) {  // count and cause, as create says them
      note("boot " + std::to_string(static_cast<int>(bytes[0])) + "/" +
           std::to_string(static_cast<int>(bytes[4])));
    } else if (const std::string text = text_of(bytes);
               text != "dsc" && text != "gnc" && text != "say") {
      note(text);
    }
  }
  void note(const std::string& text) {
    notes_.push_back(std::to_string(to_ns(loop_.now() - kStart) / 1000) + " " + text);
  }
  void at(Duration after_start, const ByteBuffer& message) {
    loop_.schedule(kStart + after_start, {Phase::kDevice, test_, test_, &kTell},
                   [this, message = std::make_shared<ByteBuffer>(message)] {
                     computer_->deliver("do", *message, test_);
                   });
  }
  void run_for(Duration d) { loop_.run_until(loop_.now() + d); }

  static constexpr EventKind kTell{1000, "tell"};
  EventLoop loop_;
  OwnerId test_, spacecraft_ = 0;
  std::unique_ptr<FlightComputer> computer_;
  std::vector<std::string> notes_, logs_;
  Duration boot_after_crash_{};
  std::int64_t boot_clock_ns_ = 0;
};

INSTANTIATE_TEST_SUITE_P(Isolations, FlightLifecycleTest,
                         testing::Values(Isolation::kCopy, Isolation::kShared),
                         [](const auto& isolation) {
                           return std::string(isolation.param == Isolation::kCopy ? "Copy"
                                                                                  : "Shared");
                         });

TEST_P(FlightLifecycleTest, RebootTellsCountAndCauseAndForgetsTheTick) {
  fly();
  at(10us, request_tick(to_ns(kStart + 50us)));
  computer_->reboot(kStart + 20us, 10us);
  computer_->reboot(kStart + 40us, 10us, ResetCause::kWatchdog);
  at(60us, order("n"));
  run_for(1ms);
  EXPECT_THAT(notes_, ElementsAre("0 boot 0/0", "30 boot 1/1", "50 boot 2/2", "60 n 60"));
  EXPECT_EQ(computer_->boots(), 3u);
  EXPECT_EQ(computer_->crashes(), 0u);
  EXPECT_TRUE(computer_->alive());
}

// A live heap block of 1000 bytes and a 4-byte store: the block goes, the store stays.
TEST_P(FlightLifecycleTest, StorageIsKeptAndMemoryIsNot) {
  fly();
  at(5us, order("w\7kept"));
  at(6us, allocate(1000));
  run_for(10us);
  const std::uint64_t with_block = computer_->heap().resting_bytes;
  const std::uint64_t high_water = computer_->heap().high_water_bytes;
  for (const bool power : {false, true}) {
    const SimTime t = loop_.now() + 10us;
    power ? computer_->power_cycle(t, 10us) : computer_->reboot(t, 10us);
    run_for(30us);
    computer_->deliver("do", order("y\7"), test_);
    run_for(1us);
    EXPECT_THAT(notes_.back(), HasSubstr("kept"));
    if (with_block > 0) {  // heaps are simulated
      EXPECT_LT(computer_->heap().resting_bytes, with_block);
    }
    EXPECT_EQ(computer_->heap().high_water_bytes, high_water);  // of all lives
  }
}

TEST_P(FlightLifecycleTest, GlobalsAreFreshAfterARebootOfACopy) {
  if (GetParam() == Isolation::kShared) GTEST_SKIP() << "one load: globals stay as they are";
  fly();
  at(5us, order('P', std::int64_t{10'000}));  // a global: ticks of 10 us for ever
  computer_->reboot(kStart + 26us, 10us);
  at(50us, request_tick(to_ns(kStart + 60us)));
  run_for(1ms);
  // Had the period survived, the tick at 60 would ask for another.
  EXPECT_THAT(notes_, ElementsAre("0 boot 0/0", "15 t 15", "25 t 25", "36 boot 1/1", "60 t 60"));
}

TEST_P(FlightLifecycleTest, InputsWhileOffAndThoseThatWaitedAreLostAndCounted) {
  fly({.execution_time = 30us});
  at(100us, order("eone"));    // busy until 130
  at(105us, order("ewaits"));  // lost with the queue
  computer_->reboot(kStart + 110us, 50us);
  at(120us, order("eoff"));    // lost
  at(160us, order("ehello"));  // at the instant of the boot, which takes until 190
  run_for(1ms);
  EXPECT_THAT(notes_, ElementsAre("30 boot 0/0", "190 boot 1/1", "220 hello"));
  EXPECT_EQ(computer_->inputs_lost(), 2u);
  EXPECT_EQ(computer_->outputs_discarded(), 1u);  // "one" had not left
}

TEST_P(FlightLifecycleTest, KillIsForGoodUnlessRebooted) {
  fly();
  computer_->kill(kStart + 10us);
  at(20us, order("edead"));
  computer_->reboot(kStart + 30us, 10us);
  at(50us, order("eback"));
  run_for(1ms);
  EXPECT_THAT(notes_, ElementsAre("0 boot 0/0", "40 boot 1/1", "50 back"));
  EXPECT_EQ(computer_->inputs_lost(), 1u);
}

TEST_P(FlightLifecycleTest, KillWhileOffWithdrawsTheBoot) {
  fly();
  computer_->reboot(kStart + 10us, 50us);
  computer_->kill(kStart + 20us);
  run_for(1ms);
  EXPECT_FALSE(computer_->alive());
  EXPECT_EQ(computer_->boots(), 1u);
}

TEST_P(FlightLifecycleTest, PowerCycleStartsDevicesColdAndTheClockAtZero) {
  fly();
  computer_->power_cycle(kStart + 10us, 5us);
  run_for(1ms);
  EXPECT_THAT(notes_, ElementsAre("0 boot 0/0", "10 devices cold", "15 boot 1/0"));
  EXPECT_EQ(boot_clock_ns_, 5'000);
  EXPECT_EQ(computer_->onboard_ns(), 990'000);
}

TEST_P(FlightLifecycleTest, ClockWithABatteryAndAClockThroughARebootGoOn) {
  fly({.clock_keeps_power = true});
  run_for(1us);
  computer_->processor().clock().set_offset(-3us, loop_.now());
  computer_->power_cycle(kStart + 10us, 5us);
  run_for(19us);
  EXPECT_EQ(boot_clock_ns_, to_ns(kStart + 12us));
  computer_->reboot(kStart + 20us, 5us);
  run_for(10us);
  EXPECT_EQ(boot_clock_ns_, to_ns(kStart + 22us));
}

TEST_P(FlightLifecycleTest, CrashedProcessBootsAgainWithItsCause) {
  boot_after_crash_ = 40us;
  fly();
  at(10us, order("!s"));
  at(60us, order("ealive"));
  run_for(1ms);
  EXPECT_THAT(notes_, ElementsAre("0 boot 0/0", "50 boot 1/3", "60 alive"));
  EXPECT_EQ(computer_->crashes(), 1u);
}

// Ten boots within 60 s are allowed, the first included; the eleventh is not.
TEST_P(FlightLifecycleTest, MoreThanTenBootsWithinAMinuteAreABootLoop) {
  boot_after_crash_ = 1s;
  fly();
  for (int i = 0; i < 20; ++i) at(2s * i + 1s, order("!a"));
  loop_.keep_log(true);
  run_for(60s);
  EXPECT_TRUE(computer_->stopped_by_boot_loop());
  EXPECT_FALSE(computer_->alive());
  EXPECT_EQ(computer_->boots(), 10u);
  EXPECT_EQ(computer_->crashes(), 10u);
  EXPECT_THAT(logs_.back(), HasSubstr("boot loop: more than 10 boots within 60 s"));
  int events = 0;
  for (const EventRecord& event : loop_.log())
    events += std::string(event.kind->name) == "boot_loop";
  EXPECT_EQ(events, 1);
}

// Boots 60 s / 10 = 6 s apart: the one of 60 s before has just left the window.
TEST_P(FlightLifecycleTest, TenBootsAMinuteForeverAreNone) {
  boot_after_crash_ = 1s;
  fly();
  for (int i = 0; i < 40; ++i) at(6s * i + 5s, order("!a"));
  run_for(5min);
  EXPECT_FALSE(computer_->stopped_by_boot_loop());
  EXPECT_EQ(computer_->boots(), 41u);
  EXPECT_TRUE(computer_->alive());
}

TEST_P(FlightLifecycleTest, CapThatWasSetHoldsAfterAReboot) {
  if (!heap_simulation_available())
    GTEST_SKIP() << "a sanitizer owns malloc: a cap ends the process";
  fly();
  run_for(1us);
  computer_->set_heap_limit(4096);
  computer_->reboot(kStart + 10us, 5us);
  at(20us, allocate(5000));
  run_for(1ms);
  EXPECT_EQ(notes_.back(), "20 null");
}

TEST_P(FlightLifecycleTest, ResetsThatMakeNoSenseAreRefused) {
  fly();
  EXPECT_THROW(computer_->reboot(kStart + 1s, Duration{0}), std::invalid_argument);
  EXPECT_THROW(computer_->power_cycle(kStart + 1s, Duration{-1}), std::invalid_argument);
  run_for(1s);
  EXPECT_THROW(computer_->kill(kStart), std::invalid_argument);
  FlightComputer unborn(loop_, spacecraft_, {.spacecraft = "dsc", .library = "flight_test_subject"},
                        {});
  EXPECT_THROW(unborn.reboot(loop_.now(), 1s), std::logic_error);
}

TEST_P(FlightLifecycleTest, ManyRebootsAreTheSameEveryTime) {
  const auto fingerprint = [] {
    EventLoop loop(kStart);
    const OwnerId owner = loop.add_owner("dsc");
    FlightComputer computer(loop, owner,
                            {.spacecraft = "dsc",
                             .library = "flight_test_subject",
                             .config = "say",
                             .isolation = GetParam()},
                            {});
    computer.boot();
    for (int i = 1; i <= 50; ++i) computer.reboot(kStart + 10s * i, 1s);
    loop.run_until(kStart + 600s);
    EXPECT_EQ(computer.boots(), 51u);
    return loop.fingerprint().value();
  };
  EXPECT_EQ(fingerprint(), fingerprint());
}

}  // namespace
}  // namespace orrery
