#include <orrery/models/actuators/impulsive_thruster.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <limits>

#include "../support/fake_device_context.hpp"

namespace orrery {
namespace {

constexpr SimTime kStart = from_ns(1'426'464'000'000'000'000);

// The layout of orrery_messages.h, written out: i64 mid_burn_ns, then f64 dv_ECI[3].
ByteBuffer command(std::int64_t mid_burn_ns, const Vec3& dv_ECI) {
  ByteBuffer message(32);
  std::memcpy(message.data(), &mid_burn_ns, 8);
  std::memcpy(message.data() + 8, &dv_ECI.x, 8);
  std::memcpy(message.data() + 16, &dv_ECI.y, 8);
  std::memcpy(message.data() + 24, &dv_ECI.z, 8);
  return message;
}

struct ImpulsiveThrusterTest : testing::Test {
  ImpulsiveThrusterTest() { thruster.start(io); }

  void command_at(Duration from_now, const Vec3& dv_ECI) {
    thruster.from_flight(io, command(io.onboard_ns() + to_ns(from_now), dv_ECI));
  }
  void expect_rejected(std::string_view why) {
    EXPECT_EQ(thruster.rejected(), 1);
    ASSERT_EQ(io.log_lines.size(), 1u);
    EXPECT_EQ(io.log_lines[0].level, DeviceContext::kWarning);
    EXPECT_THAT(io.log_lines[0].text, testing::HasSubstr(std::string(why)));
    io.run_for(weeks(52));
    EXPECT_TRUE(io.impulses.empty());
    EXPECT_EQ(thruster.burns(), 0);
  }

