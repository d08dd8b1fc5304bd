// Two ends of the protocol over a bad link, without navigation or thrusters.
#include "formation_gnc/mission/transition_protocol.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "link_model.hpp"
#include "support/orbit/constants.hpp"

namespace formation_gnc {
namespace {

using formation_gnc_test::Draws;
using formation_gnc_test::LinkModel;
using formation_gnc_test::LinkQuality;
using formation_gnc_test::Packet;

using flight_support::kSecond_ns;

// One spacecraft's computer: the protocol on its link, a packet every 10 s, a record that survives.
class Computer {
 public:
  struct Done {
    std::uint32_t id;
    Mode mode;
    std::int64_t t_ns;
    bool late, emergency;
  };

  explicit Computer(Role role, const ReliableLinkOptions& link_options = {})
      : role_(role), link_options_(link_options) {
    boot();
  }
  void boot() {
    TransitionRecord record;
    if (stored_bytes_ > 0) {
      EXPECT_TRUE(restore(stored_, stored_bytes_, &record));
    }
    link_ = std::make_unique<ReliableLink>(boots_++, link_options_);
    protocol_ = std::make_unique<TransitionProtocol>(role_, options, record);
  }
  void step(std::int64_t now_ns, LinkModel* out) {
    protocol_->poll(now_ns, link_.get());
    settle(now_ns);
    if (now_ns % (10 * kSecond_ns) == 0) send(now_ns, FORMATION_GNC_ACKNOWLEDGE, nullptr, 0, out);
    std::uint32_t sequence = 0;
    Payload payload;
    while (link_->next_due(now_ns, &sequence, &payload)) {
      unsigned char body[4 + FORMATION_GNC_PAYLOAD_BYTES];
      orrery_put_u32(body, sequence);
      std::copy(payload.data, payload.data + payload.bytes, body + 4);
      send(now_ns, FORMATION_GNC_RELIABLE, body, 4 + payload.bytes, out);
    }
    if (link_->acknowledgement_due()) {
      send(now_ns, FORMATION_GNC_ACKNOWLEDGE, nullptr, 0, out);
    }
  }
  void hear(const Packet& p, std::int64_t now_ns) {
    formation_gnc_header header;
    ASSERT_TRUE(formation_gnc_get_packet(p.data(), static_cast<std::uint32_t>(p.size()), &header));
    const auto heard = link_->heard(header);
    if (heard == ReliableLink::Heard::kStale) return;
    if (heard == ReliableLink::Heard::kNewSession) protocol_->peer_restarted();
    protocol_->hear_committed(header.committed);
    if (header.kind == FORMATION_GNC_RELIABLE) {
      link_->receive(header, p.data() + FORMATION_GNC_HEADER_BYTES, header.body_bytes);
    }
    Payload payload;
    while (link_->take(&payload)) {
      EXPECT_TRUE(protocol_->receive(payload, now_ns));
      settle(now_ns);
    }
  }
  TransitionProtocol& protocol() { return *protocol_; }
  void settle(std::int64_t now_ns) {
    TransitionProtocol::Execution done;
    while (protocol_->take(&done)) {
      executed.push_back({done.event.id, done.event.mode, now_ns, done.late, done.emergency});
    }
    if (protocol_->changed()) stored_bytes_ = store(protocol_->record(), stored_);
  }

  TransitionOptions options;
  std::vector<Done> executed;

 private:
  void send(std::int64_t now_ns, unsigned kind, const unsigned char* body, std::uint32_t bytes,
            LinkModel* out) {
    Packet packet(FORMATION_GNC_PACKET_BYTES);
    if (bytes > 0) std::copy(body, body + bytes, packet.begin() + FORMATION_GNC_HEADER_BYTES);
    const formation_gnc_header header{kind,
                                      static_cast<unsigned>(role_),
                                      link_->session(),
                                      link_->peer_session(),
                                      link_->acknowledged(),
                                      protocol_->committed_id(),
                                      bytes};
    packet.resize(formation_gnc_put_packet(packet.data(), &header));
    out->send(now_ns, packet);
  }

