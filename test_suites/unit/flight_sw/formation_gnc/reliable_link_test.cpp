#include "formation_gnc/mission/reliable_link.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "link_model.hpp"

namespace formation_gnc {
namespace {

using formation_gnc_test::Draws;
using formation_gnc_test::LinkModel;
using formation_gnc_test::LinkQuality;
using formation_gnc_test::Packet;

constexpr std::int64_t kSecond_ns = 1000000000;

Payload payload_of(std::uint32_t number) {
  Payload payload;
  payload.bytes = 4;
  orrery_put_u32(payload.data, number);
  return payload;
}

// An end of the link: sends a numbered message now and then, an empty packet every 10 s.
struct End {
  End(unsigned its_role, std::uint32_t session, const ReliableLinkOptions& options)
      : role(its_role), link(session, options) {}

  Packet packet(unsigned kind, const unsigned char* body, std::uint32_t bytes) {
    Packet out(FORMATION_GNC_PACKET_BYTES);
    if (bytes > 0) std::copy(body, body + bytes, out.begin() + FORMATION_GNC_HEADER_BYTES);
    const formation_gnc_header header{
        kind, role, link.session(), link.peer_session(), link.acknowledged(), 0, bytes};
    out.resize(formation_gnc_put_packet(out.data(), &header));
    return out;
  }
  void step(std::int64_t now_ns, LinkModel* out) {
    if (now_ns % (10 * kSecond_ns) == 0)
      out->send(now_ns, packet(FORMATION_GNC_ACKNOWLEDGE, {}, 0));
    std::uint32_t sequence = 0;
    Payload payload;
    while (link.next_due(now_ns, &sequence, &payload)) {
      unsigned char body[4 + FORMATION_GNC_PAYLOAD_BYTES];
      orrery_put_u32(body, sequence);
      std::copy(payload.data, payload.data + payload.bytes, body + 4);
      out->send(now_ns, packet(FORMATION_GNC_RELIABLE, body, 4 + payload.bytes));
    }
    if (link.acknowledgement_due()) out->send(now_ns, packet(FORMATION_GNC_ACKNOWLEDGE, {}, 0));
  }
  void hear(const Packet& p) {
    formation_gnc_header header;
    ASSERT_TRUE(formation_gnc_get_packet(p.data(), static_cast<std::uint32_t>(p.size()), &header));
    if (link.heard(header) == ReliableLink::Heard::kStale) return;
    if (header.kind == FORMATION_GNC_RELIABLE) {
      link.receive(header, p.data() + FORMATION_GNC_HEADER_BYTES, header.body_bytes);
    }
    Payload payload;
    while (link.take(&payload)) taken.push_back(orrery_get_u32(payload.data));
  }

