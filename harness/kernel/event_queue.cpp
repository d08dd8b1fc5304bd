#include <orrery/harness/kernel/event_queue.hpp>
#include <orrery/harness/kernel/hash.hpp>

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace orrery {
namespace {

std::size_t first_child(std::size_t position) {
  return 4 * (position - 2);
}
std::size_t parent(std::size_t position) {
  return position / 4 + 2;
}

[[noreturn]] void throw_in_the_past(SimTime t, SimTime last_popped) {
  throw std::invalid_argument("EventQueue::push: t = " + to_string(t) +
                              " is before the last popped event, " + to_string(last_popped));
}

}  // namespace

// Monotone in (phase, destination, origin): a larger key never gets a smaller tie. Origins from 255
// on share a value and are told apart in their slots, as are those whose hash is the same.
std::uint32_t EventQueue::tie_of(const EventKey& key) const {
  const std::uint32_t phase = std::uint32_t{static_cast<std::uint8_t>(key.phase)} << 24;
  if (shuffles_) [[unlikely]] {
    const std::uint64_t at = hash_word(tie_seed_, static_cast<std::uint64_t>(to_ns(key.t)));
    return phase | static_cast<std::uint32_t>(hash_word(at, key.origin) >> 40);
  }
  return phase | std::uint32_t{key.destination} << 8 | std::min<std::uint32_t>(key.origin, 255);
}

void EventQueue::shuffle_ties(std::uint64_t seed) {
  if (entries() != 0) throw std::logic_error("EventQueue::shuffle_ties: events are pending");
  tie_seed_ = seed;
  shuffles_ = true;
}

bool EventQueue::before(Entry a, Entry b) const {
  if (a.t_ns != b.t_ns) [[likely]] {
    return a.t_ns < b.t_ns;
  }
  return a.tie() != b.tie() ? a.tie() < b.tie() : tied_before(a, b);
}

bool EventQueue::tied_before(Entry a, Entry b) const {
  const Slot& slot_a = slots_[a.slot()];
  const Slot& slot_b = slots_[b.slot()];
  if (slot_a.origin != slot_b.origin) return slot_a.origin < slot_b.origin;
  // Of equal ties the destination differs only where ties are shuffled.
  if (slot_a.destination != slot_b.destination) return slot_a.destination < slot_b.destination;
  return slot_a.counter < slot_b.counter;
}

std::size_t EventQueue::earliest_child(std::size_t first, std::size_t end) const {
  std::size_t best = first;
  for (std::size_t i = first + 1; i < end; ++i) {
    if (before(heap_[i], heap_[best])) best = i;
  }
  return best;
}

// Which of four is the earliest is a coin toss to the branch predictor, so the choice is
// arithmetic. Equal instants, which need the rest of the key, are one branch that is seldom taken.
std::size_t EventQueue::earliest_of_four(std::size_t first) const {
  const Entry* entry = heap_.data() + first;
  const std::size_t left = entry[1].t_ns < entry[0].t_ns ? 1 : 0;
  const std::size_t right = entry[3].t_ns < entry[2].t_ns ? 3 : 2;
  const std::int64_t t_left = entry[left].t_ns;
  const std::int64_t t_right = entry[right].t_ns;
  const bool tied =
      (entry[0].t_ns == entry[1].t_ns) | (entry[2].t_ns == entry[3].t_ns) | (t_left == t_right);
  if (tied) [[unlikely]] {
    return earliest_child(first, first + 4);
  }
  const std::size_t all_ones_if_right = -static_cast<std::size_t>(t_right < t_left);
  return first + (left ^ ((left ^ right) & all_ones_if_right));
}

void EventQueue::lift(std::size_t hole, Entry entry) {
  while (hole != kRoot && before(entry, heap_[parent(hole)])) {
    heap_[hole] = heap_[parent(hole)];
    hole = parent(hole);
  }
  heap_[hole] = entry;
}

void EventQueue::sink(std::size_t hole, Entry entry) {
  while (first_child(hole) < heap_.size()) {
    const std::size_t first = first_child(hole);
    const std::size_t child = earliest_child(first, std::min(first + 4, heap_.size()));
    if (!before(heap_[child], entry)) break;
    heap_[hole] = heap_[child];
    hole = child;
  }
  heap_[hole] = entry;
}

void EventQueue::remove_top() {
  const Entry last = heap_.back();
  heap_.pop_back();
  const std::size_t end = heap_.size();
  if (end == kRoot) return;
  std::size_t hole = kRoot;
  std::size_t first = first_child(kRoot);
  while (first + 4 <= end) {
    // The children of all four, before it is known whose are needed: in a heap larger than the
    // caches each level would otherwise wait for memory.
    const std::size_t next = first_child(first);
    if (next + 16 <= end) {
      const Entry* line = heap_.data() + next;
      __builtin_prefetch(line);
      __builtin_prefetch(line + 4);
      __builtin_prefetch(line + 8);
      __builtin_prefetch(line + 12);
    }
    const std::size_t child = earliest_of_four(first);
    heap_[hole] = heap_[child];
    hole = child;
    first = first_child(hole);
  }
  if (first < end) {
    const std::size_t child = earliest_child(first, end);
    heap_[hole] = heap_[child];
    hole = child;
  }
  lift(hole, last);
}

std::uint32_t EventQueue::take_slot() {
  if (first_free_ == kNone) {
    if (slots_.size() == kNone) throw std::length_error("EventQueue::push: 2^32 - 1 pending");
    slots_.emplace_back();
    return static_cast<std::uint32_t>(slots_.size() - 1);
  }
  const std::uint32_t index = first_free_;
  first_free_ = static_cast<std::uint32_t>(slots_[index].counter);
  return index;
}

void EventQueue::free_slot(std::uint32_t index) {
  // A slot whose generations are used up is left aside, so that a stale handle never names a later
  // event: one slot in 4e9 events.
  if (slots_[index].generation == 0) return;
  slots_[index].counter = first_free_;
  first_free_ = index;
}

EventHandle EventQueue::push(const EventKey& key, const EventKind* kind, Action&& action) {
  if (key.t < last_popped_) throw_in_the_past(key.t, last_popped_);
  if (!action) throw std::invalid_argument("EventQueue::push: the action is empty");
  const std::uint32_t index = take_slot();
  Slot& slot = slots_[index];
  slot.action = std::move(action);
  slot.kind = kind;
  slot.counter = key.counter;
  slot.origin = key.origin;
  slot.destination = key.destination;
  const Entry entry{to_ns(key.t), std::uint64_t{tie_of(key)} << 32 | index};
  heap_.push_back(entry);
  lift(heap_.size() - 1, entry);
  return {index, slot.generation};
}

bool EventQueue::pop(SimTime latest, Event& event) {
  while (entries() != 0 && heap_[kRoot].t_ns <= to_ns(latest)) {
    const Entry top = heap_[kRoot];
    Slot& slot = slots_[top.slot()];
    remove_top();
    if (!slot.action) {
      --dead_;
      free_slot(top.slot());
      continue;
    }
    // The next event's slot is a random place of a large pool: let it come while this one runs.
    if (entries() != 0) {
      const Slot& next = slots_[heap_[kRoot].slot()];
      __builtin_prefetch(&next);
      __builtin_prefetch(&next.generation);
    }
    last_popped_ = from_ns(top.t_ns);
    event.key = {last_popped_, static_cast<Phase>(top.tie() >> 24), slot.destination, slot.origin,
                 slot.counter};
    event.kind = slot.kind;
    event.action = std::move(slot.action);
    ++slot.generation;
    free_slot(top.slot());
    if (2 * dead_ > entries()) compact();
    return true;
  }
  return false;
}

bool EventQueue::pending(EventHandle handle) const {
  if (handle.slot >= slots_.size()) return false;
  const Slot& slot = slots_[handle.slot];
  return slot.generation == handle.generation && slot.action;
}

bool EventQueue::cancel(EventHandle handle) {
  if (!pending(handle)) return false;
  Slot& slot = slots_[handle.slot];
  // Destroyed on return, when the queue is whole again: captures may have destructors.
  const Action cancelled = std::move(slot.action);
  ++slot.generation;
  ++dead_;
  if (2 * dead_ > entries()) compact();
  return true;
}

std::optional<SimTime> EventQueue::next_time() {
  while (entries() != 0 && !slots_[heap_[kRoot].slot()].action) {
    --dead_;
    free_slot(heap_[kRoot].slot());
    remove_top();
  }
  if (entries() == 0) return std::nullopt;
  return from_ns(heap_[kRoot].t_ns);
}

void EventQueue::compact() {
  const auto is_dead = [this](Entry entry) {
    if (slots_[entry.slot()].action) return false;
    free_slot(entry.slot());
    return true;
  };
  heap_.erase(std::remove_if(heap_.begin() + kRoot, heap_.end(), is_dead), heap_.end());
  dead_ = 0;
  if (entries() < 2) return;
  // Floyd (1964): sink every parent, the last one first.
  for (std::size_t i = parent(heap_.size() - 1); i >= kRoot; --i) sink(i, heap_[i]);
}

}  // namespace orrery
