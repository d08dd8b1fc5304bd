// Several flight processes on one processor: whose call is next, and what of one the others notice.
#include <orrery/harness/flight/flight_computer.hpp>
#include <orrery/harness/kernel/random.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "orders.hpp"

namespace orrery {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

constexpr SimTime kStart = from_ns(1'000'000'000'000);
constexpr EventKind kTell{1000, "tell"};

struct ProcessSetup {
  std::string name;
  int priority = 0;
  Duration execution_time{};
  FlightProcessOptions options = {};
};

// One spacecraft with a processor, and somebody who talks to its processes. What comes out is noted
// as "<time from start, us> <process> <text>".
class Spacecraft {
 public:
  explicit Spacecraft(const std::vector<ProcessSetup>& processes, std::uint64_t tie_seed = 0)
      : loop_(kStart), test_(loop_.add_owner("test")), owner_(loop_.add_owner("dsc")) {
    if (tie_seed != 0) loop_.shuffle_ties(tie_seed);
    std::vector<OwnerId> owners;
    for (const ProcessSetup& one : processes) owners.push_back(loop_.add_owner("dsc/" + one.name));
    const OwnerId chooser = loop_.add_owner("dsc processor");
    processor_ = std::make_unique<Processor>(loop_, owner_, chooser);
    for (std::size_t i = 0; i < processes.size(); ++i) add(processes[i], owners[i]);
    for (const auto& computer : computers_) computer->boot();
  }

  FlightComputer& computer(const std::string& name) {
    return **std::find_if(computers_.begin(), computers_.end(), [&name](const auto& computer) {
      return computer->options().process == name;
    });
  }
  void at(Duration after_start, const std::string& process, const ByteBuffer& message) {
    loop_.schedule(kStart + after_start, {Phase::kDevice, test_, test_, &kTell},
                   [this, to = &computer(process), m = std::make_shared<ByteBuffer>(message)] {
                     to->deliver("do", *m, test_);
                   });
  }
  void at(Duration after_start, const std::string& process, std::string_view text) {
    at(after_start, process, order("e" + std::string(text)));
  }
  void run_for(Duration d) { loop_.run_until(loop_.now() + d); }
  Processor& processor() { return *processor_; }
  EventLoop& loop() { return loop_; }

  std::vector<std::string> notes;
  std::vector<CrashReport> crashes;
  std::vector<std::string> drops;
  std::function<void(const std::string& process, Bytes)> on_output;

 private:
  void add(const ProcessSetup& setup, OwnerId owner) {
    FlightProcessOptions options = setup.options;
    options.spacecraft = "dsc";
    options.process = setup.name;
    options.priority = setup.priority;
    if (options.library.empty()) options.library = "flight_test_subject";
    options.execution_time = setup.execution_time;
    if (options.execution_time_of.count("create") == 0) options.execution_time_of["create"] = 0us;
    FlightComputer::Hooks hooks;
    hooks.on_output = [this, name = setup.name](std::string_view port, Bytes bytes) {
      note(name + " " +
           (port == "times" ? std::string(1, static_cast<char>(bytes[0])) : text_of(bytes)));
      if (on_output) on_output(name, bytes);
    };
    hooks.on_crash = [this](const CrashReport& crash) { crashes.push_back(crash); };
    hooks.on_drop = [this, name = setup.name](std::string_view) { drops.push_back(name); };
    computers_.push_back(
        std::make_unique<FlightComputer>(*processor_, owner, std::move(options), hooks));
  }
  void note(const std::string& text) {
    notes.push_back(std::to_string(to_ns(loop_.now() - kStart) / 1000) + " " + text);
  }

  EventLoop loop_;
  OwnerId test_, owner_;
  std::unique_ptr<Processor> processor_;
  std::vector<std::unique_ptr<FlightComputer>> computers_;
};

std::vector<ProcessSetup> low_and_high() {
  return {{.name = "low", .priority = 1, .execution_time = 100us},
          {.name = "high", .priority = 5, .execution_time = 20us}};
}

}  // namespace

