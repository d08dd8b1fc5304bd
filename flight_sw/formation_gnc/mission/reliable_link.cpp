#include "formation_gnc/mission/reliable_link.hpp"

#include <algorithm>
#include <cstring>
#include <limits>

namespace formation_gnc {
namespace {

constexpr std::int64_t kNever_ns = std::numeric_limits<std::int64_t>::max();

std::int64_t nanoseconds(double seconds) {
  return static_cast<std::int64_t>(seconds * 1e9);
}

}  // namespace

ReliableLink::ReliableLink(std::uint32_t session, const ReliableLinkOptions& options)
    : session_(session), options_(options) {}

bool ReliableLink::send(const Payload& payload) {
  if (outgoing_count_ == kWindow) return false;
  Outgoing& one = outgoing(outgoing_count_);
  one.payload = payload;
  one.sent = false;
  one.timeout_s = options_.timeout_s;
  ++outgoing_count_;
  ++queued_;
  return true;
}

// A clock that was set back must not silence a message for longer than its timeout.
bool ReliableLink::is_due(const Outgoing& one, std::int64_t now_ns) const {
  if (!one.sent) return true;
  if (!options_.retransmit) return false;
  return now_ns < one.sent_ns || now_ns - one.sent_ns >= nanoseconds(one.timeout_s);
}

bool ReliableLink::next_due(std::int64_t now_ns, std::uint32_t* sequence, Payload* payload) {
  if (peer_session_ == FORMATION_GNC_NO_SESSION) return false;
  for (std::uint32_t k = 0; k < outgoing_count_; ++k) {
    Outgoing& one = outgoing(k);
    if (!is_due(one, now_ns)) continue;
    if (one.sent) {
      ++retransmissions_;
      one.timeout_s = std::min(one.timeout_s * options_.backoff, options_.longest_timeout_s);
    }
    one.sent = true;
    one.sent_ns = now_ns;
    *sequence = first_sequence_ + k;
    *payload = one.payload;
    return true;
  }
  return false;
}

std::int64_t ReliableLink::due_ns(std::int64_t now_ns) const {
  if (peer_session_ == FORMATION_GNC_NO_SESSION) return kNever_ns;
  std::int64_t due = kNever_ns;
  for (std::uint32_t k = 0; k < outgoing_count_; ++k) {
    const Outgoing& one = outgoing(k);
    if (is_due(one, now_ns)) return now_ns;
    if (options_.retransmit) due = std::min(due, one.sent_ns + nanoseconds(one.timeout_s));
  }
  return due;
}

ReliableLink::Heard ReliableLink::heard(const formation_gnc_header& header) {
  if (header.session == FORMATION_GNC_NO_SESSION) return Heard::kStale;
  Heard result = Heard::kSameSession;
  if (peer_session_ == FORMATION_GNC_NO_SESSION || header.session > peer_session_) {
    begin_session(header.session);
    result = Heard::kNewSession;
  } else if (header.session < peer_session_) {
    return Heard::kStale;
  }
  // What the peer said before it knew of this session, or to an earlier one, acknowledges nothing.
  if (header.peer_session == session_) acknowledge(header.acknowledged);
  return result;
}

void ReliableLink::begin_session(std::uint32_t peer_session) {
  peer_session_ = peer_session;
  first_sequence_ = 1;
  for (std::uint32_t k = 0; k < outgoing_count_; ++k) {
    outgoing(k).sent = false;
    outgoing(k).timeout_s = options_.timeout_s;
  }
  next_expected_ = next_to_take_ = 1;
  std::fill(arrived_, arrived_ + kWindow, false);
}

// Numbers that were never sent acknowledge nothing: a peer may be wrong, too.
void ReliableLink::acknowledge(std::uint32_t sequence) {
  if (sequence < first_sequence_ || sequence - first_sequence_ >= outgoing_count_) return;
  const std::uint32_t count = sequence - first_sequence_ + 1;
  outgoing_first_ = (outgoing_first_ + count) % kWindow;
  outgoing_count_ -= count;
  first_sequence_ += count;
}

bool ReliableLink::receive(const formation_gnc_header& header, const unsigned char* body,
                           std::uint32_t bytes) {
  if (bytes < 4 || bytes > 4 + FORMATION_GNC_PAYLOAD_BYTES) return false;
  if (header.session != peer_session_ || header.peer_session != session_) return false;
  const std::uint32_t sequence = orrery_get_u32(body);
  if (sequence == 0) return false;
  if (sequence >= next_to_take_) {
    if (sequence - next_to_take_ >= kWindow) return false;
    const std::uint32_t slot = sequence % kWindow;
    if (!arrived_[slot]) {
      arrived_[slot] = true;
      incoming_[slot].bytes = bytes - 4;
      std::memcpy(incoming_[slot].data, body + 4, bytes - 4);
    }
    while (next_expected_ - next_to_take_ < kWindow && arrived_[next_expected_ % kWindow]) {
      ++next_expected_;
    }
  }
  acknowledgement_due_ = true;
  return true;
}

bool ReliableLink::take(Payload* payload) {
  if (next_to_take_ == next_expected_) return false;
  const std::uint32_t slot = next_to_take_ % kWindow;
  *payload = incoming_[slot];
  arrived_[slot] = false;
  ++next_to_take_;
  return true;
}

bool ReliableLink::acknowledgement_due() {
  const bool due = acknowledgement_due_;
  acknowledgement_due_ = false;
  return due;
}

}  // namespace formation_gnc
