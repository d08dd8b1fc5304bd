/// The processor of one spacecraft, which one flight process has, or several share.
#pragma once

#include <orrery/harness/flight/onboard_clock.hpp>
#include <orrery/harness/kernel/event_loop.hpp>

#include <compare>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

namespace orrery {

/// Runs calls of flight software one at a time, each to its end.
///
/// Order     Not preemptive: a call that has begun keeps the processor for its execution time. When
///           that has passed, the waiting call of the highest priority is next; among equals the
///           one that has been due for longest, at one instant a boot before inputs and these
///           before ticks, and then in order of arrival.
/// Instant   One process alone starts its call as soon as it comes. Where several share, the choice
///           is made when everything of the instant has come, outputs that leave then and what they
///           bring to another process included: Phase::kOutput, behind the outputs. Boots onto a
///           free processor are chosen from in Phase::kFault, so that they come before the inputs
///           of their instant.
/// Clock     The spacecraft's, which all its processes read.
class Processor {
 public:
  /// Of one process, whose events belong to `owner`. The loop must outlive the processor.
  Processor(EventLoop& loop, OwnerId owner);
  /// Of several. @param chooser  Owner of the choice: declared after the owners of the processes,
  ///        so that it comes behind their events.
  Processor(EventLoop& loop, OwnerId owner, OwnerId chooser);
  Processor(const Processor&) = delete;
  Processor& operator=(const Processor&) = delete;

  EventLoop& loop() const { return loop_; }
  /// Origin of the events of all its processes: of one origin, they keep their order whatever
  /// EventLoop::shuffle_ties does with others.
  OwnerId owner() const { return owner_; }
  bool busy() const { return loop_.now() < busy_until_; }
  /// Now, or when the call that has it ends.
  SimTime free_at() const { return std::max(loop_.now(), busy_until_); }
  /// Time spent in calls, up to now.
  Duration busy_time() const { return busy_time_ - (free_at() - loop_.now()); }
  std::uint64_t calls() const { return calls_; }

  const OnboardClock& clock() const { return clock_; }
  OnboardClock& clock() { return clock_; }
  /// From `t` on, before anything else at that instant, the clock is off by that much more. Pending
  /// ticks move to where it will show their times; one in the past fires at once.
  void jump_clock(SimTime t, Duration by);

  /// Factor on the execution time of call `n`, counted from 1 over all processes.
  using SlowDown = std::function<double(std::uint64_t call)>;
  void set_slow_down(SlowDown factor) { slow_down_ = std::move(factor); }

  // What follows is for FlightComputer.

  enum class Waiting : std::uint8_t { kBoot, kInput, kTick };
  /// Of a call that waits: the least goes first.
  struct Claim {
    std::int64_t below = 0;  // the priority, negated
    SimTime due;
    Waiting what = Waiting::kInput;
    std::uint64_t arrival = 0;  // from next_arrival()
    friend auto operator<=>(const Claim&, const Claim&) = default;
  };
  class User {
   public:
    virtual std::optional<Claim> claim() const = 0;
    /// What it claimed; the processor is free.
    virtual void run_claimed() = 0;
    virtual void clock_jumped() = 0;

   protected:
    ~User() = default;
  };

  void join(User& user) { users_.push_back(&user); }
  void leave(User& user);
  bool shared() const { return chooser_.has_value(); }
  std::uint64_t next_arrival() { return ++arrivals_; }
  /// What waits has changed, or the processor is free earlier: there is an event at which the next
  /// one is chosen if, and only if, something waits.
  void reconsider();
  /// How long a call takes that has just been made.
  Duration slowed(Duration execution_time);
  /// A call of that user begins now.
  void occupy(User& by, Duration length);
  /// If that user's call has it, it is free from now on.
  void release(User& by);

 private:
  User* first_in_line() const;
  void choose();
  void choose_later(const Claim& first);
  void withdraw_choice();

  EventLoop& loop_;
  OwnerId owner_;
  std::optional<OwnerId> chooser_;  // empty: not shared
  OnboardClock clock_;
  SlowDown slow_down_;
  SimTime busy_until_;
  Duration busy_time_{0};  // the call that has it counted whole
  std::uint64_t calls_ = 0, arrivals_ = 0;
  User* holder_ = nullptr;      // whose call is the last
  std::vector<User*> users_;    // in order of joining
  EventHandle choice_;          // pending while something waits
  bool chooses_boots_ = false;  // in Phase::kFault
};

}  // namespace orrery