  unsigned role;
  ReliableLink link;
  std::vector<std::uint32_t> taken;
};

std::vector<std::uint32_t> numbers(std::uint32_t count) {
  std::vector<std::uint32_t> all;
  for (std::uint32_t k = 0; k < count; ++k) all.push_back(k);
  return all;
}

struct ReliableLinkPropertyTest : testing::TestWithParam<std::uint64_t> {};

// Property: whatever the link loses, doubles and reorders, each message comes once and in order.
// The model is the list of what was sent.
TEST_P(ReliableLinkPropertyTest, EachMessageComesOnceAndInOrder) {
  Draws draws(GetParam());
  LinkQuality quality;
  quality.p_on = 0.4 * draws.uniform();
  quality.duplicates = 0.1;
  quality.sigma = 1.5;
  LinkModel to_b(draws.bits(), quality), to_a(draws.bits(), quality);
  End a(0, 3, {}), b(1, 8, {});
  std::uint32_t from_a = 0, from_b = 0;
  for (int k = 0; k < 6 * 3600; ++k) {
    const std::int64_t now_ns = k * kSecond_ns;
    const bool sending = k < 3 * 3600;
    if (sending && draws.uniform() < 0.02 && a.link.send(payload_of(from_a))) ++from_a;
    if (sending && draws.uniform() < 0.02 && b.link.send(payload_of(from_b))) ++from_b;
    a.step(now_ns, &to_b);
    b.step(now_ns, &to_a);
    for (const Packet& p : to_b.arrivals(now_ns)) b.hear(p);
    for (const Packet& p : to_a.arrivals(now_ns)) a.hear(p);
  }
  EXPECT_EQ(b.taken, numbers(from_a));
  EXPECT_EQ(a.taken, numbers(from_b));
  EXPECT_EQ(a.link.unacknowledged(), 0u);
  EXPECT_EQ(b.link.unacknowledged(), 0u);
  EXPECT_GT(from_a, 100u);
  EXPECT_GT(to_b.reordered, 0);
  EXPECT_GT(to_b.lost, 0);
}
INSTANTIATE_TEST_SUITE_P(Seeds, ReliableLinkPropertyTest,
                         testing::Range(std::uint64_t{1}, std::uint64_t{13}));

struct ReliableLinkTest : testing::Test {
  LinkModel to_b{1, {.p_on = 0, .p_off = 1, .sigma = 0, .duplicates = 0}};
  LinkModel to_a{2, {.p_on = 0, .p_off = 1, .sigma = 0, .duplicates = 0}};
  std::int64_t now_ns = 0;
  void run(End* a, End* b, int seconds) {
    for (int k = 0; k < seconds; ++k, now_ns += kSecond_ns) {
      a->step(now_ns, &to_b);
      b->step(now_ns, &to_a);
      for (const Packet& p : to_b.arrivals(now_ns)) b->hear(p);
      for (const Packet& p : to_a.arrivals(now_ns)) a->hear(p);
    }
  }
};

// What the receiver's earlier life did not acknowledge comes to the next one; what it did
// acknowledge does not.
TEST_F(ReliableLinkTest, ARestartedReceiverGetsWhatWasNotAcknowledged) {
  End a(0, 0, {});
  End b(1, 0, {});
  run(&a, &b, 12);
  ASSERT_TRUE(a.link.send(payload_of(0)));
  run(&a, &b, 12);
  EXPECT_EQ(b.taken, numbers(1));
  to_b.blacked_out_until_ns = now_ns + 40 * kSecond_ns;
  ASSERT_TRUE(a.link.send(payload_of(1)));
  ASSERT_TRUE(a.link.send(payload_of(2)));
  run(&a, &b, 30);
  End restarted(1, 1, {});
  run(&a, &restarted, 300);
  EXPECT_THAT(restarted.taken, testing::ElementsAre(1u, 2u));
  EXPECT_EQ(a.link.unacknowledged(), 0u);
}

TEST_F(ReliableLinkTest, ARestartedSenderBeginsAnew) {
  End a(0, 4, {}), b(1, 0, {});
  run(&a, &b, 12);
  for (std::uint32_t k = 0; k < 3; ++k) ASSERT_TRUE(a.link.send(payload_of(k)));
  run(&a, &b, 30);
  End restarted(0, 5, {});
  ASSERT_TRUE(restarted.link.send(payload_of(3)));
  run(&restarted, &b, 60);
  EXPECT_EQ(b.taken, numbers(4));
}

// A packet of the peer's earlier life neither acknowledges nor brings anything.
TEST_F(ReliableLinkTest, PacketsOfAnEarlierSessionAreStale) {
  End a(0, 7, {}), b(1, 0, {});
  run(&a, &b, 12);
  End old(0, 6, {});
  formation_gnc_header header;
  const Packet packet = old.packet(FORMATION_GNC_ACKNOWLEDGE, {}, 0);
  ASSERT_TRUE(
      formation_gnc_get_packet(packet.data(), static_cast<std::uint32_t>(packet.size()), &header));
  EXPECT_EQ(b.link.heard(header), ReliableLink::Heard::kStale);
}

// Timeouts of 20, 30, 45, then 60 s: in 10 min of silence the first message goes out 12 times.
TEST_F(ReliableLinkTest, BacksOffToAMinuteAndNoFurther) {
  End a(0, 0, {}), b(1, 0, {});
  run(&a, &b, 12);
  to_b.blacked_out_until_ns = INT64_MAX;
  ASSERT_TRUE(a.link.send(payload_of(0)));
  run(&a, &b, 600);
  // At 0, 20, 50, 95, 155, 215, ..., 575 s.
  EXPECT_EQ(a.link.retransmissions(), 11u);
}

TEST_F(ReliableLinkTest, AClockSetBackDoesNotSilenceIt) {
  End a(0, 0, {}), b(1, 0, {});
  now_ns = 10000 * kSecond_ns;
  run(&a, &b, 12);
  to_b.blacked_out_until_ns = INT64_MAX;
  ASSERT_TRUE(a.link.send(payload_of(0)));
  run(&a, &b, 2);
  std::uint32_t sequence = 0;
  Payload payload;
  EXPECT_TRUE(a.link.next_due(now_ns - 5000 * kSecond_ns, &sequence, &payload));
}

TEST_F(ReliableLinkTest, RefusesMoreThanItsWindow) {
  ReliableLink link(0, {});
  for (std::uint32_t k = 0; k < ReliableLink::kWindow; ++k) EXPECT_TRUE(link.send(payload_of(k)));
  EXPECT_FALSE(link.send(payload_of(99)));
}

}  // namespace
}  // namespace formation_gnc