// 10-110 low a, which nothing interrupts; 110-130 x and 130-150 y, which came after b but go first;
// 150-250 b; 250-270 z.
TEST(ProcessorTest, TheHighestPriorityGoesFirstWhenACallHasEnded) {
  Spacecraft dsc(low_and_high());
  dsc.at(10us, "low", "a");
  dsc.at(20us, "low", "b");
  dsc.at(30us, "high", "x");
  dsc.at(40us, "high", "y");
  dsc.at(200us, "high", "z");
  dsc.run_for(1ms);
  EXPECT_THAT(dsc.notes,
              ElementsAre("110 low a", "130 high x", "150 high y", "250 low b", "270 high z"));
}

TEST(ProcessorTest, OfOneInstantItGoesFirstAlthoughItComesLast) {
  Spacecraft dsc(low_and_high());
  dsc.at(10us, "low", "a");
  dsc.at(10us, "high", "x");
  dsc.at(130us, "high", "y");  // the very instant at which a ends
  dsc.at(100us, "low", "b");
  dsc.run_for(1ms);
  EXPECT_THAT(dsc.notes, ElementsAre("30 high x", "130 low a", "150 high y", "250 low b"));
}

TEST(ProcessorTest, WhatACallSendsToAnotherProcessIsThereAtTheNextChoice) {
  Spacecraft dsc(low_and_high());
  dsc.on_output = [&dsc](const std::string& process, Bytes) {
    if (process == "low") dsc.computer("high").deliver("do", order("eanswer"), 1);
  };
  dsc.at(10us, "low", "a");
  dsc.at(20us, "low", "b");
  dsc.run_for(215us);
  EXPECT_THAT(dsc.notes, ElementsAre("110 low a", "130 high answer"));
}

TEST(ProcessorTest, EqualsGoInOrderOfArrival) {
  Spacecraft dsc({{.name = "a", .execution_time = 100us}, {.name = "b", .execution_time = 50us}});
  dsc.at(10us, "a", "1");
  dsc.at(40us, "a", "4");
  dsc.at(20us, "b", "2");
  dsc.at(30us, "b", "3");
  dsc.at(50us, "a", "5");
  dsc.at(60us, "b", "6");
  dsc.run_for(1ms);
  EXPECT_THAT(dsc.notes,
              ElementsAre("110 a 1", "160 b 2", "210 b 3", "310 a 4", "410 a 5", "460 b 6"));
}

// Due at 60 and 55, while a call runs; the input comes at 60.
TEST(ProcessorTest, TicksOfEqualsGoWhenTheyWereDueBehindInputsOfTheirInstant) {
  Spacecraft dsc({{.name = "a", .execution_time = 50us}, {.name = "b", .execution_time = 50us}});
  dsc.at(0us, "a", request_tick(to_ns(kStart + 160us)));
  dsc.at(0us, "b", request_tick(to_ns(kStart + 155us)));
  dsc.at(150us, "a", "runs");
  dsc.at(160us, "b", "input");
  dsc.run_for(1ms);
  EXPECT_THAT(dsc.notes, ElementsAre("200 a runs", "250 b t", "300 b input", "350 a t"));
}

TEST(ProcessorTest, ATickOfHigherPriorityGoesBeforeInputsThatWaitForLonger) {
  Spacecraft dsc(low_and_high());
  dsc.at(0us, "high", request_tick(to_ns(kStart + 150us)));
  dsc.at(100us, "low", "a");
  dsc.at(110us, "low", "b");
  dsc.run_for(1ms);
  EXPECT_THAT(dsc.notes, ElementsAre("200 low a", "220 high t", "320 low b"));
}

// One runs, 64 wait; the other process has a queue of its own.
TEST(ProcessorTest, QueuesOverflowOnePerProcess) {
  Spacecraft dsc(low_and_high());
  dsc.at(10us, "low", "under way");
  for (int i = 0; i < 67; ++i) dsc.at(20us, "low", std::to_string(i));
  for (int i = 0; i < 64; ++i) dsc.at(20us, "high", std::to_string(i));
  dsc.run_for(1s);
  EXPECT_EQ(dsc.computer("low").dropped("do"), 3u);
  EXPECT_EQ(dsc.computer("high").dropped("do"), 0u);
  EXPECT_THAT(dsc.drops, ElementsAre("low", "low", "low"));
  EXPECT_EQ(dsc.notes.size(), 1u + 64 + 64);
  EXPECT_EQ(dsc.notes[64], "1390 high 63");    // 110 + 64 x 20
  EXPECT_EQ(dsc.notes.back(), "7790 low 63");  // and 64 x 100
}

