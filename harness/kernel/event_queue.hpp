/// Pending events, earliest first.
///
/// Method  4-ary min-heap of 16-byte entries (instant, the first bytes of the tie order, slot); the
///         action and the rest of the key stay in a pool of slots and do not move with the heap.
///         Popping walks the hole to the bottom, then lifts the last entry (Wegener's bottom-up
///         heapsort, 1993): one comparison per level less.
/// Cost    O(log n) each, no allocation once the pool has reached its largest size.
#pragma once

#include <orrery/harness/kernel/event.hpp>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace orrery {

/// An event that has left the queue.
struct Event {
  EventKey key;
  const EventKind* kind = nullptr;
  Action action;
};

class EventQueue {
 public:
  /// The keys pushed must differ from those pending; what `kind` points to must outlive the event.
  /// @throws std::invalid_argument  key.t before the event last popped, or an empty action.
  EventHandle push(const EventKey& key, const EventKind* kind, Action action);

  /// True if the event was pending; its action is destroyed at once.
  bool cancel(EventHandle handle);

  /// Moves the earliest event to `event` if its time is <= `latest`; false if there is none.
  bool pop(SimTime latest, Event& event);

  /// Instant of the earliest event.
  std::optional<SimTime> next_time();

  /// Pending events; the cancelled ones are not counted.
  std::size_t size() const { return heap_.size() - dead_; }
  /// Entries of the heap, cancelled ones included: never more than twice size().
  std::size_t entries() const { return heap_.size(); }
  /// Slots ever made: the largest number of entries so far.
  std::size_t slots() const { return slots_.size(); }

 private:
  // `tie` is phase, destination and the origin, if that is below 255: what follows is in the slot.
  struct Entry {
    std::int64_t t_ns;
    std::uint32_t tie;
    std::uint32_t slot;
  };
  struct Slot {
    Action action;  // empty: free, or cancelled
    const EventKind* kind = nullptr;
    std::uint64_t counter = 0;     // of the key; of a free slot, the next free one
    std::uint32_t generation = 1;  // moves on when the event is popped or cancelled
    OwnerId origin = 0;
  };

  bool before(const Entry& a, const Entry& b) const;
  bool tied_before(const Entry& a, const Entry& b) const;
  std::size_t earliest_child(std::size_t first, std::size_t end) const;
  void lift(std::size_t hole, const Entry& entry);
  void sink(std::size_t hole, const Entry& entry);
  void remove_top();
  std::uint32_t take_slot();
  void free_slot(std::uint32_t index);
  void compact_if_mostly_dead();

  std::vector<Entry> heap_;
  std::vector<Slot> slots_;
  std::uint32_t first_free_ = kNone;
  std::size_t dead_ = 0;
  SimTime last_popped_ = SimTime::min();

  static constexpr std::uint32_t kNone = 0xffffffff;
};

}  // namespace orrery
