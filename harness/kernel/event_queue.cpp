#include <orrery/harness/kernel/event_queue.hpp>

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace orrery {
namespace {

constexpr std::size_t kArity = 4;

std::size_t parent(std::size_t i) {
  return (i - 1) / kArity;
}
std::size_t first_child(std::size_t i) {
  return kArity * i + 1;
}

// Monotone in (phase, destination, origin): a larger key never gets a smaller tie. Origins from 255
// on share a value and are told apart in their slots.
std::uint32_t tie_of(const EventKey& key) {
  return std::uint32_t{static_cast<std::uint8_t>(key.phase)} << 24 |
         std::uint32_t{key.destination} << 8 | std::min<std::uint32_t>(key.origin, 255);
}

}  // namespace

bool EventQueue::before(const Entry& a, const Entry& b) const {
  if (a.t_ns != b.t_ns) [[likely]] {
    return a.t_ns < b.t_ns;
  }
  return a.tie != b.tie ? a.tie < b.tie : tied_before(a, b);
}

bool EventQueue::tied_before(const Entry& a, const Entry& b) const {
  const Slot& slot_a = slots_[a.slot];
  const Slot& slot_b = slots_[b.slot];
  return slot_a.origin != slot_b.origin ? slot_a.origin < slot_b.origin
                                        : slot_a.counter < slot_b.counter;
}

EventHandle EventQueue::push(const EventKey& key, const EventKind* kind, Action action) {
  if (key.t < last_popped_) {
    throw std::invalid_argument("EventQueue::push: t = " + to_string(key.t) +
                                " is before the last popped event, " + to_string(last_popped_));
  }
  if (!action) throw std::invalid_argument("EventQueue::push: the action is empty");
  const std::uint32_t index = take_slot();
  Slot& slot = slots_[index];
  slot.action = std::move(action);
  slot.kind = kind;
  slot.counter = key.counter;
  slot.origin = key.origin;
  const Entry entry{to_ns(key.t), tie_of(key), index};
  heap_.push_back(entry);
  lift(heap_.size() - 1, entry);
  return {index, slot.generation};
}

bool EventQueue::pop(SimTime latest, Event& event) {
  while (!heap_.empty() && heap_.front().t_ns <= to_ns(latest)) {
    const Entry top = heap_.front();
    Slot& slot = slots_[top.slot];
    // The slot is a random place of a large pool: let it come while the heap is put in order.
    __builtin_prefetch(&slot);
    __builtin_prefetch(&slot.generation);
    remove_top();
    if (!slot.action) {
      --dead_;
      free_slot(top.slot);
      continue;
    }
    last_popped_ = from_ns(top.t_ns);
    event.key = {last_popped_, static_cast<Phase>(top.tie >> 24),
                 static_cast<OwnerId>(top.tie >> 8 & 0xffff), slot.origin, slot.counter};
    event.kind = slot.kind;
    event.action = std::move(slot.action);
    ++slot.generation;
    free_slot(top.slot);
    compact_if_mostly_dead();
    return true;
  }
  return false;
}

bool EventQueue::cancel(EventHandle handle) {
  if (handle.slot >= slots_.size()) return false;
  Slot& slot = slots_[handle.slot];
  if (slot.generation != handle.generation || !slot.action) return false;
  // Destroyed on return, when the queue is whole again: captures may have destructors.
  const Action cancelled = std::move(slot.action);
  ++slot.generation;
  ++dead_;
  compact_if_mostly_dead();
  return true;
}

std::optional<SimTime> EventQueue::next_time() {
  while (!heap_.empty() && !slots_[heap_.front().slot].action) {
    --dead_;
    free_slot(heap_.front().slot);
    remove_top();
  }
  if (heap_.empty()) return std::nullopt;
  return from_ns(heap_.front().t_ns);
}

std::size_t EventQueue::earliest_child(std::size_t first, std::size_t end) const {
  std::size_t best = first;
  for (std::size_t i = first + 1; i < end; ++i) best = before(heap_[i], heap_[best]) ? i : best;
  return best;
}

void EventQueue::lift(std::size_t hole, const Entry& entry) {
  while (hole > 0 && before(entry, heap_[parent(hole)])) {
    heap_[hole] = heap_[parent(hole)];
    hole = parent(hole);
  }
  heap_[hole] = entry;
}

void EventQueue::sink(std::size_t hole, const Entry& entry) {
  while (first_child(hole) < heap_.size()) {
    const std::size_t first = first_child(hole);
    const std::size_t child = earliest_child(first, std::min(first + kArity, heap_.size()));
    if (!before(heap_[child], entry)) break;
    heap_[hole] = heap_[child];
    hole = child;
  }
  heap_[hole] = entry;
}

void EventQueue::remove_top() {
  const Entry last = heap_.back();
  heap_.pop_back();
  const std::size_t size = heap_.size();
  if (size == 0) return;
  std::size_t hole = 0;
  std::size_t first = 1;
  // Whole groups first: with a constant number of children the loop below unrolls.
  while (first + kArity <= size) {
    const std::size_t child = earliest_child(first, first + kArity);
    heap_[hole] = heap_[child];
    hole = child;
    first = first_child(hole);
  }
  if (first < size) {
    const std::size_t child = earliest_child(first, size);
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

void EventQueue::compact_if_mostly_dead() {
  if (2 * dead_ <= heap_.size()) return;
  const auto dead = std::remove_if(heap_.begin(), heap_.end(), [this](const Entry& entry) {
    if (slots_[entry.slot].action) return false;
    free_slot(entry.slot);
    return true;
  });
  heap_.erase(dead, heap_.end());
  dead_ = 0;
  // Floyd: sink every parent, the last one first.
  if (heap_.size() < 2) return;
  for (std::size_t i = parent(heap_.size() - 1) + 1; i-- > 0;) {
    const Entry entry = heap_[i];
    sink(i, entry);
  }
}

}  // namespace orrery
