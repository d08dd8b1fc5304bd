#include <orrery/harness/flight/processor.hpp>

#include <algorithm>

namespace orrery {
namespace {

constexpr EventKind kProcessorFree{104, "processor free"};
constexpr EventKind kClockJump{120, "clock jump"};

}  // namespace

Processor::Processor(EventLoop& loop, OwnerId owner)
    : loop_(loop), owner_(owner), busy_until_(loop.now()) {}

Processor::Processor(EventLoop& loop, OwnerId owner, OwnerId chooser) : Processor(loop, owner) {
  chooser_ = chooser;
}

void Processor::jump_clock(SimTime t, Duration by) {
  loop_.schedule(t, {Phase::kFault, owner_, owner_, &kClockJump}, [this, by] {
    clock_.jump(by);
    for (User* user : users_) user->clock_jumped();
  });
}

void Processor::leave(User& user) {
  std::erase(users_, &user);
  release(user);
  reconsider();
}

Processor::User* Processor::first_in_line() const {
  User* first = nullptr;
  std::optional<Claim> least;
  for (User* user : users_) {
    const std::optional<Claim> claim = user->claim();
    if (!claim || (least && *least < *claim)) continue;
    least = claim;
    first = user;
  }
  return first;
}

// A boot that finds the processor free does not wait for the end of the instant.
void Processor::choose_later(const Claim& first) {
  const bool boots = shared() && first.what == Waiting::kBoot && !busy();
  if (choice_ != EventHandle{} && chooses_boots_ == boots) return;
  withdraw_choice();
  chooses_boots_ = boots;
  const Phase phase = boots ? Phase::kFault : shared() ? Phase::kOutput : Phase::kDelivery;
  choice_ = loop_.schedule(free_at(), {phase, chooser_.value_or(owner_), owner_, &kProcessorFree},
                           [this] { choose(); });
}

void Processor::withdraw_choice() {
  if (choice_ == EventHandle{}) return;
  loop_.cancel(choice_);
  choice_ = {};
}

void Processor::choose() {
  choice_ = {};
  if (User* user = first_in_line()) user->run_claimed();
}

void Processor::reconsider() {
  const User* first = first_in_line();
  if (first == nullptr) {
    withdraw_choice();
  } else {
    choose_later(*first->claim());
  }
}

Duration Processor::slowed(Duration execution_time) {
  ++calls_;
  if (!slow_down_) return execution_time;
  const double factor = slow_down_(calls_);
  return factor == 1 ? execution_time : from_seconds(to_seconds(execution_time) * factor);
}

void Processor::occupy(User& by, Duration length) {
  busy_until_ = loop_.now() + length;
  busy_time_ += length;
  holder_ = &by;
}

// The choice moves with the end of the call.
void Processor::release(User& by) {
  if (holder_ != &by || !busy()) return;
  busy_time_ -= busy_until_ - loop_.now();
  busy_until_ = loop_.now();
  withdraw_choice();
}

}  // namespace orrery
