#include <orrery/models/radio/crosslink_radio.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "../support/fake_device_context.hpp"

namespace orrery {
namespace {

const ByteBuffer kFrame{std::byte{1}, std::byte{2}, std::byte{3}};

TEST(CrosslinkRadioTest, FrameOfFlightSoftwareGoesToEveryPeerInOrder) {
  FakeDeviceContext io(from_ns(5));
  CrosslinkRadio radio({.peers = {"osc", "third"}});
  radio.start(io);
  radio.from_flight(io, kFrame);
  ASSERT_EQ(io.transmissions.size(), 2u);
  EXPECT_EQ(io.transmissions[0].to, "osc");
  EXPECT_EQ(io.transmissions[1].to, "third");
  for (const auto& sent : io.transmissions) {
    EXPECT_EQ(sent.frame, kFrame);
    EXPECT_EQ(sent.t, from_ns(5));
  }
  EXPECT_TRUE(io.to_flight_log.empty());
}

TEST(CrosslinkRadioTest, FrameFromTheAirGoesToFlightSoftwareUnchanged) {
  FakeDeviceContext io;
  CrosslinkRadio radio({.peers = {"osc"}});
  radio.start(io);
  radio.from_air(io, "osc", kFrame);
  ASSERT_EQ(io.to_flight_log.size(), 1u);
  EXPECT_EQ(io.to_flight_log[0].bytes, kFrame);
  EXPECT_TRUE(io.transmissions.empty());
}

TEST(CrosslinkRadioTest, PeerGivenTwiceIsRefusedByName) {
  EXPECT_THAT(
      [] {
        CrosslinkRadio radio({.peers = {"osc", "dsc", "osc"}});
      },
      testing::ThrowsMessage<std::invalid_argument>(testing::HasSubstr("\"osc\"")));
}

TEST(CrosslinkRadioTest, EmptyPeerNameIsRefused) {
  EXPECT_THROW(CrosslinkRadio({.peers = {""}}), std::invalid_argument);
}

}  // namespace
}  // namespace orrery
