// Property: what flight code asks the C library of time and chance depends on the run alone.

#include <orrery/harness/flight/execution_time.hpp>
#include <orrery/harness/flight/flight_computer.hpp>
#include <orrery/harness/flight/virtual_services.hpp>
#include <orrery/harness/heap/interposition.hpp>
#include <orrery/harness/kernel/random.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <ctime>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "orders.hpp"

namespace orrery {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

// 2017-01-01T00:00:00 UTC, when GPS - UTC became 18 s: Unix 1483228800, GPS 1167264018 (by hand:
// 1483228800 - 315964800 + 18).
constexpr std::int64_t kSecond = 1'000'000'000;
constexpr SimTime kStart = from_ns(1'167'264'018 * kSecond);
constexpr std::int64_t kStart_unix_ns = 1'483'228'800 * kSecond;

class VirtualServicesTest : public testing::Test {
 protected:
  void SetUp() override {
    if (!services_are_virtual()) GTEST_SKIP() << "a sanitizer owns the C library's functions";
  }
  static FlightProcessOptions options(RandomStreams* random,
                                      HostServices services = HostServices::kVirtual) {
    return {.spacecraft = "dsc",
            .library = "flight_test_services",
            .services = services,
            .random = random};
  }
  // Answers of one call, 100 s after the boot, on a clock that is 5 s fast.
  static std::vector<std::int64_t> ask(FlightProcess& process, const char* questions) {
    process.input(kStart + 100s, to_ns(kStart + 105s), process.ports()[0], order(questions));
    std::vector<std::int64_t> answers;
    for (std::size_t i = 0; i < process.output_count(); ++i) {
      std::int64_t value = 0;
      std::memcpy(&value, process.output(i).data.data(), sizeof value);
      answers.push_back(value);
    }
    return answers;
  }
  static std::unique_ptr<FlightProcess> created(const FlightProcessOptions& o) {
    auto process = std::make_unique<FlightProcess>(o);
    EXPECT_EQ(process->create(kStart, to_ns(kStart)), CallOutcome::kDone);
    return process;
  }
  RandomStreams random_{7};
};

TEST_F(VirtualServicesTest, ClocksReadOnboardTimeAndAMicrosecondMoreEachTime) {
  const auto process = created(options(&random_));
  const std::int64_t civil = kStart_unix_ns + 105 * kSecond;  // the onboard clock's error shows
  const std::int64_t since_boot = 100 * kSecond;              // ... but not here
  EXPECT_THAT(ask(*process, "rrtvcmsk"),
              ElementsAre(civil, civil + 1000, civil / kSecond, civil / 1000 + 3, civil + 4000,
                          since_boot + 5000, since_boot + 6000, since_boot / 1000 + 7));
  EXPECT_EQ(process->virtual_time_spent(), 8us);
  EXPECT_THAT(ask(*process, "r"), ElementsAre(civil));  // each call begins anew
}

TEST_F(VirtualServicesTest, SleepsTakeNoHostTimeAndMoveTheClock) {
  const auto process = created(options(&random_));
  const std::int64_t since_boot = 100 * kSecond;
  const auto answers = ask(*process, "NUSFAm");
  // 0.5 + 0.25 + 2 + 0.125 s, one read within 'A', then to 1 s after that.
  const std::int64_t slept = 2'875'000'000;
  EXPECT_THAT(answers, ElementsAre(0, 0, 0, 0, since_boot + slept + kSecond));
  EXPECT_EQ(process->virtual_time_spent(), Duration(slept + kSecond) + 1us);
}

TEST_F(VirtualServicesTest, UnixTimeFollowsTheLeapSeconds) {
  using internal::unix_ns;
  // GPS epoch; the first leap second after it, 1981-07-01 (Unix 362793600); that of 2017.
  EXPECT_EQ(unix_ns(0), 315'964'800 * kSecond);
  EXPECT_EQ(unix_ns((362'793'600 - 315'964'800) * kSecond - 1), 362'793'600 * kSecond - 1);
  EXPECT_EQ(unix_ns((362'793'600 - 315'964'800 + 1) * kSecond), 362'793'600 * kSecond);
  EXPECT_EQ(unix_ns(to_ns(kStart) - 1), kStart_unix_ns + kSecond - 1);  // within the leap second
  EXPECT_EQ(unix_ns(to_ns(kStart)), kStart_unix_ns);
}

TEST_F(VirtualServicesTest, ChanceComesFromTheSeedAndTheSpacecraft) {
  const auto draws = [](std::uint64_t seed, const char* spacecraft) {
    RandomStreams random(seed);
    FlightProcessOptions o = options(&random);
    o.spacecraft = spacecraft;
    return ask(*created(o), "1124563");
  };
  const auto first = draws(7, "dsc");
  ASSERT_EQ(first.size(), 6u);
  EXPECT_EQ(first, draws(7, "dsc"));
  EXPECT_NE(first, draws(8, "dsc"));
  EXPECT_NE(first, draws(7, "osc"));
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_GE(first[i], 0);
    EXPECT_LE(first[i], RAND_MAX);
  }
}

TEST_F(VirtualServicesTest, DrawsOfFlightCodeShowInTheRandomFingerprint) {
  const std::string before = random_.fingerprint();
  ask(*created(options(&random_)), "4");
  EXPECT_NE(random_.fingerprint(), before);
}

TEST_F(VirtualServicesTest, SrandGivesTheSameNumbersInEveryRunAndProcess) {
  RandomStreams other(99);
  const auto a = created(options(&random_));
  const auto b = created(options(&other));
  ask(*b, "111");
  EXPECT_EQ(ask(*a, "3111"), ask(*b, "3111"));
  ask(*a, "3");
  const auto first = ask(*a, "1");
  ask(*b, "3");  // another process's seed and draws do not meet these
  ask(*b, "1111");
  ask(*a, "3");
  EXPECT_EQ(ask(*a, "1"), first);
}

TEST_F(VirtualServicesTest, StrictRefusesEachByName) {
  const std::pair<const char*, const char*> calls[] = {
      {"r", "clock_gettime"}, {"t", "time"},       {"v", "gettimeofday"},
      {"c", "clock_gettime"}, {"k", "clock"},      {"N", "nanosleep"},
      {"U", "usleep"},        {"S", "sleep"},      {"1", "rand"},
      {"2", "random"},        {"3", "srand"},      {"4", "std::random_device"},
      {"5", "getrandom"},     {"6", "getentropy"}, {"T", "pthread_create"}};
  for (const auto& [question, name] : calls) {
    const auto process = created(options(&random_, HostServices::kStrict));
    ask(*process, question);
    EXPECT_FALSE(process->alive()) << question;
    EXPECT_EQ(process->crash().kind, CrashKind::kForbiddenCall);
    EXPECT_THAT(process->crash().message, testing::StartsWith(std::string(name) + " called"));
    EXPECT_THAT(process->crash().backtrace,
                testing::Contains(testing::Field(&StackFrame::function, HasSubstr("Questions"))));
  }
}

TEST_F(VirtualServicesTest, ThreadOfFlightCodeIsRefusedUnlessServicesAreTheHosts) {
  const auto process = created(options(&random_));
  ask(*process, "T");
  EXPECT_EQ(process->crash().kind, CrashKind::kForbiddenCall);
  EXPECT_THAT(process->crash().message,
              HasSubstr("pthread_create called: flight code runs in one"));
  EXPECT_THAT(ask(*created(options(&random_, HostServices::kHost)), "T"), ElementsAre(1));
  bool ran = false;
  std::thread([&ran] { ran = true; }).join();  // the simulator's own are its own business
  EXPECT_TRUE(ran);
}

TEST_F(VirtualServicesTest, HostServicesAreTheHosts) {
  const auto process = created(options(&random_, HostServices::kHost));
  const std::int64_t before = time(nullptr);
  const auto answers = ask(*process, "t");
  ASSERT_EQ(answers.size(), 1u);
  EXPECT_GE(answers[0], before);
  EXPECT_LE(answers[0], time(nullptr));
}

// ---- execution time

class ExecutionTimeTest : public testing::Test {
 protected:
  ExecutionTimeTest() : loop_(kStart), test_(loop_.add_owner("test")) {
    spacecraft_ = loop_.add_owner("dsc");
  }
  void fly(FlightProcessOptions options,
           const std::function<double(std::uint64_t)>& slow_down = {}) {
    options.spacecraft = "dsc";
    if (options.library.empty()) options.library = "flight_test_subject";
    options.random = &random_;
    FlightComputer::Hooks hooks;
    hooks.on_output = [this](std::string_view, Bytes) {
      out_.push_back(to_ns(loop_.now() - kStart) / 1000);
    };
    computer_ = std::make_unique<FlightComputer>(loop_, spacecraft_, std::move(options), hooks);
    computer_->processor().set_slow_down(slow_down);
    computer_->boot();
    loop_.run_until(kStart);
  }
  void deliver_at(Duration after_start, const ByteBuffer& message, const char* port = "do") {
    loop_.run_until(kStart + after_start);
    computer_->deliver(port, message, test_);
  }
  void run_for(Duration d) { loop_.run_until(loop_.now() + d); }

