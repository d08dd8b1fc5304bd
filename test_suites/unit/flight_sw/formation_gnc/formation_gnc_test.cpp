// The package as a class, without the flight ABI: two of them on a wire.
#include "formation_gnc/mission/formation_gnc.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <memory>
#include <string>

#include "link_model.hpp"

namespace formation_gnc {
namespace {

using formation_gnc_test::Draws;
using formation_gnc_test::Packet;

constexpr std::int64_t kSecond_ns = 1000000000;
constexpr std::int64_t kEpoch_ns = (INT64_C(2358) * 604800 + 4 * 86400) * kSecond_ns;

std::uint32_t size_of(const Packet& packet) {
  return static_cast<std::uint32_t>(packet.size());
}

// What a bus keeps of what the package says.
struct RecordingBus final : Outputs {
  void out_crosslink(const unsigned char* packet, std::uint32_t bytes) override {
    EXPECT_LE(bytes, FORMATION_GNC_PACKET_BYTES);
    sent.emplace_back(packet, packet + bytes);
  }
  bool out_maneuver(std::int64_t, const double*) override {
    ++maneuvers;
    return true;
  }
  void out_observation(std::int64_t, std::int64_t) override { ++observations; }
  void out_mode(std::int64_t t_ns, std::uint32_t mode) override {
    modes.push_back(mode);
    mode_ns = t_ns;
  }
  void out_estimate(const RelativeOutput&) override { ++estimates; }
  void out_telemetry(const unsigned char*, std::uint32_t) override {}
  void out_gnss(const char* command) override { asked += command; }
  void request_tick(std::int64_t onboard_ns) override { tick_ns = onboard_ns; }
  void log(LogLevel, const char* line) override { logged += std::string(line) + "\n"; }
  std::int32_t load(std::uint32_t slot, unsigned char* to, std::uint32_t capacity) override {
    const auto found = stored.find(slot);
    if (found == stored.end() || found->second.size() > capacity) return -1;
    std::copy(found->second.begin(), found->second.end(), to);
    return static_cast<std::int32_t>(found->second.size());
  }
  void store(std::uint32_t slot, const unsigned char* from, std::uint32_t bytes) override {
    stored[slot] = Packet(from, from + bytes);
  }

