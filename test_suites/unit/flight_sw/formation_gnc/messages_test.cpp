// Layouts of the package's messages: what goes in comes out, and nothing else is taken for one.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "formation_gnc/formation_gnc_messages.h"
#include "formation_gnc/mission/crosslink_layer.hpp"
#include "link_model.hpp"

namespace formation_gnc {
namespace {

using formation_gnc_test::Draws;
using formation_gnc_test::Packet;

GnssEpoch full_epoch() {
  GnssEpoch epoch;
  epoch.t_ns = INT64_C(1426636800000000000);
  epoch.count = kChannels;
  for (int k = 0; k < kChannels; ++k) {
    Observation& o = epoch.observation[k];
    o.prn = static_cast<std::uint8_t>(2 * k + 1);
    o.code_m = 2.0e7 + 7e5 * k + 0.123456;
    o.phase_cycles = (k % 2 == 0 ? 1 : -1) * (1.1e8 + 3e6 * k + 0.654321);
    o.cn0_dBHz = 21.0f + 2.0f * static_cast<float>(k);
    o.lock_s = 10.0f * static_cast<float>(k * k);
    o.half_cycle = k == 5;
  }
  epoch.has_fix = true;
  epoch.r_ECEF = flight_support::vec3(6.9e6, -1.23456e5, 8.7e5);
  epoch.v_ECEF = flight_support::vec3(-123.4567, 7.4e3, 1.0e3);
  epoch.sigma_r_m = 1.5f;
  epoch.sigma_v_mps = 0.03f;
  return epoch;
}
const Quaternion kAttitude{0.5, -0.5, 0.5, 0.5};

Packet packet_of(CrosslinkLayer* from, const GnssEpoch& epoch) {
  CrosslinkLayer::Packet packet;
  const std::uint32_t bytes = from->write_measurement(epoch, kAttitude, 3, packet);
  return Packet(packet, packet + bytes);
}

std::uint32_t size_of(const Packet& packet) {
  return static_cast<std::uint32_t>(packet.size());
}

// Half a unit of each field: 5 mm of code, 0.09 mm of phase, 5 mm and 0.5 mm/s of the solution.
TEST(FormationGncMessagesTest, AnEpochOfTwelveSatellitesFitsTwoHundredAndFiftyBytes) {
  CrosslinkLayer chief(Role::kChief, 0, {}), deputy(Role::kDeputy, 0, {});
  const GnssEpoch sent = full_epoch();
  const Packet packet = packet_of(&chief, sent);
  EXPECT_EQ(packet.size(), 240u);
  bool new_session = false;
  ASSERT_EQ(deputy.read(packet.data(), size_of(packet), &new_session),
            CrosslinkLayer::Verdict::kMeasurement);
  EXPECT_TRUE(new_session);
  EXPECT_EQ(deputy.committed(), 3u);
  const GnssEpoch& got = deputy.epoch();
  EXPECT_EQ(got.t_ns, sent.t_ns);
  ASSERT_EQ(got.count, sent.count);
  for (int k = 0; k < kChannels; ++k) {
    EXPECT_EQ(got.observation[k].prn, sent.observation[k].prn);
    EXPECT_EQ(got.observation[k].half_cycle, sent.observation[k].half_cycle);
    EXPECT_NEAR(got.observation[k].code_m, sent.observation[k].code_m, 0.005 + 1e-8);
    EXPECT_NEAR(got.observation[k].phase_cycles, sent.observation[k].phase_cycles,
                0.5 / 1024 + 1e-7);
    EXPECT_NEAR(got.observation[k].cn0_dBHz, sent.observation[k].cn0_dBHz, 0.125);
    EXPECT_NEAR(got.observation[k].lock_s, sent.observation[k].lock_s, 0.051);
  }
  for (int k = 0; k < 3; ++k) {
    EXPECT_NEAR(got.r_ECEF[k], sent.r_ECEF[k], 0.005 + 1e-8);
    EXPECT_NEAR(got.v_ECEF[k], sent.v_ECEF[k], 5.1e-4);
  }
  EXPECT_NEAR(deputy.q_BI().x, -0.5, 1.6e-5);
}

// A phase of 2^39 / 1024 cycles is where 40 bits end: what is beyond stays at the end.
TEST(FormationGncMessagesTest, NumbersBeyondTheirFieldStayAtItsEnd) {
  unsigned char bytes[5];
  formation_gnc_put_int(bytes, 5,
                        formation_gnc_quantised(1e12, 1.0 / 1024, -549755813887.0, 549755813887.0));
  EXPECT_EQ(formation_gnc_get_int(bytes, 5), INT64_C(549755813887));
  formation_gnc_put_int(bytes, 5, -INT64_C(549755813887));
  EXPECT_EQ(formation_gnc_get_int(bytes, 5), -INT64_C(549755813887));
  EXPECT_EQ(formation_gnc_quantised(std::nan(""), 1.0, -1.0, 1.0), 0);
}

TEST(FormationGncMessagesTest, ACommandAndTelemetryComeBackAsTheyWere) {
  const formation_gnc_command c{
      FORMATION_GNC_UPLOAD, FORMATION_GNC_SCIENCE, 10, 3, 77, 5, 9, 12.5, 80.25};
  unsigned char message[FORMATION_GNC_COMMAND_BYTES];
  formation_gnc_put_command(message, &c);
  formation_gnc_command d;
  ASSERT_EQ(formation_gnc_get_command(message, sizeof message, &d), 1);
  EXPECT_EQ(d.opcode, c.opcode);
  EXPECT_EQ(d.mode, c.mode);
  EXPECT_EQ(d.observations, 10u);
  EXPECT_EQ(d.every, 3u);
  EXPECT_EQ(d.number, 77u);
  EXPECT_EQ(d.t_ns, 5);
  EXPECT_EQ(d.end_ns, 9);
  EXPECT_EQ(d.a_m, 12.5);
  EXPECT_EQ(d.b_m, 80.25);

  formation_gnc_telemetry t = {};
  t.mode = FORMATION_GNC_ESCAPE;
  t.t_ns = 42;
  t.a_roe_m[5] = 3.5;
  t.sigma_v_mps[2] = 1e-5;
  t.late = 7;
  t.flags = 9;
  t.measurements_heard = 11;
  t.drag_difference_mps2 = -2e-9;
  t.graphic = {1000, 2, 990.5};
  t.sdcp = {4'000'000'000u, 3, 4e9};
  t.integer[0] = {32, -500'000'000'000};
  t.integer[11] = {1, 7};
  t.nozzle_scale[5] = 1.03;
  t.sigma_nozzle_scale[0] = 0.004;
  unsigned char down[FORMATION_GNC_TELEMETRY_BYTES];
  formation_gnc_put_telemetry(down, &t);
  formation_gnc_telemetry u = {};
  ASSERT_EQ(formation_gnc_get_telemetry(down, sizeof down, &u), 1);
  EXPECT_EQ(u.mode, t.mode);
  EXPECT_EQ(u.t_ns, 42);
  EXPECT_EQ(u.a_roe_m[5], 3.5);
  EXPECT_EQ(u.sigma_v_mps[2], 1e-5);
  EXPECT_EQ(u.late, 7u);
  EXPECT_EQ(u.flags, 9u);
  EXPECT_EQ(u.measurements_heard, 11u);
  EXPECT_EQ(u.drag_difference_mps2, -2e-9);
  EXPECT_EQ(u.graphic.degrees, 1000u);
  EXPECT_EQ(u.graphic.chi2, 990.5);
  EXPECT_EQ(u.sdcp.degrees, 4'000'000'000u);
  EXPECT_EQ(u.sdcp.rejected, 3u);
  EXPECT_EQ(u.integer[0].prn, 32u);
  EXPECT_EQ(u.integer[0].cycles, -500'000'000'000);
  EXPECT_EQ(u.integer[11].cycles, 7);
  EXPECT_EQ(u.integer[5].prn, 0u);
  EXPECT_EQ(u.nozzle_scale[5], 1.03);
  EXPECT_EQ(u.sigma_nozzle_scale[0], 0.004);
}

// A wrong bit anywhere, a byte less or more, one of our own: rejected, and nothing has changed.
TEST(FormationGncMessagesTest, DamagedCutAndOwnPacketsAreRejected) {
  CrosslinkLayer chief(Role::kChief, 0, {}), deputy(Role::kDeputy, 0, {});
  Packet packet = packet_of(&chief, full_epoch());
  bool new_session = false;
  const auto verdict = [&](const Packet& p) {
    return deputy.read(p.data(), size_of(p), &new_session);
  };
  for (std::size_t k = 0; k < packet.size(); ++k) {
    packet[k] ^= 0x04u;
    EXPECT_EQ(verdict(packet), CrosslinkLayer::Verdict::kRejected) << k;
    packet[k] ^= 0x04u;
  }
  for (std::size_t bytes = 0; bytes < packet.size(); ++bytes) {
    EXPECT_EQ(verdict(Packet(packet.begin(), packet.begin() + static_cast<std::ptrdiff_t>(bytes))),
              CrosslinkLayer::Verdict::kRejected);
  }
  EXPECT_EQ(deputy.link().peer_session(), FORMATION_GNC_NO_SESSION);
  EXPECT_EQ(verdict(packet_of(&deputy, full_epoch())), CrosslinkLayer::Verdict::kRejected);
  EXPECT_EQ(verdict(packet), CrosslinkLayer::Verdict::kMeasurement);
}

// Random bytes with a right CRC: the fields behind it are judged, too.
TEST(FormationGncMessagesTest, RandomBodiesUnderASoundHeaderAreSurvived) {
  Draws draws(7);
  CrosslinkLayer deputy(Role::kDeputy, 0, {});
  for (int k = 0; k < 20000; ++k) {
    Packet packet(FORMATION_GNC_PACKET_BYTES);
    for (unsigned char& byte : packet) byte = static_cast<unsigned char>(draws.bits());
    const formation_gnc_header header{
        static_cast<unsigned>(draws.bits() % 5),       0,
        static_cast<std::uint32_t>(draws.bits() % 3),  static_cast<std::uint32_t>(draws.bits() % 2),
        static_cast<std::uint32_t>(draws.bits()),      static_cast<std::uint32_t>(draws.bits()),
        static_cast<std::uint32_t>(draws.bits() % 213)};
    if (draws.uniform() < 0.5)
      packet[FORMATION_GNC_HEADER_BYTES + 16] = static_cast<unsigned char>(draws.bits() % 14);
    packet.resize(formation_gnc_put_packet(packet.data(), &header));
    bool new_session = false;
    deputy.read(packet.data(), size_of(packet), &new_session);
    Payload payload;
    while (deputy.link().take(&payload)) EXPECT_LE(payload.bytes, FORMATION_GNC_PAYLOAD_BYTES);
  }
}

}  // namespace
}  // namespace formation_gnc
