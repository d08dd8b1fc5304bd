#include <orrery/harness/record/channel.hpp>
#include <orrery/harness/record/channel_table.hpp>

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

TEST(ChannelTest, FrameIsTheWordBeforeTheUnit) {
  EXPECT_EQ(frame_of("dsc/navigation/error_RTN_m"), "RTN");
  EXPECT_EQ(frame_of("dsc/bus/omega_BI_B_radps"), "B");
  EXPECT_EQ(frame_of("dsc/magnetometer/field_S"), "S");
  EXPECT_EQ(frame_of("dsc/sun_sensor/angle_rad"), "");
  EXPECT_EQ(frame_of("RTN"), "");
}

TEST(ChannelTest, AVectorHasItsNormAndItsAxes) {
  Channel channel("dsc/navigation/error_RTN_m", ChannelKind::kVector, from_ns(5));
  channel.add(from_ns(10), Channel::Components{2, -3, 6});
  channel.extend_to(from_ns(20));
  EXPECT_EQ(channel.frame(), "RTN");
  EXPECT_EQ(channel.unit(), "m");
  EXPECT_EQ(channel.last().value, 7);
  const Channel along_t = channel.along(1);
  EXPECT_EQ(along_t.name(), "dsc/navigation/error_RTN_m along T");
  EXPECT_EQ(along_t.unit(), "m");
  EXPECT_EQ(along_t.last().value, -3);
  EXPECT_EQ(along_t.start(), from_ns(5));
  EXPECT_EQ(along_t.end(), from_ns(20));
  EXPECT_EQ(Channel("a/r_ECI_m", ChannelKind::kVector).axis_name(2), "z");
}

TEST(ChannelTest, AStateIsRecordedWhenItChanges) {
  Channel mode("dsc/mode", ChannelKind::kState);
  mode.add(from_ns(0), "IDLE");
  mode.add(from_ns(10), "IDLE");
  mode.add(from_ns(20), "SAFE");
  mode.add(from_ns(30), "IDLE");
  ASSERT_EQ(mode.samples().size(), 3u);
  EXPECT_EQ(mode.text(mode.samples()[1]), "SAFE");
  EXPECT_EQ(mode.state_at(from_ns(19)), "IDLE");
  EXPECT_EQ(mode.state_at(from_ns(20)), "SAFE");
  EXPECT_EQ(mode.state_at(from_ns(-1)), "");
  EXPECT_EQ(mode.only("IDLE").samples().size(), 2u);
  EXPECT_EQ(mode.only("IDLE").kind(), ChannelKind::kEvent);
  EXPECT_EQ(testing::PrintToString(mode), "\"dsc/mode\" (3 states, the last IDLE)");
}

TEST(ChannelTest, EveryEventIsRecorded) {
  Channel burns("dsc/thruster/burn", ChannelKind::kEvent);
  burns.add(from_ns(30), "done");
  burns.add(from_ns(20), "done");
  EXPECT_EQ(burns.samples().size(), 2u);
  EXPECT_EQ(burns.first_time(), from_ns(20));
  EXPECT_EQ(burns.only("lost").first_time(), std::nullopt);
  EXPECT_EQ(testing::PrintToString(burns.only("lost")), "\"dsc/thruster/burn lost\" (no events)");
}

TEST(ChannelTest, AnotherKindIsRefusedByName) {
  Channel mode("dsc/mode", ChannelKind::kState);
  EXPECT_THAT([&] { mode.add(from_ns(0), 1.0); },
              testing::ThrowsMessage<std::logic_error>(testing::HasSubstr(
                  "\"dsc/mode\" records states; it was given or asked for a number")));
  EXPECT_THROW(mode.along(0), std::logic_error);
  EXPECT_THROW(Channel("a/x_m").only("SAFE"), std::logic_error);
}

// Whatever a test calls a channel, its file stays in its folder.
TEST(ChannelTableTest, FileNamesHavePlainCharacters) {
  EXPECT_EQ(file_name_of("dsc/sun_sensor/angle_rad"), "dsc.sun_sensor.angle_rad");
  EXPECT_EQ(file_name_of("../../etc/x"), "_......etc.x");
  EXPECT_EQ(file_name_of("a b\n\xC3\xA9"), "a_b___");
  EXPECT_EQ(file_name_of(""), "_");
  EXPECT_EQ(file_name_of(std::string(500, 'x')).size(), 200u);
}

TEST(ChannelTableTest, ColumnsNameAxisAndUnit) {
  using testing::ElementsAre;
  EXPECT_THAT(columns_of(Channel("a/b/angle_rad")), ElementsAre("t_GPS_ns", "angle_rad"));
  EXPECT_THAT(columns_of(Channel("a/v_ECI_mps", ChannelKind::kVector)),
              ElementsAre("t_GPS_ns", "v_ECI_x_mps", "v_ECI_y_mps", "v_ECI_z_mps"));
  EXPECT_THAT(columns_of(Channel("a/wind", ChannelKind::kVector)),
              ElementsAre("t_GPS_ns", "wind_x", "wind_y", "wind_z"));
  EXPECT_THAT(columns_of(Channel("mode", ChannelKind::kState)), ElementsAre("t_GPS_ns", "mode"));
}

}  // namespace
}  // namespace orrery
