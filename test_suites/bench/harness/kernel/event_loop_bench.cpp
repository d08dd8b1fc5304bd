// The hold model (Vaucher & Duval, 1975): a fixed number of events is pending; each event run
// schedules one successor after an exponentially distributed delay of mean 1 s.
#include <orrery/harness/kernel/event_loop.hpp>
#include <orrery/harness/kernel/random.hpp>

#include <benchmark/benchmark.h>

#include <cstdint>
#include <functional>
#include <queue>
#include <vector>

namespace orrery {
namespace {

constexpr std::uint64_t kSeed = 1;
constexpr EventKind kHold = {1001, "hold"};

// Delays are drawn beforehand: a logarithm costs as much as the heap that is to be measured. Each
// turn through the table adds a nanosecond, or events of different turns would fall together.
class Delays {
 public:
  Delays() {
    RandomStream random(kSeed);
    for (Duration& delay : delays_) delay = from_seconds(random.exponential(1.0));
  }
  Duration next() {
    const std::size_t i = i_++;
    return delays_[i % kCount] + Duration(i / kCount);
  }

 private:
  static constexpr std::size_t kCount = 1 << 16;
  std::vector<Duration> delays_ = std::vector<Duration>(kCount);
  std::size_t i_ = 0;
};

struct LoopEvent {
  EventLoop* loop;
  Delays* delays;
  OwnerId owner;

  void schedule() const {
    loop->schedule(loop->now() + delays->next(), {Phase::kDevice, owner, owner, &kHold}, *this);
  }
  void operator()() const { schedule(); }
};

// What is measured is all of it: pop, fingerprint, run, key, checks, push.
void BM_EventLoop_Hold(benchmark::State& state) {
  Delays delays;
  EventLoop loop(from_ns(0));
  const OwnerId chief = loop.add_owner("chief");
  const OwnerId deputy = loop.add_owner("deputy");
  for (std::int64_t i = 0; i < state.range(0); ++i) {
    LoopEvent{&loop, &delays, i % 2 == 0 ? chief : deputy}.schedule();
  }
  for (auto _ : state) loop.run_next(SimTime::max());
  benchmark::DoNotOptimize(loop.fingerprint().value());
  state.SetItemsProcessed(state.iterations());
}

struct PlainQueue {
  struct Event {
    EventKey key;
    std::function<void()> action;
    friend bool operator<(const Event& a, const Event& b) { return a.key > b.key; }
  };
  SimTime now = from_ns(0);
  std::uint64_t counter = 0;
  std::priority_queue<Event> events;

  void schedule(SimTime t, OwnerId owner, std::function<void()> action) {
    events.push({{t, Phase::kDevice, owner, owner, counter++}, std::move(action)});
  }
  void run_next() {
    // top() is const; a copy of the function would allocate, which is worse still.
    std::function<void()> action = std::move(const_cast<Event&>(events.top()).action);
    now = events.top().key.t;
    events.pop();
    action();
  }
};

struct PlainEvent {
  PlainQueue* queue;
  Delays* delays;
  OwnerId owner;

  void schedule() const { queue->schedule(queue->now + delays->next(), owner, *this); }
  void operator()() const { schedule(); }
};

// The same order and the same action with the standard library; no fingerprint, no checks, no
// cancellation.
void BM_PriorityQueueOfFunction_Hold(benchmark::State& state) {
  Delays delays;
  PlainQueue queue;
  for (std::int64_t i = 0; i < state.range(0); ++i) {
    PlainEvent{&queue, &delays, static_cast<OwnerId>(i % 2)}.schedule();
  }
  for (auto _ : state) queue.run_next();
  state.SetItemsProcessed(state.iterations());
}

// A timer that flight software sets again before it fires: cancel, schedule.
void BM_EventLoop_SetTimerAgain(benchmark::State& state) {
  Delays delays;
  EventLoop loop(from_ns(0));
  const OwnerId owner = loop.add_owner("chief");
  for (std::int64_t i = 0; i < state.range(0); ++i) LoopEvent{&loop, &delays, owner}.schedule();
  const auto set = [&] {
    return loop.schedule(loop.now() + delays.next(), {Phase::kTick, owner, owner, &kHold}, [] {});
  };
  EventHandle timer = set();
  for (auto _ : state) {
    loop.cancel(timer);
    timer = set();
  }
  state.SetItemsProcessed(state.iterations());
}

BENCHMARK(BM_EventLoop_Hold)->Arg(1000)->Arg(32000)->Arg(1000000);
BENCHMARK(BM_PriorityQueueOfFunction_Hold)->Arg(1000)->Arg(32000)->Arg(1000000);
BENCHMARK(BM_EventLoop_SetTimerAgain)->Arg(1000);

}  // namespace
}  // namespace orrery