TEST(ProcessorTest, ACrashEndsOneProcessAndFreesTheProcessor) {
  Spacecraft dsc(low_and_high());
  dsc.at(10us, "low", "a");
  dsc.at(20us, "low", "b");
  dsc.at(30us, "high", order("!s"));
  dsc.at(40us, "high", "waits in vain");
  dsc.at(200us, "high", "comes in vain");
  dsc.run_for(1ms);
  EXPECT_THAT(dsc.notes, ElementsAre("110 low a", "210 low b"));
  ASSERT_EQ(dsc.crashes.size(), 1u);
  EXPECT_EQ(dsc.crashes[0].process, "high");
  EXPECT_EQ(dsc.computer("high").inputs_lost(), 2u);
  EXPECT_TRUE(dsc.computer("low").alive());
}

TEST(ProcessorTest, AResetOfTheOneThatRunsFreesItAtOnceAndOfAnotherNot) {
  Spacecraft dsc({{.name = "low", .priority = 1, .execution_time = 100us},
                  {.name = "high", .priority = 5, .execution_time = 20us},
                  {.name = "third", .priority = 3, .execution_time = 10us}});
  dsc.run_for(1us);
  dsc.computer("low").reboot(kStart + 50us, 1us);
  dsc.computer("high").kill(kStart + 70us);
  dsc.at(10us, "low", "dies at 50");
  dsc.at(20us, "third", "x");
  dsc.at(61us, "low", "a");
  dsc.at(65us, "high", "dies waiting");
  dsc.at(65us, "third", "y");
  dsc.run_for(1ms);
  // 50-60 x, then low boots; 61-161 a.
  EXPECT_THAT(dsc.notes, ElementsAre("60 third x", "161 low a", "171 third y"));
  EXPECT_EQ(dsc.computer("low").outputs_discarded(), 1u);
  EXPECT_EQ(dsc.computer("low").boots(), 2u);
  EXPECT_EQ(dsc.computer("high").inputs_lost(), 1u);
  // 10-50, 50-60, 61-161, 161-171.
  EXPECT_EQ(dsc.processor().busy_time(), 160us);
}

TEST(ProcessorTest, ABootWaitsForTheProcessorAndTakesItsTime) {
  ProcessSetup high{.name = "high", .priority = 5, .execution_time = 20us};
  high.options.execution_time_of["create"] = 30us;
  high.options.config = "say";
  Spacecraft dsc({low_and_high()[0], high});
  dsc.run_for(90us);
  dsc.notes.clear();
  dsc.computer("high").reboot(kStart + 150us, 10us);
  dsc.at(100us, "low", "a");
  dsc.at(110us, "low", "b");
  dsc.at(190us, "high", "while it waits to boot");
  dsc.at(210us, "high", "x");
  dsc.run_for(1ms);
  // Due at 160; its create has the processor from 200 to 230, then x.
  ASSERT_GE(dsc.notes.size(), 7u);
  EXPECT_EQ(dsc.notes[0], "200 low a");
  EXPECT_EQ(dsc.notes[2], "230 high dsc");
  EXPECT_EQ(dsc.notes[3], "230 high high");
  EXPECT_EQ(dsc.notes[dsc.notes.size() - 2], "250 high x");
  EXPECT_EQ(dsc.notes.back(), "350 low b");
  EXPECT_EQ(dsc.computer("high").inputs_lost(), 1u);
}

TEST(ProcessorTest, BootsOfOneInstantComeBeforeItsInputs) {
  Spacecraft dsc(low_and_high());
  dsc.at(0us, "low", "a");
  dsc.at(0us, "high", "x");
  dsc.run_for(1ms);
  EXPECT_THAT(dsc.notes, ElementsAre("20 high x", "120 low a"));
  EXPECT_EQ(dsc.computer("low").inputs_lost(), 0u);
}

TEST(ProcessorTest, TheHighestPriorityBootsFirst) {
  std::vector<ProcessSetup> both = low_and_high();
  for (ProcessSetup& one : both) {
    one.options.config = "say";
    one.options.execution_time_of["create"] = 10us;
  }
  Spacecraft dsc(both);
  dsc.run_for(1ms);
  ASSERT_EQ(dsc.notes.size(), 10u);  // five outputs each
  EXPECT_EQ(dsc.notes[2], "10 high high");
  EXPECT_EQ(dsc.notes[7], "20 low low");
}

