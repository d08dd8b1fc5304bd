/// The event loop: owners, a queue, the current instant, the fingerprint.
#pragma once

#include <orrery/harness/kernel/bytes.hpp>
#include <orrery/harness/kernel/event.hpp>
#include <orrery/harness/kernel/event_queue.hpp>
#include <orrery/harness/kernel/fingerprint.hpp>

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace orrery {

/// Where an event belongs. `kind` must outlive the loop (a namespace-scope constant).
struct EventSpec {
  Phase phase = Phase::kDevice;
  OwnerId destination = 0;
  OwnerId origin = 0;
  const EventKind* kind = nullptr;
};

/// Runs events in the order of their keys.
///
/// Fingerprint  Each event except those of Phase::kRecorder is mixed into the chain of its
///              destination when it is executed; payload bytes are added by the action itself, with
///              fingerprint_payload(). Recorder events have counters of their own, so that turning
///              recording on changes neither the fingerprint nor the order of the others.
/// Exceptions   An action may throw: the event counts as executed, and the loop can go on.
/// Reads        sim_now and sim_event (sim_state.hpp) follow the loop that last moved.
/// Errors       Scheduling before now() throws std::invalid_argument with both times. Actions
///              schedule and cancel; running or advancing the loop from one is std::logic_error.
class EventLoop {
 public:
  explicit EventLoop(SimTime start);

  /// Ids are 0, 1, 2 ... in order of the calls. @throws std::length_error  after 65535.
  OwnerId add_owner(std::string name);
  /// @throws std::out_of_range  no such owner.
  const std::string& owner_name(OwnerId id) const;
  std::size_t owner_count() const { return owners_.size(); }

  SimTime now() const { return now_; }

  /// @throws std::invalid_argument  `t` before now(), an unknown owner, a null kind, or an empty
  ///                                action.
  EventHandle schedule(SimTime t, const EventSpec& spec, Action action);
  /// True if the event was pending; false if it has run, was cancelled or never was.
  bool cancel(EventHandle handle);
  /// False if it has run, was cancelled or never was.
  bool pending(EventHandle handle) const { return queue_.pending(handle); }

  /// Executes all events with time <= t, in order, then sets now() to t.
  /// @throws std::invalid_argument  t before now().
  void run_until(SimTime t);
  /// Executes the next event if its time is <= t. False if there is none (now() is unchanged then).
  bool run_next(SimTime t);
  /// Sets now() to t. @throws std::logic_error  an event before or at t is pending; t before now().
  void advance_to(SimTime t);
  /// Instant of the earliest pending event.
  std::optional<SimTime> next_event_time() { return queue_.next_time(); }

  /// Within an action: adds these bytes, and their length, to the fingerprint of the running event.
  /// Does nothing in a recorder's event. @throws std::logic_error  no event is running.
  void fingerprint_payload(Bytes payload);

  const Fingerprint& fingerprint() const { return fingerprint_; }
  /// From here on, keep every executed event (the recorder's excepted), so that two runs can be
  /// compared event by event.
  void keep_log(bool keep) { keep_log_ = keep; }
  /// The same for the events of these numbers alone: from < number <= until.
  void keep_log_of(std::uint64_t from, std::uint64_t until) {
    keep_log_ = true;
    log_from_ = from;
    log_until_ = until;
  }
  /// From here on, note Fingerprint::hash() whenever this many events have been executed.
  static constexpr std::uint64_t kCheckpointEvents = 4096;
  void keep_checkpoints() { keep_checkpoints_ = true; }
  const std::vector<std::uint64_t>& checkpoints() const { return checkpoints_; }
  /// Before the first event: as EventQueue::shuffle_ties().
  void shuffle_ties(std::uint64_t seed) { queue_.shuffle_ties(seed); }
  /// Before the first event: keeps Fingerprint::unordered_hash(), and notes it at the first new
  /// instant after every kCheckpointEvents. The log then has each event's own hash as its chain.
  void keep_unordered() { fingerprint_.keep_unordered(); }
  struct InstantCheckpoint {
    std::uint64_t events = 0;  // executed before
    std::uint64_t hash = 0;
  };
  const std::vector<InstantCheckpoint>& instant_checkpoints() const { return instant_checkpoints_; }
  const std::vector<EventRecord>& log() const { return log_; }
  /// Without the recorder's: the n-th event is the same one whatever is recorded.
  std::uint64_t events_executed() const { return executed_; }
  std::size_t events_pending() const { return queue_.size(); }
  /// The events that ran last, the running one included, oldest first: for failure messages.
  static constexpr std::size_t kRecentEvents = 8;
  std::vector<EventRecord> recent_events() const;
  /// Kind of the running event, for crash reports; null between events.
  const EventKind* current_kind() const { return current_kind_; }

 private:
  struct Owner {
    std::string name;
    std::uint64_t scheduled = 0;  // the counter of EventKey
    std::uint64_t recorded = 0;   // the same for Phase::kRecorder
  };
  class Running;

  [[noreturn]] void throw_no_owner(const char* role, OwnerId id) const;
  void require_between_events(const char* function) const;
  void move_to(SimTime t);
  void note_instant(SimTime t);

  EventQueue queue_;
  Fingerprint fingerprint_;
  std::vector<Owner> owners_;
  std::vector<EventRecord> log_;
  std::array<EventRecord, kRecentEvents> recent_;  // event n at n % kRecentEvents
  SimTime now_;
  const EventKind* current_kind_ = nullptr;
  OwnerId current_owner_ = 0;
  bool in_fingerprint_ = false;  // the running event is
  bool keep_log_ = false;
  bool keep_checkpoints_ = false;
  std::vector<std::uint64_t> checkpoints_;
  std::vector<InstantCheckpoint> instant_checkpoints_;
  std::uint64_t log_from_ = 0, log_until_ = UINT64_MAX;
  std::uint64_t executed_ = 0;
};

}  // namespace orrery
