#include <orrery/harness/kernel/event_loop.hpp>
#include <orrery/harness/kernel/sim_state.hpp>

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace orrery {
namespace {

// One owner less than ids, so that a count of owners fits where an id does.
constexpr std::size_t kMostOwners = 65535;

std::string before_now(const char* function, SimTime t, SimTime now) {
  return std::string("EventLoop::") + function + ": t = " + to_string(t) + " is before now, " +
         to_string(now);
}

}  // namespace

// The time during which an event runs. Its end restores the loop, after an exception as well.
class EventLoop::Running {
 public:
  Running(EventLoop& loop, const Event& event) : loop_(loop), event_(event) {
    loop.current_kind_ = event.kind;
    loop.current_owner_ = event.key.destination;
    loop.in_fingerprint_ = event.key.phase != Phase::kRecorder;
    if (!loop.in_fingerprint_) return;
    if (loop.fingerprint_.keeps_unordered()) loop.note_instant(event.key.t);
    sim_event = ++loop.executed_;
    loop.fingerprint_.event(event.key, event.kind->id);
    last() = {event.key, event.kind, loop.fingerprint_.chain(event.key.destination)};
  }
  Running(const Running&) = delete;
  Running& operator=(const Running&) = delete;
  ~Running() {
    if (loop_.in_fingerprint_) {
      last().chain = loop_.fingerprint_.chain(event_.key.destination);
      if (loop_.fingerprint_.keeps_unordered()) {
        loop_.fingerprint_.end_event(event_.key);
        last().chain = loop_.fingerprint_.this_event();
      }
      if (loop_.keep_log_ && loop_.executed_ > loop_.log_from_ &&
          loop_.executed_ <= loop_.log_until_) {
        loop_.log_.push_back(last());
      }
      if (loop_.keep_checkpoints_ && loop_.executed_ % kCheckpointEvents == 0) {
        loop_.checkpoints_.push_back(loop_.fingerprint_.hash());
      }
    }
    loop_.current_kind_ = nullptr;
  }

 private:
  EventRecord& last() { return loop_.recent_[loop_.executed_ % kRecentEvents]; }

  EventLoop& loop_;
  const Event& event_;
};

EventLoop::EventLoop(SimTime start) {
  move_to(start);
  sim_event = 0;
}

OwnerId EventLoop::add_owner(std::string name) {
  if (owners_.size() == kMostOwners) {
    throw std::length_error("EventLoop::add_owner: '" + name + "' would be owner 65536 of 65535");
  }
  owners_.push_back({std::move(name), 0, 0});
  fingerprint_.add_owner();
  return static_cast<OwnerId>(owners_.size() - 1);
}

const std::string& EventLoop::owner_name(OwnerId id) const {
  if (id >= owners_.size()) {
    throw std::out_of_range("EventLoop::owner_name: id = " + std::to_string(id) + ", there are " +
                            std::to_string(owners_.size()) + " owners");
  }
  return owners_[id].name;
}

EventHandle EventLoop::schedule(SimTime t, const EventSpec& spec, Action action) {
  if (t < now_) throw std::invalid_argument(before_now("schedule", t, now_));
  if (spec.destination >= owners_.size()) throw_no_owner("destination", spec.destination);
  if (spec.origin >= owners_.size()) throw_no_owner("origin", spec.origin);
  if (spec.kind == nullptr) throw std::invalid_argument("EventLoop::schedule: kind is null");
  Owner& origin = owners_[spec.origin];
  std::uint64_t& counter = spec.phase == Phase::kRecorder ? origin.recorded : origin.scheduled;
  const EventKey key{t, spec.phase, spec.destination, spec.origin, counter};
  const EventHandle handle = queue_.push(key, spec.kind, std::move(action));
  ++counter;
  return handle;
}

bool EventLoop::cancel(EventHandle handle) {
  return queue_.cancel(handle);
}

void EventLoop::run_until(SimTime t) {
  if (t < now_) throw std::invalid_argument(before_now("run_until", t, now_));
  while (run_next(t)) {
  }
  move_to(t);
}

bool EventLoop::run_next(SimTime t) {
  require_between_events("run_next");
  Event event;
  if (!queue_.pop(t, event)) return false;
  move_to(event.key.t);
  const Running running(*this, event);
  event.action();
  return true;
}

void EventLoop::advance_to(SimTime t) {
  require_between_events("advance_to");
  if (t < now_) throw std::logic_error(before_now("advance_to", t, now_));
  const std::optional<SimTime> next = queue_.next_time();
  if (next && *next <= t) {
    throw std::logic_error("EventLoop::advance_to: t = " + to_string(t) +
                           " is not before the next event, " + to_string(*next));
  }
  move_to(t);
}

std::vector<EventRecord> EventLoop::recent_events() const {
  std::vector<EventRecord> events;
  const std::uint64_t count = std::min<std::uint64_t>(executed_, kRecentEvents);
  for (std::uint64_t n = executed_ - count + 1; n <= executed_; ++n) {
    events.push_back(recent_[n % kRecentEvents]);
  }
  return events;
}

void EventLoop::fingerprint_payload(Bytes payload) {
  if (current_kind_ == nullptr) {
    throw std::logic_error("EventLoop::fingerprint_payload: no event is running");
  }
  if (in_fingerprint_) fingerprint_.payload(current_owner_, payload);
}

// Only where an instant begins are the events so far the same ones in another order of ties.
void EventLoop::note_instant(SimTime t) {
  const std::uint64_t last = instant_checkpoints_.empty() ? 0 : instant_checkpoints_.back().events;
  if (executed_ < last + kCheckpointEvents || recent_[executed_ % kRecentEvents].key.t == t) {
    return;
  }
  instant_checkpoints_.push_back({executed_, fingerprint_.unordered_hash()});
}

void EventLoop::throw_no_owner(const char* role, OwnerId id) const {
  throw std::invalid_argument("EventLoop::schedule: " + std::string(role) + " = " +
                              std::to_string(id) + ", there are " + std::to_string(owners_.size()) +
                              " owners");
}

void EventLoop::require_between_events(const char* function) const {
  if (current_kind_ == nullptr) return;
  throw std::logic_error(std::string("EventLoop::") + function + ": called from event '" +
                         current_kind_->name + "'; an action schedules, it does not run the loop");
}

void EventLoop::move_to(SimTime t) {
  now_ = t;
  sim_now = to_ns(t);
}

}  // namespace orrery
