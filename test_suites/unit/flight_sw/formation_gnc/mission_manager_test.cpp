#include "formation_gnc/mission/mission_manager.hpp"

#include <gtest/gtest.h>

#include "link_model.hpp"
#include "support/orbit/constants.hpp"

namespace formation_gnc {
namespace {

using flight_support::kSecond_ns;
constexpr std::int64_t kBoot_ns = 1000000 * kSecond_ns;

formation_gnc_command upload(std::uint32_t number, Mode mode, std::int64_t t_ns) {
  formation_gnc_command c = {};
  c.opcode = FORMATION_GNC_UPLOAD;
  c.number = number;
  c.mode = static_cast<unsigned>(mode);
  c.t_ns = t_ns;
  if (mode == Mode::kTransfer) c.end_ns = t_ns + 72000 * kSecond_ns;
  if (mode == Mode::kScience) c.observations = 2, c.every = 3;
  return c;
}

// Both managers on a perfect link without delay: what one says the other hears in the same second.
struct MissionManagerTest : testing::Test {
  void hand_over(ReliableLink* from, ReliableLink* to, Role role, MissionManager* receiver,
                 std::uint32_t committed) {
    const unsigned number = static_cast<unsigned>(role);
    formation_gnc_header header{FORMATION_GNC_RELIABLE,
                                number,
                                from->session(),
                                from->peer_session(),
                                from->acknowledged(),
                                committed,
                                0};
    if (to->heard(header) == ReliableLink::Heard::kNewSession) {
      receiver->protocol().peer_restarted();
    }
    receiver->protocol().hear_committed(committed);
    std::uint32_t sequence = 0;
    Payload payload;
    while (from->next_due(now_ns, &sequence, &payload)) {
      unsigned char body[4 + FORMATION_GNC_PAYLOAD_BYTES];
      orrery_put_u32(body, sequence);
      std::copy(payload.data, payload.data + payload.bytes, body + 4);
      EXPECT_TRUE(to->receive(header, body, 4 + payload.bytes));
    }
    while (to->take(&payload)) EXPECT_TRUE(receiver->protocol().receive(payload, now_ns));
  }
  void run(int seconds) {
    for (int k = 0; k < seconds; ++k, now_ns += kSecond_ns) {
      if (partner_speaks) health.partner_heard_ns = now_ns;
      chief.watch(now_ns, health);
      deputy.watch(now_ns, health);
      chief.poll(now_ns, &chief_link);
      deputy.poll(now_ns, &deputy_link);
      if (!partner_speaks) continue;
      hand_over(&chief_link, &deputy_link, Role::kChief, &deputy, chief.protocol().committed_id());
      hand_over(&deputy_link, &chief_link, Role::kDeputy, &chief, 0);
    }
  }