  RandomStreams random_{7};
  EventLoop loop_;
  OwnerId test_, spacecraft_ = 0;
  std::unique_ptr<FlightComputer> computer_;
  std::vector<std::int64_t> out_;  // us from start
};

TEST_F(ExecutionTimeTest, PortsAndTheTickMayHaveTheirOwn) {
  fly({.execution_time = 30us,
       .execution_time_of = {{"bits", 5us}, {"tick", 70us}, {"create", 10us}}});
  deliver_at(10us, order("ea"));
  deliver_at(100us, order("b"), "bits");
  deliver_at(200us, request_tick(to_ns(kStart + 300us)));
  run_for(1ms);
  EXPECT_THAT(out_, ElementsAre(40, 105, 370));
}

TEST_F(ExecutionTimeTest, DrawnTimesFollowTheirDistributionAndTheSeed) {
  const auto times = [](std::uint64_t seed, ExecutionTime model) {
    RandomStreams random(seed);
    RandomStream& stream = random.stream("dsc", "gnc", "execution_time");
    std::vector<double> ns;
    for (int i = 0; i < 4000; ++i) {
      ns.push_back(static_cast<double>(to_ns(model.of_call(&stream, 0))));
    }
    return ns;
  };
  const ExecutionTime uniform = ExecutionTime::uniform(10us, 20us);
  EXPECT_EQ(times(7, uniform), times(7, uniform));
  EXPECT_NE(times(7, uniform), times(8, uniform));
  double sum = 0;
  for (const double t : times(7, uniform)) {
    EXPECT_GE(t, 10e3);
    EXPECT_LE(t, 20e3);
    sum += t;
  }
  // Standard error of the mean: 10 us / sqrt(12 x 4000) = 46 ns; 5 of them.
  EXPECT_NEAR(sum / 4000, 15e3, 230);
  int below = 0;
  for (const double t : times(7, ExecutionTime::log_normal(50us, 0.5))) below += t < 50e3;
  // Half, with a standard error of sqrt(4000) / 2 = 32.
  EXPECT_NEAR(below, 2000, 160);
}

TEST_F(ExecutionTimeTest, CountedWorkIsLinear) {
  fly({.library = "flight_test_worker",
       .execution_time_of = {{"turns", ExecutionTime::counted_work(1000.0, 50us)}}});
  std::vector<std::int64_t> took;
  for (const std::uint32_t turns : {0u, 100u, 300u}) {
    ByteBuffer message(4);
    std::memcpy(message.data(), &turns, 4);
    const SimTime begin = loop_.now();
    computer_->deliver("turns", message, test_);
    run_for(1s);
    took.push_back(out_.back() - to_ns(begin - kStart) / 1000 - 50);
  }
  EXPECT_GT(took[0], 0);
  EXPECT_GE(took[1] - took[0], 100);
  EXPECT_EQ(took[2] - took[1], 2 * (took[1] - took[0]));
}

TEST_F(ExecutionTimeTest, SlowDownStretchesIt) {
  fly({.execution_time = 30us}, [this](std::uint64_t) {
    return loop_.now() >= kStart + 100us && loop_.now() < kStart + 200us ? 3.0 : 1.0;
  });
  deliver_at(40us, order("ea"));
  deliver_at(100us, order("eb"));
  deliver_at(200us, order("ec"));
  run_for(1ms);
  EXPECT_THAT(out_, ElementsAre(70, 190, 230));
}

TEST_F(ExecutionTimeTest, SleepsAndClockReadsLengthenIt) {
  if (!services_are_virtual()) GTEST_SKIP() << "a sanitizer owns the C library's functions";
  fly({.library = "flight_test_services", .execution_time = 30us});
  deliver_at(1ms, order("UrU"), "ask");
  run_for(2s);
  EXPECT_THAT(out_, ElementsAre(501'031, 501'031, 501'031));
}

TEST_F(ExecutionTimeTest, JitterDelaysCallsWithinItsRangeAndKeepsTheirOrder) {
  fly({.scheduling_jitter = {{"do", 100us}}});
  for (int i = 0; i < 50; ++i) deliver_at(1ms * (i + 1), order("ea"));
  run_for(10ms);
  ASSERT_EQ(out_.size(), 50u);
  std::int64_t least = 100, most = 0;
  for (std::size_t i = 0; i < out_.size(); ++i) {
    const std::int64_t late = out_[i] - 1000 * static_cast<std::int64_t>(i + 1);
    EXPECT_GE(late, 0);
    EXPECT_LE(late, 100);
    least = std::min(least, late);
    most = std::max(most, late);
  }
  EXPECT_LT(least, 20);  // 50 even draws: all above 20 with probability 0.8^50 = 1e-5
  EXPECT_GT(most, 80);
  // Ten at one instant leave in the order in which they came.
  std::string heard;
  for (char c = 'a'; c < 'k'; ++c) computer_->deliver("do", order(std::string("e") + c), test_);
  out_.clear();
  run_for(1ms);
  EXPECT_TRUE(std::is_sorted(out_.begin(), out_.end()));
}

TEST_F(ExecutionTimeTest, TickHasJitterOfItsOwn) {
  fly({.scheduling_jitter = {{"tick", 100us}}});
  deliver_at(10us, order("P" + std::string("\x40\x42\x0f\0\0\0\0\0", 8)));  // every 1,000,000 ns
  run_for(100ms);
  ASSERT_GT(out_.size(), 80u);
  bool late = false;
  for (std::size_t i = 1; i < out_.size(); ++i) {
    EXPECT_GE(out_[i] - out_[i - 1], 1000);
    EXPECT_LE(out_[i] - out_[i - 1], 1100);
    late = late || out_[i] - out_[i - 1] > 1050;
  }
  EXPECT_TRUE(late);
}

TEST_F(ExecutionTimeTest, MistakesAreRefused) {
  EXPECT_THROW(ExecutionTime(-1us), std::invalid_argument);
  EXPECT_THROW(ExecutionTime::uniform(2us, 1us), std::invalid_argument);
  EXPECT_THROW(ExecutionTime::log_normal(1us, -0.1), std::invalid_argument);
  EXPECT_THROW(ExecutionTime::counted_work(std::nan("")), std::invalid_argument);
  EXPECT_THROW(fly({.execution_time_of = {{"gnss", 1us}}}), std::invalid_argument);
  EXPECT_THROW(fly({.scheduling_jitter = {{"create", 1us}}}), std::invalid_argument);
  EXPECT_THROW(fly({.scheduling_jitter = {{"do", -1us}}}), std::invalid_argument);
  EXPECT_THROW(fly({.execution_time = ExecutionTime::counted_work(1)}), std::invalid_argument);
}

}  // namespace
}  // namespace orrery
