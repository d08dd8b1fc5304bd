/// Packets of the crosslink: measurements as they are, best effort, and the reliable link's.
#pragma once

#include <cstdint>

#include "formation_gnc/formation_gnc_messages.h"
#include "formation_gnc/mission/event.hpp"
#include "formation_gnc/mission/reliable_link.hpp"
#include "formation_gnc/navigation/gnss_epoch.hpp"

namespace formation_gnc {

class CrosslinkLayer {
 public:
  using Packet = unsigned char[FORMATION_GNC_PACKET_BYTES];

  CrosslinkLayer(Role role, std::uint32_t session, const ReliableLinkOptions& options)
      : role_(role), link_(session, options) {}

  ReliableLink& link() { return link_; }
  const ReliableLink& link() const { return link_; }

  /// Says the same to everyone who listens, once. @return bytes.
  std::uint32_t write_measurement(const GnssEpoch& epoch, const Quaternion& q_BI,
                                  std::uint32_t committed, Packet& packet);
  /// The next packet that is due, or 0. Call until 0.
  std::uint32_t write_due(std::int64_t now_ns, std::uint32_t committed, Packet& packet);

  enum class Verdict {
    kRejected,     ///< malformed, foreign, stale, or a reliable message out of place
    kMeasurement,  ///< epoch() and q_BI() hold it
    kMessage       ///< link() may have payloads to take; or an acknowledgement
  };
  /// @param new_session  The peer has restarted, or is heard for the first time.
  Verdict read(const unsigned char* packet, std::uint32_t bytes, bool* new_session);
  /// Of the last accepted packet.
  std::uint32_t committed() const { return committed_; }
  const GnssEpoch& epoch() const { return epoch_; }
  const Quaternion& q_BI() const { return q_BI_; }

 private:
  std::uint32_t seal(unsigned kind, std::uint32_t body_bytes, std::uint32_t committed,
                     Packet& packet) const;
  bool read_measurement(const unsigned char* body, std::uint32_t bytes);

  Role role_;
  ReliableLink link_;
  std::uint32_t committed_ = 0;
  GnssEpoch epoch_;
  Quaternion q_BI_;
};

}  // namespace formation_gnc
