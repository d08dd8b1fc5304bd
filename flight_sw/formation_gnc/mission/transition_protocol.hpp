/// How two spacecraft change modes and observe in step over an unreliable crosslink.
///
/// Announcing  The leader announces an event with its GPS epoch, `lead_s` ahead, as a reliable
///             message. When the follower has acknowledged, the leader commits: from then on the
///             header of every packet names the event as committed, and both execute it at its
///             epoch. There is one decision, and it is the leader's: a follower executes nothing
///             that is not committed, so a lost acknowledgement cannot make it go alone.
/// Postponed   Without an acknowledgement `guard_s` before the epoch a change of mode is announced
///             anew for `lead_s` later, and an observation, whose geometry will not wait, is
///             withdrawn. A silence that is no longer than `guard_s` thus never lets the two
///             execute at different epochs; after a longer one the follower is late, executes when
///             it hears of the commitment, and says so.
/// Emergency   Safe and escape are entered at once by whoever sees the need. The other follows as
///             soon as it hears; what was announced is void. Emergencies are counted, and an
///             announcement says how many the leader knows of, so that one made before cannot lead
///             the follower out of an emergency.
/// Restarts    The state, TransitionRecord, is to be stored whenever changed() says so, before
///             anything is sent. After a restart of either side both tell each other theirs.
///
/// Properties (test_suites/unit/flight_sw/formation_gnc): each committed event is executed exactly
/// once, in the order of the ids, on both.
#pragma once

#include <cstdint>

#include "formation_gnc/mission/event.hpp"
#include "formation_gnc/mission/reliable_link.hpp"

namespace formation_gnc {

struct TransitionOptions {
  double lead_s = 900.0;  ///< of announcements of mode changes, above guard_s
  /// Longer than the crosslink's longest usual silence, 5 min in the reference mission.
  double guard_s = 360.0;
  double late_s = 2.0;                ///< an execution later than this counts as late
  bool await_acknowledgement = true;  ///< false: the leader commits blindly; a defect
};

/// What must survive a restart.
struct TransitionRecord {
  Mode mode = Mode::kStandby;
  std::uint32_t executed_id = 0;  ///< the last
  Event current;                  ///< what led into `mode`
  bool has_pending = false;
  Event pending;
  std::uint32_t committed_id = 0;
  std::uint32_t last_id = 0;  ///< leader: the last one given out
  std::uint32_t emergencies = 0, peer_emergencies = 0;
  std::uint32_t fault = FORMATION_GNC_NO_FAULT;  ///< of the last emergency
  std::uint32_t observation = 0;                 ///< of this campaign: number of the last
  std::int64_t last_window_ns = 0;  ///< begin of the last one announced, in this campaign; 0: none
};

constexpr std::uint32_t kTransitionRecordBytes = 128;
/// With version and CRC. @return the bytes written.
std::uint32_t store(const TransitionRecord& record, unsigned char (&to)[kTransitionRecordBytes]);
/// False, and `record` unchanged, if it is not whole and sound.
bool restore(const unsigned char* from, std::uint32_t bytes, TransitionRecord* record);

class TransitionProtocol {
 public:
  struct Execution {
    Event event;
    bool late = false;
    bool emergency = false;
  };

  TransitionProtocol(Role role, const TransitionOptions& options, const TransitionRecord& record);

  const TransitionRecord& record() const { return record_; }
  Mode mode() const { return record_.mode; }
  bool has_pending() const { return record_.has_pending; }
  const Event& pending() const { return record_.pending; }
  bool is_committed() const {
    return record_.has_pending && record_.pending.id <= record_.committed_id;
  }
  std::uint32_t committed_id() const { return record_.committed_id; }
  /// True once after each change of the record.
  bool changed();

  // ---- leader
  /// Announces an event; its id is given here. False on the follower, while another one is pending,
  /// and for an epoch closer than guard_s.
  bool announce(const Event& event, std::int64_t now_ns);
  /// Takes back what is pending, unless it is committed (false).
  bool withdraw();

  // ---- both
  /// Enters safe or escape now, and tells the other.
  void emergency(Mode mode, std::uint32_t fault, std::int64_t now_ns);
  /// The link heard a new session of the peer.
  void peer_restarted() { needs_sync_ = true; }
  /// A payload of the link that is one of the protocol's. False if it is not, or malformed.
  bool receive(const Payload& payload, std::int64_t now_ns);
  /// The field of a peer's header.
  void hear_committed(std::uint32_t id);
  /// Hands what is to be said to the link, commits, postpones, and executes what is due.
  /// @param now_ns  GPS.
  void poll(std::int64_t now_ns, ReliableLink* link);
  /// What was executed, in order. Call after every poll() and emergency() until false.
  bool take(Execution* execution);
  /// The next instant at which poll() has something to do; INT64_MAX: none known.
  std::int64_t next_ns() const;

  std::uint32_t late() const { return late_; }
  std::uint32_t postponed() const { return postponed_; }
  std::uint32_t withdrawn() const { return withdrawn_; }

 private:
  static constexpr std::uint32_t kExecutions = 8;

  bool leads() const { return role_ == Role::kChief; }
  std::int64_t deadline_ns() const;
  void execute(std::int64_t now_ns);
  void enter(Mode mode, const Event& event);
  void push(const Execution& execution);
  void drop_pending();
  void send_all(ReliableLink* link);
  void decide(std::int64_t now_ns, const ReliableLink& link);
  bool receive_announcement(ByteReader* from, std::int64_t now_ns);
  bool receive_withdrawal(ByteReader* from);
  bool receive_emergency(ByteReader* from, std::int64_t now_ns);
  bool receive_sync(ByteReader* from, std::int64_t now_ns);
  void follow_emergency(std::uint32_t count, Mode mode, std::int64_t now_ns);
  void change() { changed_ = true; }

  Role role_;
  TransitionOptions options_;
  TransitionRecord record_;
  bool changed_ = false;

  // What the link did not have room for yet, or has to be said again.
  bool needs_sync_ = false, needs_emergency_ = false, needs_announcement_ = false;
  std::uint32_t needs_withdrawal_ = 0;   // an id
  bool announced_ = false;               // in this life
  std::uint64_t announcement_mark_ = 0;  // acknowledged when the link has delivered so many
  Execution executions_[kExecutions];
  std::uint32_t executions_first_ = 0, executions_count_ = 0;
  std::uint32_t late_ = 0, postponed_ = 0, withdrawn_ = 0;
};

}  // namespace formation_gnc
