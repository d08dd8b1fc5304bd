/// Pending events, earliest first.
///
/// Method  4-ary min-heap of 16-byte entries (instant, the first bytes of the tie order, slot);
///         four siblings share a cache line. The action and the rest of the key stay in a pool of
///         slots and do not move with the heap. Popping walks the hole to the bottom, then lifts
///         the last entry (bottom-up heapsort; Wegener, 1993): one comparison per level less.
/// Cost    O(log n) each, no allocation once the pool has reached its largest size.
/// Checked by  test_suites/unit/harness/kernel/event_queue_test.cpp
#pragma once

#include <orrery/harness/kernel/cache_line_allocator.hpp>
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
  EventHandle push(const EventKey& key, const EventKind* kind, Action&& action);

  /// True if the event was pending; its action is destroyed at once.
  bool cancel(EventHandle handle);
  bool pending(EventHandle handle) const;

  /// Before the first push: events of equal time and phase but different origin come in an order
  /// drawn from `seed`, another one at each instant; those of one origin stay in theirs. For
  /// finding out whether a result depends on the order of ties.
  /// @throws std::logic_error  events are pending.
  void shuffle_ties(std::uint64_t seed);

  /// Moves the earliest event to `event` if its time is <= `latest`; false if there is none.
  bool pop(SimTime latest, Event& event);

  /// Instant of the earliest event.
  std::optional<SimTime> next_time();

  /// Pending events; the cancelled ones are not counted.
  std::size_t size() const { return entries() - dead_; }
  /// Entries of the heap, cancelled ones included: never more than twice size().
  std::size_t entries() const { return heap_.size() - kRoot; }
  /// Slots ever made: the largest number of entries so far.
  std::size_t slots() const { return slots_.size(); }

 private:
  // Two words, so that one travels in registers. The upper half of `tie_and_slot` is phase,
  // destination and the origin, if that is below 255, or phase and a hash of instant and origin
  // where ties are shuffled: what follows in the key is in the slot.
  struct Entry {
    std::int64_t t_ns;
    std::uint64_t tie_and_slot;

    std::uint32_t tie() const { return static_cast<std::uint32_t>(tie_and_slot >> 32); }
    std::uint32_t slot() const { return static_cast<std::uint32_t>(tie_and_slot); }
  };
  struct Slot {
    Action action;  // empty: free, or cancelled
    const EventKind* kind = nullptr;
    std::uint64_t counter = 0;     // of the key; of a free slot, the next free one
    std::uint32_t generation = 1;  // moves on when the event is popped or cancelled
    OwnerId origin = 0;
    OwnerId destination = 0;
  };

  // The children of the entry at position i lie at 4 * (i - 2) and after, which makes 3 the root.
  // Positions 0 to 2 are not used: four siblings then fill one cache line.
  static constexpr std::size_t kRoot = 3;
  static constexpr std::uint32_t kNone = 0xffffffff;

  // Defined in event_queue.cpp and used nowhere else; inline, since they are the inner loops.
  inline bool before(Entry a, Entry b) const;
  inline std::size_t earliest_of_four(std::size_t first) const;
  inline std::size_t earliest_child(std::size_t first, std::size_t end) const;
  inline void lift(std::size_t hole, Entry entry);
  inline void sink(std::size_t hole, Entry entry);
  inline void remove_top();
  inline std::uint32_t take_slot();
  inline void free_slot(std::uint32_t index);
  bool tied_before(Entry a, Entry b) const;
  std::uint32_t tie_of(const EventKey& key) const;
  void compact();

  std::vector<Entry, CacheLineAllocator<Entry>> heap_ =
      std::vector<Entry, CacheLineAllocator<Entry>>(kRoot);
  std::vector<Slot> slots_;
  std::uint32_t first_free_ = kNone;
  std::size_t dead_ = 0;
  SimTime last_popped_ = SimTime::min();
  std::uint64_t tie_seed_ = 0;
  bool shuffles_ = false;
};

}  // namespace orrery