  Role role_;
  ReliableLinkOptions link_options_;
  std::uint32_t boots_ = 0;
  unsigned char stored_[kTransitionRecordBytes];
  std::uint32_t stored_bytes_ = 0;
  std::unique_ptr<ReliableLink> link_;
  std::unique_ptr<TransitionProtocol> protocol_;
};

struct Pair {
  Pair(std::uint64_t seed, const LinkQuality& quality, const ReliableLinkOptions& link = {})
      : chief(Role::kChief, link),
        deputy(Role::kDeputy, link),
        to_deputy(2 * seed, quality),
        to_chief(2 * seed + 1, quality) {}
  void step() {
    chief.step(now_ns, &to_deputy);
    deputy.step(now_ns, &to_chief);
    for (const Packet& p : to_deputy.arrivals(now_ns)) deputy.hear(p, now_ns);
    for (const Packet& p : to_chief.arrivals(now_ns)) chief.hear(p, now_ns);
    now_ns += kSecond_ns;
  }
  void run(int seconds) {
    for (int k = 0; k < seconds; ++k) step();
  }
  bool announce(Mode mode, int in_s) {
    Event event;
    event.mode = mode;
    event.begin_ns = now_ns + in_s * kSecond_ns;
    return chief.protocol().announce(event, now_ns);
  }
  bool announce_observation(int in_s) {
    Event event;
    event.kind = Event::Kind::kObservation;
    event.begin_ns = now_ns + in_s * kSecond_ns;
    event.end_ns = event.begin_ns + 10 * kSecond_ns;
    return chief.protocol().announce(event, now_ns);
  }