  std::int64_t now_ns = kBoot_ns;
  MissionManager::Health health{true, false, kBoot_ns, 0.0};
  bool partner_speaks = true;
  MissionManager chief{Role::kChief, {}, {}, {}, kBoot_ns};
  MissionManager deputy{Role::kDeputy, {}, {}, {}, kBoot_ns};
  ReliableLink chief_link{0, {}}, deputy_link{0, {}};
};

TEST_F(MissionManagerTest, ThePlanIsFollowedInTimeOnBoth) {
  run(60);
  EXPECT_EQ(chief.command(upload(2, Mode::kScience, kBoot_ns + 9000 * kSecond_ns)), nullptr);
  EXPECT_EQ(chief.command(upload(1, Mode::kTransfer, kBoot_ns + 3000 * kSecond_ns)), nullptr);
  run(2939);
  EXPECT_EQ(chief.mode(), Mode::kStandby);
  run(2);
  EXPECT_EQ(chief.mode(), Mode::kTransfer);
  EXPECT_EQ(deputy.mode(), Mode::kTransfer);
  EXPECT_EQ(deputy.protocol().record().current.end_ns, kBoot_ns + 75000 * kSecond_ns);
  run(6000);
  EXPECT_EQ(chief.mode(), Mode::kScience);
  EXPECT_EQ(deputy.mode(), Mode::kScience);
  EXPECT_EQ(chief.plan().size(), 0u);
}

TEST_F(MissionManagerTest, AnEntryIsReplacedRemovedAndClearedAndTheFullPlanRefuses) {
  const std::int64_t later_ns = kBoot_ns + 90000 * kSecond_ns;
  for (std::uint32_t k = 0; k < CommandPlan::kCapacity; ++k) {
    EXPECT_EQ(chief.command(upload(k, Mode::kStandby, later_ns - k)), nullptr);
  }
  EXPECT_NE(chief.command(upload(99, Mode::kStandby, later_ns)), nullptr);
  EXPECT_EQ(chief.plan().entry(0).number, CommandPlan::kCapacity - 1);
  EXPECT_EQ(chief.command(upload(3, Mode::kScience, later_ns + 5)), nullptr);
  EXPECT_EQ(chief.plan().size(), CommandPlan::kCapacity);
  EXPECT_EQ(chief.plan().entry(CommandPlan::kCapacity - 1).number, 3u);
  formation_gnc_command c = upload(3, Mode::kStandby, 0);
  c.opcode = FORMATION_GNC_REMOVE;
  EXPECT_EQ(chief.command(c), nullptr);
  EXPECT_NE(chief.command(c), nullptr);
  c.opcode = FORMATION_GNC_CLEAR;
  EXPECT_EQ(chief.command(c), nullptr);
  EXPECT_EQ(chief.plan().size(), 0u);
}

TEST_F(MissionManagerTest, ThePlanSurvivesStorageAndADamagedOneIsRefused) {
  CommandPlan plan;
  ASSERT_TRUE(plan.upload(upload(4, Mode::kTransfer, 17)));
  ASSERT_TRUE(plan.upload(upload(5, Mode::kScience, 12)));
  unsigned char bytes[CommandPlan::kStoredBytes];
  const std::uint32_t count = plan.store(bytes);
  CommandPlan read;
  ASSERT_TRUE(read.restore(bytes, count));
  ASSERT_EQ(read.size(), 2u);
  EXPECT_EQ(read.entry(0).number, 5u);
  EXPECT_EQ(read.entry(1).end_ns, 17 + 72000 * kSecond_ns);
  for (std::uint32_t cut = 0; cut < count; ++cut) EXPECT_FALSE(read.restore(bytes, cut));
  for (std::uint32_t k = 0; k < count; ++k) {
    bytes[k] ^= 1u;
    EXPECT_FALSE(read.restore(bytes, count)) << k;
    bytes[k] ^= 1u;
  }
}

TEST_F(MissionManagerTest, InvalidCommandsAreRefused) {
  formation_gnc_command c = upload(1, Mode::kTransfer, 0);
  c.end_ns = 0;
  EXPECT_NE(chief.command(c), nullptr);
  c = upload(1, Mode::kScience, 0);
  c.every = 0;
  EXPECT_NE(chief.command(c), nullptr);
  c = upload(1, Mode::kEscape, 0);
  EXPECT_NE(chief.command(c), nullptr);
  c = upload(1, Mode::kTransfer, 0);
  c.a_m = std::nan("");
  EXPECT_NE(chief.command(c), nullptr);
  c = upload(1, Mode::kStandby, 0);
  c.opcode = 9;
  EXPECT_NE(chief.command(c), nullptr);
}

// Timeouts: 900 s without navigation, 1800 s without the partner, in transfer and science only.
TEST_F(MissionManagerTest, FaultsLeadToSafeOnBothAndOnlyStandbyLeadsOut) {
  run(60);
  health.navigation_valid = false;
  run(3600);
  EXPECT_EQ(chief.mode(), Mode::kStandby);
  health.navigation_valid = true;
  chief.command(upload(1, Mode::kScience, 0));
  run(1000);
  ASSERT_EQ(deputy.mode(), Mode::kScience);
  health.navigation_valid = false;
  run(895);
  EXPECT_EQ(chief.mode(), Mode::kScience);
  run(10);
  EXPECT_EQ(chief.mode(), Mode::kSafe);
  EXPECT_EQ(deputy.mode(), Mode::kSafe);
  health.navigation_valid = true;
  chief.command(upload(2, Mode::kScience, 0));
  run(2000);
  EXPECT_EQ(chief.mode(), Mode::kSafe);
  chief.command(upload(3, Mode::kStandby, 0));
  run(2000);
  EXPECT_EQ(chief.mode(), Mode::kStandby);
  EXPECT_EQ(deputy.mode(), Mode::kStandby);
}

TEST_F(MissionManagerTest, ASilentPartnerAnEmptyTankAndACloseApproachAreSeen) {
  run(60);
  chief.command(upload(1, Mode::kTransfer, 0));
  run(1000);
  ASSERT_EQ(deputy.mode(), Mode::kTransfer);
  partner_speaks = false;
  run(1795);
  EXPECT_EQ(deputy.mode(), Mode::kTransfer);
  run(10);
  EXPECT_EQ(chief.mode(), Mode::kSafe);
  EXPECT_EQ(deputy.mode(), Mode::kSafe);
  EXPECT_EQ(deputy.protocol().record().fault, std::uint32_t{FORMATION_GNC_PARTNER_SILENT});
  health.must_escape = true;
  deputy.watch(now_ns, health);
  EXPECT_EQ(deputy.mode(), Mode::kEscape);
  EXPECT_EQ(deputy.protocol().record().fault, std::uint32_t{FORMATION_GNC_SEPARATION});

  MissionManager poor(
      Role::kDeputy, {},
      [] {
        TransitionRecord record;
        record.mode = Mode::kScience;
        return record;
      }(),
      {}, now_ns);
  poor.watch(now_ns, {true, false, now_ns, 15.1});
  EXPECT_EQ(poor.protocol().record().fault, std::uint32_t{FORMATION_GNC_PROPELLANT_LOW});
}

// Every third orbit from one orbit after the beginning on, until all have been made; the geometry
// is right once per orbit, here at multiples of 5700 s.
TEST_F(MissionManagerTest, ACampaignPlacesItsObservationsEveryThirdOrbit) {
  constexpr double kPeriod_s = 5700.0;
  run(60);
  chief.command(upload(1, Mode::kScience, 0));
  run(1000);
  ASSERT_EQ(chief.mode(), Mode::kScience);
  const std::int64_t begin_ns = now_ns;
  std::vector<std::int64_t> middles;
  TransitionProtocol::Execution done;
  for (int k = 0; k < 50000; ++k) {
    std::int64_t earliest_ns = 0;
    if (chief.wants_observation(now_ns, kPeriod_s, &earliest_ns)) {
      const std::int64_t period_ns = 5700 * kSecond_ns;
      chief.place_observation((earliest_ns / period_ns + 1) * period_ns, now_ns);
    }
    run(1);
    while (chief.protocol().take(&done)) {
      if (done.event.kind == Event::Kind::kObservation) {
        middles.push_back((done.event.begin_ns + done.event.end_ns) / 2);
        EXPECT_EQ(done.event.end_ns - done.event.begin_ns, 10 * kSecond_ns);
      }
    }
    deputy.protocol().take(&done);
  }
  ASSERT_EQ(middles.size(), 2u);
  EXPECT_GE(middles[0] - begin_ns, 4700 * kSecond_ns);
  EXPECT_EQ(middles[1] - middles[0], 3 * 5700 * kSecond_ns);
}

}  // namespace
}  // namespace formation_gnc