  std::vector<Packet> sent;
  std::vector<std::uint32_t> modes;
  std::int64_t mode_ns = 0, tick_ns = 0;
  int maneuvers = 0, observations = 0, estimates = 0;
  std::string asked, logged;
  std::map<std::uint32_t, Packet> stored;
};

Configuration configuration_of(Role role) {
  Configuration configuration;
  configuration.role = role;
  configuration.mission.navigation_timeout_s = 3000.0;  // no receiver speaks here
  return configuration;
}

struct Computer {
  explicit Computer(Role its_role) : role(its_role) { boot(kEpoch_ns); }
  void boot(std::int64_t now_ns) {
    gnc = std::make_unique<FormationGnc>(bus, configuration_of(role), Boot{now_ns, boots++});
  }
  Role role;
  std::uint32_t boots = 0;
  RecordingBus bus;
  std::unique_ptr<FormationGnc> gnc;
};

Packet command(unsigned opcode, Mode mode, std::int64_t t_ns, std::uint32_t number = 1) {
  formation_gnc_command c = {};
  c.opcode = opcode;
  c.mode = static_cast<unsigned>(mode);
  c.number = number;
  c.t_ns = t_ns;
  c.end_ns = t_ns + 72000 * kSecond_ns;
  c.every = 3;
  Packet message(FORMATION_GNC_COMMAND_BYTES);
  formation_gnc_put_command(message.data(), &c);
  return message;
}

// Both speak once a second here, since without a receiver nothing else would carry
// acknowledgements.
struct FormationGncTest : testing::Test {
  void hand_over(Computer* from, Computer* to) {
    std::vector<Packet> flying;
    flying.swap(from->bus.sent);
    for (const Packet& p : flying) {
      if (!silent) {
        EXPECT_TRUE(to->gnc->in_crosslink(now_ns, p.data(), size_of(p)));
      }
    }
  }
  void run(int seconds) {
    for (int k = 0; k < seconds; ++k, now_ns += kSecond_ns) {
      for (Computer* c : {&chief, &deputy}) {
        if (c->bus.tick_ns <= now_ns) c->gnc->in_tick(now_ns);
        introduce(c);
      }
      hand_over(&chief, &deputy);
      hand_over(&deputy, &chief);
    }
  }
  // As an epoch of a receiver without satellites would be sent.
  void introduce(Computer* c) {
    if (now_ns / kSecond_ns % 10 != 0) return;
    CrosslinkLayer voice(c->role, c->boots - 1, {});
    GnssEpoch empty;
    empty.t_ns = now_ns;
    CrosslinkLayer::Packet packet;
    const std::uint32_t bytes = voice.write_measurement(
        empty, Quaternion(), c->gnc->mission().protocol().committed_id(), packet);
    c->bus.sent.emplace_back(packet, packet + bytes);
  }
  std::int64_t now_ns = kEpoch_ns;
  bool silent = false;
  Computer chief{Role::kChief}, deputy{Role::kDeputy};
};

TEST_F(FormationGncTest, AsksItsReceiverForWhatItNeedsAndAgainAfterSilence) {
  EXPECT_THAT(chief.bus.asked, testing::HasSubstr("LOG RANGEB ONTIME 10\r\n"));
  EXPECT_THAT(chief.bus.asked, testing::HasSubstr("LOG BESTXYZB ONTIME 10\r\n"));
  EXPECT_THAT(chief.bus.asked, testing::HasSubstr("LOG RAWEPHEMB ONCHANGED\r\n"));
  chief.bus.asked.clear();
  chief.gnc->in_tick(kEpoch_ns + 61 * kSecond_ns);
  EXPECT_THAT(chief.bus.asked, testing::HasSubstr("RANGEB"));
}

// Whichever spacecraft hears the command, the chief keeps it and both act on it.
TEST_F(FormationGncTest, ACommandToEitherChangesTheModeOfBothAtOneEpoch) {
  for (const bool to_chief : {true, false}) {
    run(60);
    const Packet message =
        command(FORMATION_GNC_UPLOAD, to_chief ? Mode::kTransfer : Mode::kStandby, 0);
    Computer& hears = to_chief ? chief : deputy;
    EXPECT_TRUE(hears.gnc->in_command(now_ns, message.data(), size_of(message)));
    run(850);
    const Mode before = to_chief ? Mode::kStandby : Mode::kTransfer;
    EXPECT_EQ(chief.gnc->mode(), before);
    run(100);
    EXPECT_EQ(chief.gnc->mode(), to_chief ? Mode::kTransfer : Mode::kStandby);
    EXPECT_EQ(deputy.gnc->mode(), chief.gnc->mode());
    EXPECT_EQ(chief.bus.mode_ns, deputy.bus.mode_ns);
  }
  EXPECT_THAT(chief.bus.modes, testing::ElementsAre(0u, 1u, 0u));
  EXPECT_EQ(deputy.bus.modes, chief.bus.modes);
}

// The chief's plan and the announcement under way survive its restart; so does the deputy's mode.
TEST_F(FormationGncTest, PlanAndTransitionsSurviveRestarts) {
  run(60);
  const Packet now = command(FORMATION_GNC_UPLOAD, Mode::kTransfer, 0, 1);
  const Packet later = command(FORMATION_GNC_UPLOAD, Mode::kStandby, now_ns + 5000 * kSecond_ns, 2);
  EXPECT_TRUE(chief.gnc->in_command(now_ns, now.data(), size_of(now)));
  EXPECT_TRUE(chief.gnc->in_command(now_ns, later.data(), size_of(later)));
  run(100);
  chief.boot(now_ns);
  EXPECT_EQ(chief.gnc->mission().plan().size(), 1u);
  run(300);
  deputy.boot(now_ns);
  run(600);
  EXPECT_EQ(chief.gnc->mode(), Mode::kTransfer);
  EXPECT_EQ(deputy.gnc->mode(), Mode::kTransfer);
  deputy.boot(now_ns);
  EXPECT_EQ(deputy.gnc->mode(), Mode::kTransfer);
  // 3000 s after the last restart of its own the chief goes to safe, and the deputy follows.
  run(3000);
  EXPECT_EQ(chief.gnc->mode(), Mode::kSafe);
  EXPECT_EQ(deputy.gnc->mode(), Mode::kSafe);
}

TEST_F(FormationGncTest, DamagedStorageIsSaidAndSurvived) {
  run(60);
  const Packet later = command(FORMATION_GNC_UPLOAD, Mode::kStandby, now_ns + 5000 * kSecond_ns);
  EXPECT_TRUE(chief.gnc->in_command(now_ns, later.data(), size_of(later)));
  ASSERT_EQ(chief.bus.stored.count(1), 1u);
  chief.bus.stored[1][7] ^= 1u;
  chief.bus.stored[0] = {1, 2, 3};
  chief.boot(now_ns);
  EXPECT_THAT(chief.bus.logged, testing::HasSubstr("the stored plan is damaged"));
  EXPECT_THAT(chief.bus.logged, testing::HasSubstr("the stored mode is damaged"));
  EXPECT_EQ(chief.gnc->mission().plan().size(), 0u);
}

// Random bytes, random lengths, on every input: rejected, or for the stream passed over.
TEST_F(FormationGncTest, RandomBytesAreRejectedAndChangeNothing) {
  Draws draws(3);
  for (int k = 0; k < 20000; ++k) {
    Packet bytes(1 + draws.bits() % 300);
    for (unsigned char& byte : bytes) byte = static_cast<unsigned char>(draws.bits());
    Computer& c = draws.uniform() < 0.5 ? chief : deputy;
    EXPECT_FALSE(c.gnc->in_crosslink(now_ns, bytes.data(), size_of(bytes)));
    EXPECT_FALSE(c.gnc->in_command(now_ns, bytes.data(), size_of(bytes)));
    bytes.resize(ORRERY_BUS_BYTES);
    EXPECT_FALSE(c.gnc->in_bus(now_ns, bytes.data(), size_of(bytes)));
    c.gnc->in_gnss(now_ns, bytes.data(), size_of(bytes));
    now_ns += kSecond_ns / 10;
  }
  EXPECT_EQ(chief.gnc->mode(), Mode::kStandby);
  EXPECT_EQ(deputy.gnc->mode(), Mode::kStandby);
  EXPECT_EQ(chief.gnc->mission().plan().size(), 0u);
  EXPECT_EQ(chief.bus.maneuvers + deputy.bus.maneuvers, 0);
}

// Sound packets with random reliable payloads: those of no known type are rejected; numbers in
// those that are known are judged.
TEST_F(FormationGncTest, RandomPayloadsInSoundPacketsAreSurvived) {
  Draws draws(4);
  for (std::uint32_t session = 0; session < 3000; ++session) {
    Packet packet(FORMATION_GNC_PACKET_BYTES);
    for (unsigned char& byte : packet) byte = static_cast<unsigned char>(draws.bits());
    orrery_put_u32(packet.data() + FORMATION_GNC_HEADER_BYTES, 1);
    packet[FORMATION_GNC_HEADER_BYTES + 4] = static_cast<unsigned char>(draws.bits() % 19);
    const formation_gnc_header header{
        FORMATION_GNC_RELIABLE, 0, session, 0, 0, 0, static_cast<std::uint32_t>(draws.bits() % 69)};
    packet.resize(formation_gnc_put_packet(packet.data(), &header));
    deputy.gnc->in_crosslink(now_ns, packet.data(), size_of(packet));
    now_ns += kSecond_ns;
  }
  EXPECT_EQ(deputy.bus.maneuvers, 0);
}

TEST(FormationGncConfigurationTest, RolesFollowNamesAndMistakesAreNamed) {
  Configuration c;
  char message[192];
  const auto parse = [&](const std::string& text, const char* spacecraft) {
    return parse_configuration(text.data(), text.size(), spacecraft, &c, message, sizeof message);
  };
  EXPECT_TRUE(parse("", "chief"));
  EXPECT_EQ(c.role, Role::kChief);
  EXPECT_TRUE(parse("", "osc"));
  EXPECT_EQ(c.role, Role::kDeputy);
  EXPECT_TRUE(parse(" role = chief # whatever the name\n\nseparation_m=25\ninitial_mode=science\n",
                    "deputy"));
  EXPECT_EQ(c.role, Role::kChief);
  EXPECT_EQ(c.maneuvers.separation_m, 25.0);
  EXPECT_EQ(c.initial_mode, Mode::kScience);
  EXPECT_FALSE(parse("separation=25", "dsc"));
  EXPECT_STREQ(message, "configuration line 1: 'separation' is no key of this package");
  EXPECT_FALSE(parse("\nseparation_m=nan", "dsc"));
  EXPECT_THAT(message, testing::HasSubstr("line 2: 'separation_m' is not a number in [1, 10000]"));
  EXPECT_FALSE(parse("escape=1\nescape=1", "dsc"));
  EXPECT_THAT(message, testing::HasSubstr("'escape' is given twice"));
  EXPECT_FALSE(parse("role=both", "dsc"));
  EXPECT_FALSE(parse("announcement_lead_s=300", "dsc"));
  EXPECT_THAT(message, testing::HasSubstr("is not above announcement_guard_s"));
}

// An onboard clock 5 s fast, and calls that come up to 30 ms late: the offset is found to a ms.
TEST(OnboardClockTest, TheLeastDelayedOfEightEpochsSetsTheOffset) {
  OnboardClock clock;
  EXPECT_EQ(clock.gps_ns(77), 77);
  const std::int64_t delay_ms[8] = {30, 12, 25, 1, 17, 9, 22, 14};
  for (int k = 0; k < 8; ++k) {
    const std::int64_t gps_ns = kEpoch_ns + 10 * k * kSecond_ns;
    clock.compare(gps_ns, gps_ns + 5 * kSecond_ns + delay_ms[k] * 1000000);
  }
  EXPECT_EQ(clock.gps_ns(kEpoch_ns), kEpoch_ns - 5 * kSecond_ns - 1000000);
  EXPECT_EQ(clock.onboard_ns(clock.gps_ns(123)), 123);
}

}  // namespace
}  // namespace formation_gnc