TEST(ProcessorTest, AKillWithdrawsABootThatWaits) {
  Spacecraft dsc(low_and_high());
  dsc.run_for(1us);
  dsc.at(10us, "low", "a");
  dsc.computer("high").reboot(kStart + 20us, 1us);
  dsc.computer("high").kill(kStart + 50us);
  dsc.at(60us, "high", "x");
  dsc.run_for(1ms);
  EXPECT_THAT(dsc.notes, ElementsAre("110 low a"));
  EXPECT_EQ(dsc.computer("high").boots(), 1u);
  EXPECT_FALSE(dsc.computer("high").alive());
}

TEST(ProcessorTest, TheWorkBudgetOfOneEndsThatOneAlone) {
  ProcessSetup worker{.name = "worker", .priority = 9};
  worker.options.library = "flight_test_worker";
  worker.options.work_budget = 1000;
  Spacecraft dsc({worker, low_and_high()[0]});
  dsc.run_for(1us);
  const std::uint32_t turns = 100'000;
  ByteBuffer message(4);
  std::memcpy(message.data(), &turns, 4);
  dsc.computer("worker").deliver("turns", message, 0);
  dsc.at(10us, "low", "goes on");
  dsc.run_for(1ms);
  ASSERT_EQ(dsc.crashes.size(), 1u);
  EXPECT_EQ(dsc.crashes[0].kind, CrashKind::kWorkBudget);
  EXPECT_EQ(dsc.crashes[0].process, "worker");
  EXPECT_THAT(dsc.notes, ElementsAre("110 low goes on"));
}

TEST(ProcessorTest, AllReadOneClock) {
  Spacecraft dsc(low_and_high());
  dsc.at(0us, "low", request_tick(to_ns(kStart + 500us)));
  dsc.at(0us, "high", request_tick(to_ns(kStart + 500us)));
  dsc.run_for(1us);
  dsc.processor().jump_clock(kStart + 300us, 100us);
  dsc.run_for(1ms);
  EXPECT_THAT(dsc.notes, ElementsAre("420 high t", "520 low t"));
  EXPECT_EQ(dsc.computer("low").onboard_ns(), dsc.computer("high").onboard_ns());
}

TEST(ProcessorTest, ASlowProcessorIsSlowForAllAndCountsTheCallsOfAll) {
  Spacecraft dsc(low_and_high());
  std::vector<std::uint64_t> calls;
  dsc.processor().set_slow_down([&calls](std::uint64_t call) {
    calls.push_back(call);
    return call >= 4 ? 3.0 : 1.0;
  });
  dsc.at(10us, "low", "a");
  dsc.at(20us, "high", "x");
  dsc.at(30us, "low", "b");
  dsc.run_for(1ms);
  EXPECT_THAT(dsc.notes, ElementsAre("110 low a", "170 high x", "470 low b"));
  EXPECT_THAT(calls, ElementsAre(1u, 2u, 3u, 4u, 5u));  // two boots first
}

TEST(ProcessorTest, BusyTimeCountsTheCallThatRunsUpToNow) {
  Spacecraft dsc(low_and_high());
  dsc.at(10us, "low", "a");
  dsc.at(20us, "high", "x");
  dsc.run_for(60us);
  EXPECT_EQ(dsc.processor().busy_time(), 50us);
  dsc.run_for(60us);
  EXPECT_EQ(dsc.processor().busy_time(), 110us);
  dsc.run_for(1ms);
  EXPECT_EQ(dsc.processor().busy_time(), 120us);
}

