#include "formation_gnc/mission/crosslink_layer.hpp"

#include <cstring>

namespace formation_gnc {
namespace {

static_assert(kChannels == FORMATION_GNC_SATELLITES, "a packet holds an epoch");
static_assert(FORMATION_GNC_PACKET_BYTES <= 250, "what a measurement may cost on the air");

constexpr unsigned kHalfCycle = 1;

// Its own to each role, so that a packet of ours that comes back is not taken for the other's.
Role other(Role role) {
  return role == Role::kChief ? Role::kDeputy : Role::kChief;
}

formation_gnc_satellite packed(const Observation& o) {
  return {o.prn,          o.half_cycle ? kHalfCycle : 0,   o.code_m,
          o.phase_cycles, static_cast<double>(o.cn0_dBHz), static_cast<double>(o.lock_s)};
}

Observation unpacked(const formation_gnc_satellite& s) {
  Observation o;
  o.prn = static_cast<std::uint8_t>(s.prn);
  o.code_m = s.code_m;
  o.phase_cycles = s.phase_cycles;
  o.cn0_dBHz = static_cast<float>(s.cn0_dBHz);
  o.lock_s = static_cast<float>(s.lock_s);
  o.half_cycle = (s.flags & kHalfCycle) != 0;
  return o;
}

}  // namespace

std::uint32_t CrosslinkLayer::seal(unsigned kind, std::uint32_t body_bytes, std::uint32_t committed,
                                   Packet& packet) const {
  const formation_gnc_header header{kind,
                                    static_cast<unsigned>(role_),
                                    link_.session(),
                                    link_.peer_session(),
                                    link_.acknowledged(),
                                    committed,
                                    body_bytes};
  return formation_gnc_put_packet(packet, &header);
}

std::uint32_t CrosslinkLayer::write_measurement(const GnssEpoch& epoch, const Quaternion& q_BI,
                                                std::uint32_t committed, Packet& packet) {
  formation_gnc_measurement m = {};
  m.t_ns = epoch.t_ns;
  m.q_BI[0] = q_BI.w, m.q_BI[1] = q_BI.x, m.q_BI[2] = q_BI.y, m.q_BI[3] = q_BI.z;
  m.has_solution = epoch.has_fix ? 1 : 0;
  for (int k = 0; k < 3; ++k) {
    m.r_ECEF[k] = epoch.r_ECEF[k];
    m.v_ECEF[k] = epoch.v_ECEF[k];
  }
  m.sigma_r_m = static_cast<double>(epoch.sigma_r_m);
  m.sigma_v_mps = static_cast<double>(epoch.sigma_v_mps);
  m.satellites = static_cast<unsigned>(epoch.count);
  for (int k = 0; k < epoch.count; ++k) m.satellite[k] = packed(epoch.observation[k]);
  const std::uint32_t bytes =
      formation_gnc_put_measurement(packet + FORMATION_GNC_HEADER_BYTES, &m);
  return seal(FORMATION_GNC_MEASUREMENT, bytes, committed, packet);
}

std::uint32_t CrosslinkLayer::write_due(std::int64_t now_ns, std::uint32_t committed,
                                        Packet& packet) {
  std::uint32_t sequence = 0;
  Payload payload;
  if (link_.next_due(now_ns, &sequence, &payload)) {
    link_.acknowledgement_due();  // this packet acknowledges, too
    unsigned char* body = packet + FORMATION_GNC_HEADER_BYTES;
    orrery_put_u32(body, sequence);
    std::memcpy(body + 4, payload.data, payload.bytes);
    return seal(FORMATION_GNC_RELIABLE, 4 + payload.bytes, committed, packet);
  }
  if (!link_.acknowledgement_due()) return 0;
  return seal(FORMATION_GNC_ACKNOWLEDGE, 0, committed, packet);
}

CrosslinkLayer::Verdict CrosslinkLayer::read(const unsigned char* packet, std::uint32_t bytes,
                                             bool* new_session) {
  *new_session = false;
  formation_gnc_header header;
  if (formation_gnc_get_packet(packet, bytes, &header) == 0) return Verdict::kRejected;
  if (header.role != static_cast<unsigned>(other(role_))) return Verdict::kRejected;
  const unsigned char* body = packet + FORMATION_GNC_HEADER_BYTES;
  const bool is_measurement = header.kind == FORMATION_GNC_MEASUREMENT;
  // Judged before anything is believed: a header counts only with a body that is right.
  if (is_measurement && !read_measurement(body, header.body_bytes)) return Verdict::kRejected;
  if (header.kind == FORMATION_GNC_ACKNOWLEDGE && header.body_bytes != 0) return Verdict::kRejected;
  if (header.kind < FORMATION_GNC_MEASUREMENT || header.kind > FORMATION_GNC_ACKNOWLEDGE) {
    return Verdict::kRejected;
  }
  const ReliableLink::Heard heard = link_.heard(header);
  if (heard == ReliableLink::Heard::kStale) return Verdict::kRejected;
  *new_session = heard == ReliableLink::Heard::kNewSession;
  committed_ = header.committed;
  if (is_measurement) return Verdict::kMeasurement;
  if (header.kind == FORMATION_GNC_RELIABLE && !link_.receive(header, body, header.body_bytes)) {
    return Verdict::kRejected;
  }
  return Verdict::kMessage;
}

bool CrosslinkLayer::read_measurement(const unsigned char* body, std::uint32_t bytes) {
  formation_gnc_measurement m;
  if (formation_gnc_get_measurement(body, bytes, &m) == 0) return false;
  GnssEpoch epoch;
  epoch.t_ns = m.t_ns;
  epoch.count = static_cast<int>(m.satellites);
  for (int k = 0; k < epoch.count; ++k) epoch.observation[k] = unpacked(m.satellite[k]);
  epoch.has_fix = m.has_solution != 0;
  for (int k = 0; k < 3; ++k) {
    epoch.r_ECEF[k] = m.r_ECEF[k];
    epoch.v_ECEF[k] = m.v_ECEF[k];
  }
  epoch.sigma_r_m = static_cast<float>(m.sigma_r_m);
  epoch.sigma_v_mps = static_cast<float>(m.sigma_v_mps);
  const double length2 =
      m.q_BI[0] * m.q_BI[0] + m.q_BI[1] * m.q_BI[1] + m.q_BI[2] * m.q_BI[2] + m.q_BI[3] * m.q_BI[3];
  if (!is_plausible(epoch) || std::fabs(length2 - 1.0) > 0.01) return false;
  epoch_ = epoch;
  q_BI_ = {m.q_BI[0], m.q_BI[1], m.q_BI[2], m.q_BI[3]};
  return true;
}

}  // namespace formation_gnc
