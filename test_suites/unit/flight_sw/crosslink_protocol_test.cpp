#include "formation_keeping/crosslink_protocol.hpp"

#include <gtest/gtest.h>

#include <array>

#include "flight_test_support.hpp"
#include "formation_keeping_messages.h"

namespace formation_keeping {

using namespace flight_support;

namespace {

using Message = std::array<unsigned char, kCrosslinkBytes>;
using Verdict = CrosslinkReceiver::Verdict;

GnssFix fix_at(int k) {
  flight_test::Noise noise(static_cast<std::uint64_t>(k));
  const std::int64_t t_ns = flight_test::kEpoch_ns + k * 10 * kSecond_ns;
  return flight_test::noisy_fix(t_ns, flight_test::state_of_mean(flight_test::reference_chief()),
                                &noise);
}

Message packed(CrosslinkSender* sender, int k) {
  unsigned char raw[kCrosslinkBytes];
  sender->pack(fix_at(k), raw);
  Message message;
  std::copy(raw, raw + kCrosslinkBytes, message.begin());
  return message;
}

struct CrosslinkProtocolTest : testing::Test {
  CrosslinkProtocolTest() {
    for (int k = 0; k < 200; ++k) sent.push_back(packed(&sender, k));
  }
  Verdict receive(int k) {
    return receiver.receive(sent[static_cast<std::size_t>(k)].data(), kCrosslinkBytes);
  }
  CrosslinkSender sender{Role::kChief, 0};
  CrosslinkReceiver receiver{Role::kChief};
  std::vector<Message> sent;
};

TEST_F(CrosslinkProtocolTest, CarriesAStateToTheBit) {
  ASSERT_EQ(receive(0), Verdict::kAccepted);
  EXPECT_EQ(receiver.fix().epoch_ns, fix_at(0).epoch_ns);
  for (int k = 0; k < 3; ++k) {
    EXPECT_EQ(receiver.fix().r_ECEF[k], fix_at(0).r_ECEF[k]);
    EXPECT_EQ(receiver.fix().v_ECEF[k], fix_at(0).v_ECEF[k]);
  }
  EXPECT_EQ(receiver.fix().sigma_r_m, 1.5);
  EXPECT_EQ(receiver.fix().sigma_v_mps, 0.03);
}

TEST_F(CrosslinkProtocolTest, LossOfAnyMessageCostsThatOneOnly) {
  for (int lost = 0; lost < 20; ++lost) {
    CrosslinkReceiver fresh(Role::kChief);
    for (std::size_t k = 0; k < 20; ++k) {
      if (static_cast<int>(k) == lost) continue;
      EXPECT_EQ(fresh.receive(sent[k].data(), kCrosslinkBytes), Verdict::kAccepted) << k;
    }
  }
}

TEST_F(CrosslinkProtocolTest, EveryDuplicateIsRefusedAtOnceAndLater) {
  for (int k = 0; k < 64; ++k) {
    EXPECT_EQ(receive(k), Verdict::kAccepted);
    EXPECT_EQ(receive(k), Verdict::kDuplicate);
  }
  for (int k = 0; k < 64; ++k) EXPECT_EQ(receive(k), Verdict::kDuplicate) << k;
}

TEST_F(CrosslinkProtocolTest, SwappedNeighboursAreBothAccepted) {
  for (int k = 0; k < 60; k += 2) {
    EXPECT_EQ(receive(k + 1), Verdict::kAccepted);
    EXPECT_EQ(receive(k), Verdict::kAccepted);
    EXPECT_EQ(receiver.fix().epoch_ns, fix_at(k).epoch_ns);
  }
}

TEST_F(CrosslinkProtocolTest, TheWindowIsSixtyFourMessages) {
  ASSERT_EQ(receive(100), Verdict::kAccepted);
  EXPECT_EQ(receive(37), Verdict::kAccepted);  // 63 behind
  EXPECT_EQ(receive(36), Verdict::kStale);     // 64 behind
}

// A blackout longer than the window.
TEST_F(CrosslinkProtocolTest, RecoversFromALongOutage) {
  ASSERT_EQ(receive(0), Verdict::kAccepted);
  EXPECT_EQ(receive(199), Verdict::kAccepted);
  EXPECT_EQ(receive(198), Verdict::kAccepted);
}

TEST_F(CrosslinkProtocolTest, ARestartedSenderIsHeardAndItsPastIsStale) {
  for (int k = 0; k < 100; ++k) receive(k);
  CrosslinkSender restarted(Role::kChief, 1);
  const Message first = packed(&restarted, 150);
  EXPECT_EQ(receiver.receive(first.data(), kCrosslinkBytes), Verdict::kAccepted);
  EXPECT_EQ(receiver.receive(first.data(), kCrosslinkBytes), Verdict::kDuplicate);
  EXPECT_EQ(receive(101), Verdict::kStale);
}

TEST_F(CrosslinkProtocolTest, NoFlippedBitPasses) {
  for (std::size_t bit = 0; bit < 8 * kCrosslinkBytes; ++bit) {
    Message flipped = sent[0];
    flipped[bit / 8] = static_cast<unsigned char>(flipped[bit / 8] ^ (1u << (bit % 8)));
    EXPECT_EQ(receiver.receive(flipped.data(), kCrosslinkBytes), Verdict::kMalformed) << bit;
  }
}

TEST_F(CrosslinkProtocolTest, WrongLengthAndWrongSenderAreRefused) {
  EXPECT_EQ(receiver.receive(sent[0].data(), kCrosslinkBytes - 1), Verdict::kMalformed);
  EXPECT_EQ(receiver.receive(sent[0].data(), 0), Verdict::kMalformed);
  CrosslinkSender deputy(Role::kDeputy, 0);
  const Message own = packed(&deputy, 0);
  EXPECT_EQ(receiver.receive(own.data(), kCrosslinkBytes), Verdict::kMalformed);
}

// The sequence of a spacecraft that sends every 10 s wraps after 1361 years; one that counts
// otherwise must not deafen the receiver.
TEST_F(CrosslinkProtocolTest, TheSequenceWraps) {
  const auto with_sequence = [&](std::uint32_t sequence) {
    Message message = sent[0];
    orrery_put_u32(message.data() + 8, sequence);
    orrery_put_u32(message.data() + 84, orrery_crc32(message.data(), 84));
    return receiver.receive(message.data(), kCrosslinkBytes);
  };
  EXPECT_EQ(with_sequence(0xFFFFFFFEu), Verdict::kAccepted);
  EXPECT_EQ(with_sequence(1u), Verdict::kAccepted);
  EXPECT_EQ(with_sequence(0xFFFFFFFFu), Verdict::kAccepted);
  EXPECT_EQ(with_sequence(0xFFFFFFFEu), Verdict::kDuplicate);
}

}  // namespace
}  // namespace formation_keeping
