// Simulated time with the host's clock: never early, and late is counted as late. Bounds are from
// below only, since a busy host may be late by anything.
#include <orrery/harness/flight/processor_model.hpp>
#include <orrery/harness/remote/pace.hpp>

#include <gmock/gmock.h>

#include <chrono>
#include <cmath>
#include <thread>

namespace orrery {
namespace {

using namespace std::chrono_literals;
using HostClock = std::chrono::steady_clock;

TEST(PaceTest, NothingBeginsBeforeItsTime) {
  Pace pace({.rate = 100});  // 1 s simulated in 10 ms
  const auto begin = HostClock::now();
  pace.wait_for(from_ns(0));
  pace.wait_for(from_ns(0) + 1s);
  EXPECT_GE(HostClock::now() - begin, 10ms);
  pace.wait_for(from_ns(0) + 3s);
  EXPECT_GE(HostClock::now() - begin, 30ms);
  EXPECT_EQ(pace.figures().events, 3u);
}

TEST(PaceTest, WhoAnswersTooLateMissesTheDeadline) {
  Pace pace({.rate = 1, .deadline = 5ms});
  pace.wait_for(from_ns(0));
  std::this_thread::sleep_for(20ms);  // a processor that takes so long
  EXPECT_GE(pace.wait_for(from_ns(0) + 1ms), 19ms);
  EXPECT_GE(pace.figures().missed, 1u);
  EXPECT_GE(pace.figures().most_lateness, 19ms);
}

TEST(PaceTest, RefusesRatesThatAreNone) {
  EXPECT_THROW(Pace({.rate = -1}), std::invalid_argument);
  EXPECT_THROW(Pace({.rate = std::nan("")}), std::invalid_argument);
  EXPECT_THROW(Pace({.rate = 1, .deadline = -1ns}), std::invalid_argument);
  EXPECT_FALSE(Pace(PaceSetting{}).on());
}

// 700,000 instructions at 1.4 cycles each and 700 MHz take 1.4 ms.
TEST(ProcessorModelTest, TimeIsInstructionsTimesCyclesOverClock) {
  const auto time = execution_time_on(processor_model("arm1176 700 MHz"), 1us);
  EXPECT_EQ(time.of_call(nullptr, 700'000), 1400us + 1us);
  EXPECT_TRUE(time.counts_work());
  for (const ProcessorModel& model : processor_models()) {
    EXPECT_GT(model.origin.size(), 30u) << model.name;
  }
}

TEST(ProcessorModelTest, RefusesWhatIsNoProcessor) {
  try {
    processor_model("z80");
    FAIL() << "it has one";
  } catch (const std::invalid_argument& error) {
    EXPECT_THAT(error.what(),
                testing::AllOf(testing::HasSubstr("z80"), testing::HasSubstr("leon3-class")));
  }
  EXPECT_THROW(execution_time_on(ProcessorModel{.clock_Hz = 0}), std::invalid_argument);
  EXPECT_THROW(execution_time_on(ProcessorModel{.cycles_per_instruction = -1}),
               std::invalid_argument);
}

}  // namespace
}  // namespace orrery