  FakeDeviceContext io{kStart};
  ImpulsiveThruster thruster;
};

TEST_F(ImpulsiveThrusterTest, ImpulseComesAtTheCommandedInstantAndNotBefore) {
  const Vec3 dv_ECI{0.01, -0.02, 0.02};
  command_at(30s, dv_ECI);
  io.run_for(30s - 1ns);
  EXPECT_TRUE(io.impulses.empty());
  io.run_for(1ns);
  ASSERT_EQ(io.impulses.size(), 1u);
  EXPECT_EQ(io.impulses[0].t, kStart + 30s);
  EXPECT_EQ(io.impulses[0].dv_ECI, dv_ECI);
  // |(1, -2, 2)| = 3
  EXPECT_NEAR(thruster.delta_v_mps(), 0.03, 1e-17);
  EXPECT_EQ(thruster.burns(), 1);
}

TEST_F(ImpulsiveThrusterTest, EpochIsReadOnTheOnboardClock) {
  io.clock_offset = -250ms;  // the clock is late, so its 30 s come 30 s from now all the same
  const std::int64_t mid_burn_ns = to_ns(kStart + 30s);
  thruster.from_flight(io, command(mid_burn_ns, {0.1, 0, 0}));
  io.run_for(1min);
  ASSERT_EQ(io.impulses.size(), 1u);
  EXPECT_EQ(io.impulses[0].t, kStart + 30s + 250ms);
}

TEST_F(ImpulsiveThrusterTest, PendingBurnsRunInOrderOfTheirEpochs) {
  command_at(90s, {0.3, 0, 0});
  command_at(30s, {0.1, 0, 0});
  command_at(60s, {0.2, 0, 0});
  io.run_for(2min);
  ASSERT_EQ(io.impulses.size(), 3u);
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(io.impulses[i].t, kStart + (i + 1) * 30s);
    EXPECT_DOUBLE_EQ(io.impulses[i].dv_ECI.x, 0.1 * (i + 1));
  }
  EXPECT_DOUBLE_EQ(thruster.delta_v_mps(), 0.6);
  EXPECT_EQ(thruster.rejected(), 0);
}

TEST_F(ImpulsiveThrusterTest, OppositeBurnsAddUpInDeltaV) {
  command_at(30s, {0.5, 0, 0});
  command_at(40s, {-0.5, 0, 0});
  io.run_for(1min);
  EXPECT_DOUBLE_EQ(thruster.delta_v_mps(), 1.0);
}

TEST_F(ImpulsiveThrusterTest, LostBurnCountsButChangesNothing) {
  command_at(30s, {0.1, 0, 0});
  command_at(60s, {0.2, 0, 0});
  io.run_for(29s);
  io.faults["lost"] = 1;  // set after the command: what counts is the instant of the burn
  io.run_for(2s);
  io.faults.clear();
  io.run_for(1min);
  EXPECT_EQ(thruster.burns(), 2);
  EXPECT_DOUBLE_EQ(thruster.delta_v_mps(), 0.2);
  ASSERT_EQ(io.impulses.size(), 1u);
  EXPECT_EQ(io.impulses[0].t, kStart + 60s);
  ASSERT_EQ(thruster.burn_log().size(), 2u);
  EXPECT_FALSE(thruster.burn_log()[0].executed);
  EXPECT_EQ(thruster.burn_log()[0].t, kStart + 30s);
  EXPECT_EQ(thruster.burn_log()[0].dv_ECI, (Vec3{0.1, 0, 0}));
  EXPECT_TRUE(thruster.burn_log()[1].executed);
}

TEST_F(ImpulsiveThrusterTest, ChannelHoldsWhatWasDelivered) {
  command_at(30s, {0.1, 0, 0});
  command_at(60s, {0.2, 0, 0});
  io.run_for(59s);
  io.faults["lost"] = 1;
  io.run_for(1min);
  ASSERT_EQ(io.samples.size(), 2u);
  EXPECT_EQ(io.samples[0].channel, "dv_mps");
  EXPECT_EQ(io.samples[0].t, kStart + 30s);
  EXPECT_DOUBLE_EQ(io.samples[0].value, 0.1);
  EXPECT_EQ(io.samples[1].value, 0.0);
}

TEST_F(ImpulsiveThrusterTest, ShortestLeadIsAcceptedAndOneNanosecondLessIsNot) {
  command_at(20s, {0.1, 0, 0});
  EXPECT_EQ(thruster.rejected(), 0);
  command_at(20s - 1ns, {0.1, 0, 0});
  EXPECT_EQ(thruster.rejected(), 1);
  io.run_for(1min);
  EXPECT_EQ(thruster.burns(), 1);
}

TEST_F(ImpulsiveThrusterTest, CommandOfAnotherLengthIsRejected) {
  ByteBuffer message = command(to_ns(kStart + 30s), {0.1, 0, 0});
  message.pop_back();
  thruster.from_flight(io, message);
  expect_rejected("31 bytes; accepted: 32");
}

TEST_F(ImpulsiveThrusterTest, EmptyCommandIsRejected) {
  thruster.from_flight(io, {});
  expect_rejected("0 bytes");
}

TEST_F(ImpulsiveThrusterTest, DeltaVThatIsNotANumberIsRejected) {
  command_at(30s, {0, std::numeric_limits<double>::quiet_NaN(), 0});
  expect_rejected("delta-v");
}

TEST_F(ImpulsiveThrusterTest, InfiniteDeltaVIsRejected) {
  command_at(30s, {0, 0, -std::numeric_limits<double>::infinity()});
  expect_rejected("delta-v");
}

// Its square is finite in no component: the magnitude overflows, and must not slip through.
TEST_F(ImpulsiveThrusterTest, DeltaVWhoseSquareOverflowsIsRejected) {
  command_at(30s, {1e200, 0, 0});
  expect_rejected("delta-v");
}

TEST_F(ImpulsiveThrusterTest, DeltaVAboveTheMaximumIsRejected) {
  command_at(30s, {1.0 + 1e-9, 0, 0});
  expect_rejected("delta-v");
}

TEST_F(ImpulsiveThrusterTest, EpochsAtTheEndsOfTheNumberRangeAreRejected) {
  thruster.from_flight(io, command(std::numeric_limits<std::int64_t>::max(), {0.1, 0, 0}));
  EXPECT_EQ(thruster.rejected(), 1);
  thruster.from_flight(io, command(std::numeric_limits<std::int64_t>::min(), {0.1, 0, 0}));
  EXPECT_EQ(thruster.rejected(), 2);
  io.run_for(weeks(52));
  EXPECT_TRUE(io.impulses.empty());
}

TEST(ImpulsiveThrusterOptionsTest, ValuesOutOfRangeAreNamed) {
  const auto expect_refused = [](const ImpulsiveThrusterOptions& options, const char* name) {
    EXPECT_THAT([&] { ImpulsiveThruster thruster(options); },
                testing::ThrowsMessage<std::invalid_argument>(testing::HasSubstr(name)));
  };
  expect_refused({.minimum_lead = -1ns}, "minimum_lead = -1 ns");
  expect_refused({.minimum_lead = 20s, .maximum_lead = 19s}, "maximum_lead");
  expect_refused({.maximum_dv_mps = 0}, "maximum_dv_mps");
  expect_refused({.maximum_dv_mps = std::numeric_limits<double>::quiet_NaN()}, "maximum_dv_mps");
}

}  // namespace
}  // namespace orrery
