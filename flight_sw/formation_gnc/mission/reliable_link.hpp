/// Messages that must arrive, exactly once and in order, over a crosslink that loses, delays,
/// doubles and reorders packets.
///
/// Method      Numbered messages, cumulative acknowledgement, retransmission with back-off, a
///             receive window that puts late ones in their place (as TCP, RFC 9293 §3.4 and §3.8).
///             Acknowledgements ride in the header of every packet, measurements included.
/// Restarts    A stream belongs to a pair of sessions (boot counts). When the peer has a new
///             session, what was not acknowledged is numbered anew and sent to that session: a
///             message that the peer's earlier life took and did not acknowledge comes again, once
///             per restart. What was queued here is lost with this side's own restart. The layer
///             above must stand both: transition_protocol.hpp.
/// Memory      Fixed: kWindow messages each way.
/// Time        The onboard clock, which may jump: a timer further away than its own length is due.
#pragma once

#include <cstdint>

#include "formation_gnc/formation_gnc_messages.h"

namespace formation_gnc {

struct Payload {
  std::uint32_t bytes = 0;
  unsigned char data[FORMATION_GNC_PAYLOAD_BYTES] = {};
};

struct ReliableLinkOptions {
  double timeout_s = 20.0;  ///< to the first retransmission: twice the 99.9 % quantile of the delay
  double backoff = 1.5;     ///< from one retransmission to the next, at least 1
  double longest_timeout_s = 60.0;  ///< of a silent peer: it may be back at any time
  /// False is the defect of the paper's July 2024: a lost announcement stays lost.
  bool retransmit = true;
};

class ReliableLink {
 public:
  static constexpr std::uint32_t kWindow = 16;

  ReliableLink(std::uint32_t session, const ReliableLinkOptions& options);

  // ---- what goes out
  /// Queues a message. False if kWindow are unacknowledged: nothing happened.
  bool send(const Payload& payload);
  /// The next message that is due, if the peer's session is known. Call until false.
  bool next_due(std::int64_t now_ns, std::uint32_t* sequence, Payload* payload);
  /// When next_due() will have something, if nothing else happens; never: INT64_MAX.
  std::int64_t due_ns(std::int64_t now_ns) const;
  std::uint32_t unacknowledged() const { return outgoing_count_; }
  /// Messages queued so far, in any session, and those of them that were acknowledged.
  std::uint64_t queued() const { return queued_; }
  std::uint64_t delivered() const { return queued_ - outgoing_count_; }
  std::uint32_t retransmissions() const { return retransmissions_; }

  // ---- what every packet says and hears
  std::uint32_t session() const { return session_; }
  std::uint32_t peer_session() const { return peer_session_; }
  std::uint32_t acknowledged() const { return next_expected_ - 1; }

  enum class Heard { kSameSession, kNewSession, kStale };
  /// To be told of each sound packet before its body is looked at; a stale one is of the peer's
  /// earlier life and counts for nothing.
  Heard heard(const formation_gnc_header& header);

  // ---- what comes in
  /// A RELIABLE body. False if it is malformed, or belongs to another session or beyond the window.
  /// A duplicate is true: it is answered, and nothing else happens.
  bool receive(const formation_gnc_header& header, const unsigned char* body, std::uint32_t bytes);
  /// The next message in order, each once.
  bool take(Payload* payload);
  /// True once after each receive(): a packet should go out, whose header acknowledges.
  bool acknowledgement_due();

 private:
  struct Outgoing {
    Payload payload;
    std::int64_t sent_ns = 0;
    double timeout_s = 0.0;
    bool sent = false;
  };
  Outgoing& outgoing(std::uint32_t index) { return outgoing_[(outgoing_first_ + index) % kWindow]; }
  const Outgoing& outgoing(std::uint32_t index) const {
    return outgoing_[(outgoing_first_ + index) % kWindow];
  }
  bool is_due(const Outgoing& one, std::int64_t now_ns) const;
  void acknowledge(std::uint32_t sequence);
  void begin_session(std::uint32_t peer_session);

  std::uint32_t session_;
  ReliableLinkOptions options_;
  std::uint32_t peer_session_ = FORMATION_GNC_NO_SESSION;

  Outgoing outgoing_[kWindow];  // a ring, oldest first
  std::uint32_t outgoing_first_ = 0, outgoing_count_ = 0;
  std::uint32_t first_sequence_ = 1;  // of the oldest
  std::uint64_t queued_ = 0;
  std::uint32_t retransmissions_ = 0;

  Payload incoming_[kWindow];  // at sequence % kWindow
  bool arrived_[kWindow] = {};
  std::uint32_t next_expected_ = 1;  // every one before has come
  std::uint32_t next_to_take_ = 1;
  bool acknowledgement_due_ = false;
};

}  // namespace formation_gnc