  std::int64_t now_ns = 1000 * kSecond_ns;
  Computer chief, deputy;
  LinkModel to_deputy, to_chief;
};

constexpr LinkQuality kPerfect{.p_on = 0, .p_off = 1, .sigma = 0.1, .duplicates = 0};

std::vector<std::uint32_t> ids(const Computer& computer) {
  std::vector<std::uint32_t> all;
  for (const auto& done : computer.executed) {
    if (!done.emergency) all.push_back(done.id);
  }
  return all;
}

struct TransitionPropertyTest : testing::TestWithParam<std::uint64_t> {};

// Property: over the reference crosslink both execute the same transitions, each once, in order and
// at one epoch. Observations may be withdrawn, then on both. A day each.
TEST_P(TransitionPropertyTest, BothExecuteEveryTransitionOnceInOrderAndTogether) {
  Draws draws(GetParam());
  Pair pair(GetParam(), {});
  int announced = 0;
  for (int k = 0; k < 86400; ++k) {
    pair.step();
    if (k > 82800 || pair.chief.protocol().has_pending() || draws.uniform() > 0.002) continue;
    const bool observation = draws.uniform() < 0.5;
    const int in_s = 400 + static_cast<int>(2000 * draws.uniform());
    const Mode mode = draws.uniform() < 0.5 ? Mode::kTransfer : Mode::kScience;
    announced += observation ? pair.announce_observation(in_s) : pair.announce(mode, in_s);
  }
  const int withdrawn = static_cast<int>(pair.chief.protocol().withdrawn());
  EXPECT_GT(announced, 30);
  ASSERT_EQ(static_cast<int>(pair.chief.executed.size()), announced - withdrawn);
  EXPECT_EQ(ids(pair.chief), ids(pair.deputy));
  EXPECT_TRUE(std::is_sorted(pair.chief.executed.begin(), pair.chief.executed.end(),
                             [](const auto& a, const auto& b) { return a.id < b.id; }));
  for (std::size_t k = 0; k < pair.chief.executed.size(); ++k) {
    EXPECT_EQ(pair.chief.executed[k].t_ns, pair.deputy.executed[k].t_ns) << k;
    EXPECT_FALSE(pair.deputy.executed[k].late);
  }
  EXPECT_GT(pair.to_deputy.lost, 500);
}

// Property: likewise when both restart at random, and the link is dead for up to 20 min at a time.
// Epochs may differ then (counted as late), events and order may not; an observation that the
// deputy heard of too late still counts as executed, late.
TEST_P(TransitionPropertyTest, RestartsAndBlackoutsLoseDoubleAndSwapNothing) {
  Draws draws(1000 + GetParam());
  Pair pair(GetParam(), {});
  int announced = 0;
  for (int k = 0; k < 86400; ++k) {
    pair.step();
    if (k < 80000) {
      if (draws.uniform() < 2e-4) pair.chief.boot();
      if (draws.uniform() < 2e-4) pair.deputy.boot();
      if (draws.uniform() < 2e-4) {
        const auto length = static_cast<std::int64_t>(1200 * draws.uniform()) * kSecond_ns;
        (draws.uniform() < 0.5 ? pair.to_chief : pair.to_deputy).blacked_out_until_ns =
            pair.now_ns + length;
      }
    }
    if (k > 78000 || pair.chief.protocol().has_pending() || draws.uniform() > 0.002) continue;
    const int in_s = 400 + static_cast<int>(2000 * draws.uniform());
    announced += pair.announce(draws.uniform() < 0.5 ? Mode::kTransfer : Mode::kScience, in_s);
  }
  EXPECT_GT(announced, 20);
  EXPECT_EQ(static_cast<int>(pair.chief.executed.size()), announced);
  EXPECT_EQ(ids(pair.chief), ids(pair.deputy));
  EXPECT_EQ(pair.chief.protocol().mode(), pair.deputy.protocol().mode());
}

// Property: an emergency at any instant ends with both in it, whatever was announced or committed,
// and only an announcement made afterwards leads out.
TEST_P(TransitionPropertyTest, AnEmergencyOfEitherReachesTheOtherAndVoidsWhatWasAnnounced) {
  Draws draws(2000 + GetParam());
  Pair pair(GetParam(), {});
  pair.run(60);
  for (int round = 0; round < 20; ++round) {
    ASSERT_TRUE(pair.announce(Mode::kScience, 900));
    pair.run(static_cast<int>(1100 * draws.uniform()));
    const bool by_chief = draws.uniform() < 0.5;
    (by_chief ? pair.chief : pair.deputy)
        .protocol()
        .emergency(Mode::kSafe, FORMATION_GNC_NAVIGATION_INVALID, pair.now_ns);
    pair.run(1800);
    ASSERT_EQ(pair.chief.protocol().mode(), Mode::kSafe) << round;
    ASSERT_EQ(pair.deputy.protocol().mode(), Mode::kSafe) << round;
    ASSERT_FALSE(pair.chief.protocol().has_pending()) << round;
    ASSERT_FALSE(pair.deputy.protocol().has_pending()) << round;
    ASSERT_TRUE(pair.announce(Mode::kStandby, 900));
    pair.run(3600);
    ASSERT_EQ(pair.chief.protocol().mode(), Mode::kStandby) << round;
    ASSERT_EQ(pair.deputy.protocol().mode(), Mode::kStandby) << round;
  }
}
INSTANTIATE_TEST_SUITE_P(Seeds, TransitionPropertyTest,
                         testing::Range(std::uint64_t{1}, std::uint64_t{9}));

// The acknowledgement is lost for 5 min from whenever: the switch is at the announced epoch.
TEST(TransitionProtocolTest, FiveMinutesOfSilenceNeverSeparateTheTwo) {
  for (int begin_s = 0; begin_s < 900; begin_s += 20) {
    for (const bool both : {false, true}) {
      Pair pair(5, kPerfect);
      pair.run(30);
      ASSERT_TRUE(pair.announce(Mode::kScience, 900));
      pair.run(begin_s);
      pair.to_chief.blacked_out_until_ns = pair.now_ns + 300 * kSecond_ns;
      if (both) pair.to_deputy.blacked_out_until_ns = pair.now_ns + 300 * kSecond_ns;
      pair.run(2400);
      ASSERT_EQ(pair.chief.executed.size(), 1u) << begin_s;
      ASSERT_EQ(pair.deputy.executed.size(), 1u) << begin_s;
      EXPECT_EQ(pair.chief.executed[0].t_ns, pair.deputy.executed[0].t_ns) << begin_s;
    }
  }
}

TEST(TransitionProtocolTest, WithoutAnAcknowledgementAModeIsPostponedAndAnObservationWithdrawn) {
  Pair pair(6, kPerfect);
  pair.run(30);
  pair.to_chief.blacked_out_until_ns = pair.now_ns + 3600 * kSecond_ns;
  ASSERT_TRUE(pair.announce(Mode::kTransfer, 900));
  pair.run(4800);
  // First at 900 s; asked at 540 s, 1080 s, ... for 900 s later: 6 times within the hour.
  EXPECT_EQ(pair.chief.protocol().postponed(), 6u);
  ASSERT_EQ(pair.deputy.executed.size(), 1u);
  EXPECT_FALSE(pair.deputy.executed[0].late);
  pair.to_chief.blacked_out_until_ns = pair.now_ns + 3600 * kSecond_ns;
  ASSERT_TRUE(pair.announce_observation(900));
  pair.run(1200);
  EXPECT_EQ(pair.chief.protocol().withdrawn(), 1u);
  EXPECT_EQ(pair.chief.executed.size(), 1u);
  EXPECT_EQ(pair.deputy.executed.size(), 1u);
  EXPECT_FALSE(pair.deputy.protocol().has_pending());
}

// The defect of the paper's July 2024, as an option of the link: an announcement that is lost once
// is lost. Here the leader sees it and postpones; with retransmission the same seeds need not.
TEST(TransitionProtocolTest, OnlyRetransmissionKeepsTheAnnouncedEpochs) {
  for (const bool retransmit : {true, false}) {
    ReliableLinkOptions link;
    link.retransmit = retransmit;
    std::uint32_t postponed = 0;
    for (std::uint64_t seed = 1; seed <= 40; ++seed) {
      Pair pair(seed, {}, link);
      pair.run(60);
      ASSERT_TRUE(pair.announce(Mode::kScience, 900));
      pair.run(920);
      postponed += pair.chief.protocol().postponed();
    }
    // 1 - (5/6)^40 = 0.9993 that one of 40 is lost on its way; any later packet acknowledges.
    if (retransmit) {
      EXPECT_EQ(postponed, 0u);
    } else {
      EXPECT_GT(postponed, 0u);
    }
  }
}

TEST(TransitionProtocolTest, TheFollowerAnnouncesNothing) {
  TransitionProtocol follower(Role::kDeputy, {}, {});
  Event event;
  event.begin_ns = 3600 * kSecond_ns;
  EXPECT_FALSE(follower.announce(event, 0));
}

TEST(TransitionProtocolTest, ATornRecordIsNotRestored) {
  TransitionRecord record;
  record.mode = Mode::kScience;
  record.executed_id = 7;
  unsigned char bytes[kTransitionRecordBytes];
  const std::uint32_t count = store(record, bytes);
  TransitionRecord read;
  ASSERT_TRUE(restore(bytes, count, &read));
  EXPECT_EQ(read.mode, Mode::kScience);
  EXPECT_EQ(read.executed_id, 7u);
  for (std::uint32_t cut = 0; cut < count; ++cut) EXPECT_FALSE(restore(bytes, cut, &read)) << cut;
  for (std::uint32_t k = 0; k < count; ++k) {
    bytes[k] ^= 0x10u;
    EXPECT_FALSE(restore(bytes, count, &read)) << k;
    bytes[k] ^= 0x10u;
  }
}

}  // namespace
}  // namespace formation_gnc
