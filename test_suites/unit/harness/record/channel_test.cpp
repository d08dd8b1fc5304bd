#include <orrery/harness/record/channel.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace orrery {
namespace {

TEST(ChannelTest, UnitIsTheLastWordOfTheNameIfItIsOne) {
  EXPECT_EQ(unit_of("dsc/sun_sensor/angle_rad"), "rad");
  EXPECT_EQ(unit_of("osc/thruster/dv_mps"), "mps");
  EXPECT_EQ(unit_of("dsc/gnss/satellites_used"), "");
  EXPECT_EQ(unit_of("dsc/beacon/s"), "");  // a name, not a unit
  EXPECT_EQ(unit_of("flag"), "");
  EXPECT_EQ(unit_of(""), "");
}

TEST(ChannelTest, UnitMayBeGivenInstead) {
  EXPECT_EQ(Channel("a/b/angle_rad").unit(), "rad");
  EXPECT_EQ(Channel("a/b/angle", "rad").unit(), "rad");
}

TEST(ChannelTest, SamplesKeepTheOrderOfRecording) {
  Channel channel("a/b/x_m");
  channel.add(from_ns(20), 2.0);
  channel.add(from_ns(10), 1.0);
  using Sample = Channel::Sample;
  EXPECT_THAT(channel.samples(), testing::ElementsAre(Sample{.t = from_ns(20), .value = 2.0},
                                                      Sample{.t = from_ns(10), .value = 1.0}));
  EXPECT_EQ(channel.last().value, 1.0);
}

TEST(ChannelTest, MinimumAndMaximumAreOverAllSamples) {
  Channel channel("a/b/x_m");
  for (const double value : {3.0, -7.5, 0.0, 12.25}) channel.add(from_ns(0), value);
  EXPECT_EQ(channel.min(), -7.5);
  EXPECT_EQ(channel.max(), 12.25);
}

// A comparison with NaN is false, so an assertion on an extreme would pass over it.
TEST(ChannelTest, NanIsNotPassedOverByTheExtremes) {
  Channel channel("a/b/x_m");
  for (const double value : {1.0, std::numeric_limits<double>::quiet_NaN(), 2.0}) {
    channel.add(from_ns(0), value);
  }
  EXPECT_TRUE(std::isnan(channel.min()));
  EXPECT_TRUE(std::isnan(channel.max()));
}

TEST(ChannelTest, ExtremesOfAnEmptyChannelAreRefusedByName) {
  const Channel channel("a/b/x_m");
  EXPECT_THAT([&] { static_cast<void>(channel.max()); },
              testing::ThrowsMessage<std::logic_error>(testing::HasSubstr("a/b/x_m")));
  EXPECT_THROW(static_cast<void>(channel.min()), std::logic_error);
  EXPECT_THROW(static_cast<void>(channel.last()), std::logic_error);
}

}  // namespace
}  // namespace orrery