namespace {

struct Job {
  Duration arrival;
  std::size_t process;
  std::string text;
};

// Three processes, two of them equals, and jobs of which several come at one instant.
const std::vector<ProcessSetup> kThree = {{.name = "a", .priority = 0, .execution_time = 70us},
                                          {.name = "b", .priority = 3, .execution_time = 15us},
                                          {.name = "c", .priority = 0, .execution_time = 40us}};

std::vector<Job> random_jobs() {
  RandomStreams streams(11);
  RandomStream& draw = streams.stream("dsc", "processor", "jobs");
  std::vector<Job> jobs;
  Duration t = 10us;
  for (int i = 0; i < 400; ++i) {
    t += 5us * draw.integer(0, 16);  // 40 us on average: near saturation
    const auto process = static_cast<std::size_t>(draw.integer(0, 2));
    jobs.push_back({t, process, std::to_string(i)});
  }
  // As the loop has them: of one instant in order of the processes.
  std::stable_sort(jobs.begin(), jobs.end(), [](const Job& x, const Job& y) {
    return x.arrival != y.arrival ? x.arrival < y.arrival : x.process < y.process;
  });
  return jobs;
}

// What the notes must be, from the rule alone: time goes on to the next end or arrival, and of
// those that have come the highest priority is taken, of equals the first in the list.
std::vector<std::string> expected_notes(std::vector<Job> jobs) {
  std::vector<std::string> notes;
  Duration now{};
  while (!jobs.empty()) {
    now = std::max(now, jobs.front().arrival);
    auto best = jobs.begin();
    for (auto one = jobs.begin(); one != jobs.end() && one->arrival <= now; ++one) {
      if (kThree[one->process].priority > kThree[best->process].priority) best = one;
    }
    now += kThree[best->process].execution_time;
    notes.push_back(std::to_string(to_ns(now) / 1000) + " " + kThree[best->process].name + " " +
                    best->text);
    jobs.erase(best);
  }
  return notes;
}

struct Flown {
  std::vector<std::string> notes;
  std::string fingerprint;
};

Flown fly_jobs(std::uint64_t tie_seed) {
  Spacecraft dsc(kThree, tie_seed);
  for (const Job& job : random_jobs()) dsc.at(job.arrival, kThree[job.process].name, job.text);
  dsc.run_for(1s);
  EXPECT_THAT(dsc.drops, IsEmpty());
  return {dsc.notes, dsc.loop().fingerprint().value()};
}

}  // namespace

TEST(ProcessorTest, FourHundredJobsAreDoneAsTheRuleSays) {
  EXPECT_EQ(fly_jobs(0).notes, expected_notes(random_jobs()));
}

TEST(ProcessorTest, TheScheduleRepeatsAndDependsOnNoOrderOfTies) {
  const Flown first = fly_jobs(0);
  const Flown again = fly_jobs(0);
  EXPECT_EQ(first.fingerprint, again.fingerprint);
  for (const std::uint64_t tie_seed : {1u, 2u, 3u, 4u, 5u}) {
    EXPECT_EQ(fly_jobs(tie_seed).notes, first.notes) << tie_seed;
  }
}

// 1e-3 of 2 s are 2 ms, of 0.5 s 0.5 ms.
TEST(OnboardClockTest, DriftsFromWhereItWasTold) {
  OnboardClock clock;
  clock.set_offset(-3us, kStart);
  clock.set_drift(1e-3, kStart);
  EXPECT_EQ(clock.offset(kStart), -3us);
  EXPECT_EQ(clock.offset(kStart + 2s), 2ms - 3us);
  EXPECT_EQ(clock.offset(kStart - 500ms), -500us - 3us);
  clock.jump(1s);
  EXPECT_EQ(clock.offset(kStart + 2s), 1s + 2ms - 3us);
  clock.set_drift(-1e-3, kStart + 2s);
  EXPECT_EQ(clock.offset(kStart + 2s), 1s + 2ms - 3us) << "a new drift is no jump";
  EXPECT_EQ(clock.offset(kStart + 3s), 1s + 1ms - 3us);
}

// Property: the first instant at which it shows so much, and it never runs backwards: from 1 s to
// 3 years from where drift counts, for drifts of either sign.
TEST(OnboardClockTest, ReadsBackToTheFirstInstant) {
  RandomStreams streams(1);
  RandomStream& random = streams.stream("dsc", "clock", "test");
  for (const double drift_sps : {0.01, 1e-5, 3e-9, -3e-9, -1e-5, -0.01}) {
    OnboardClock clock;
    clock.set_drift(drift_sps, kStart);
    for (int i = 0; i < 2000; ++i) {
      const double exponent = random.uniform(9, 17);
      const std::int64_t shown = to_ns(kStart) + static_cast<std::int64_t>(std::pow(10, exponent));
      const SimTime t = clock.truth(shown);
      ASSERT_GE(clock.onboard_ns(t), shown) << drift_sps;
      ASSERT_LT(clock.onboard_ns(t - 1ns), shown) << drift_sps;
      ASSERT_LE(clock.onboard_ns(t), shown + 1) << drift_sps;
      ASSERT_LE(clock.onboard_ns(t), clock.onboard_ns(t + 1ns)) << drift_sps;
    }
  }
}

}  // namespace orrery
