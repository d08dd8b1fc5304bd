#include <orrery/harness/kernel/event_loop.hpp>
#include <orrery/harness/kernel/lazy_system.hpp>
#include <orrery/harness/kernel/random.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <span>
#include <stdexcept>
#include <vector>

namespace orrery {
namespace {

const SimTime kStart = gps_midnight(2025, 3, 20);

// A pendulum with a motor that is switched at announced instants: not linear, so that splitting a
// step shows in the last bits.
struct Pendulum {
  struct State {
    double angle_rad = 0.3;
    double rate_radps = 0.0;
    bool operator==(const State&) const = default;
  };

  std::vector<SimTime> switches;  // in order of time
  double torque = 0.0;            // added by the test, within a discontinuity

  double motor(SimTime from) const {
    const auto passed = std::upper_bound(switches.begin(), switches.end(), from);
    return (passed - switches.begin()) % 2 == 1 ? 0.05 : 0.0;
  }

  // Classical Runge-Kutta, one step.
  State step(const State& x, SimTime from, SimTime to) const {
    const double h = to_seconds(to - from);
    const double drive = motor(from) + torque;
    const auto slope = [&](const State& s) {
      return State{s.rate_radps, drive - std::sin(s.angle_rad)};
    };
    const auto moved = [&](const State& k, double dt_s) {
      return State{x.angle_rad + dt_s * k.angle_rad, x.rate_radps + dt_s * k.rate_radps};
    };
    const State k1 = slope(x);
    const State k2 = slope(moved(k1, h / 2));
    const State k3 = slope(moved(k2, h / 2));
    const State k4 = slope(moved(k3, h));
    return {
        x.angle_rad + h / 6 * (k1.angle_rad + 2 * k2.angle_rad + 2 * k3.angle_rad + k4.angle_rad),
        x.rate_radps +
            h / 6 * (k1.rate_radps + 2 * k2.rate_radps + 2 * k3.rate_radps + k4.rate_radps)};
  }

  // Cubic Hermite for the angle, its derivative for the rate.
  State interpolate(const State& a, SimTime t_a, const State& b, SimTime t_b, SimTime t) const {
    const double h = to_seconds(t_b - t_a);
    const double s = to_seconds(t - t_a) / h;
    const double chord = (b.angle_rad - a.angle_rad) / h;
    const double c = 3 * chord - 2 * a.rate_radps - b.rate_radps;
    const double d = a.rate_radps + b.rate_radps - 2 * chord;
    return {a.angle_rad + h * s * (a.rate_radps + s * (c + s * d)),
            a.rate_radps + s * (2 * c + 3 * s * d)};
  }

  std::optional<SimTime> next_discontinuity(SimTime after) const {
    const auto next = std::upper_bound(switches.begin(), switches.end(), after);
    if (next == switches.end()) return std::nullopt;
    return *next;
  }
};

using State = Pendulum::State;

struct LazySystemTest : testing::Test {
  LazySystem<Pendulum> system = LazySystem<Pendulum>(Pendulum(), State(), kStart, 100ms);
};

TEST_F(LazySystemTest, NothingIsPropagatedUntilSomebodyLooks) {
  EXPECT_EQ(system.at(kStart), State());
  EXPECT_EQ(system.steps(), 0u);
  EXPECT_EQ(system.committed_time(), kStart);
}

TEST_F(LazySystemTest, LookOnAGridPointIsTheStateThere) {
  State x;
  for (int k = 0; k < 10; ++k) {
    x = Pendulum().step(x, kStart + k * 100ms, kStart + (k + 1) * 100ms);
  }
  EXPECT_EQ(system.at(kStart + 1s), x);
  EXPECT_EQ(system.steps(), 10u);
  EXPECT_EQ(system.interpolations(), 0u);
}

TEST_F(LazySystemTest, LooksBetweenTwoPointsCostOneStepInAll) {
  for (int ms = 1; ms < 100; ++ms) system.at(kStart + ms * 1ms);
  EXPECT_EQ(system.steps(), 1u);
  EXPECT_EQ(system.interpolations(), 99u);
  system.at(kStart + 100ms);
  EXPECT_EQ(system.steps(), 1u) << "the point looked ahead to was not used";
}

TEST_F(LazySystemTest, LookBetweenPointsIsInterpolatedBetweenThem) {
  const Pendulum model;
  const State a = model.step(State(), kStart, kStart + 100ms);
  const State b = model.step(a, kStart + 100ms, kStart + 200ms);
  EXPECT_EQ(system.at(kStart + 130ms),
            model.interpolate(a, kStart + 100ms, b, kStart + 200ms, kStart + 130ms));
}

TEST_F(LazySystemTest, ImpulseIsSeenAtItsInstantAndAfterButNotBefore) {
  const State before = system.at(kStart + 150ms);
  system.discontinuity(kStart + 150ms, [](State& x) { x.rate_radps += 1.0; });
  const State after = system.at(kStart + 150ms);
  EXPECT_EQ(system.committed_time(), kStart + 150ms);
  EXPECT_NEAR(after.rate_radps - before.rate_radps, 1.0, 1e-6);  // before was interpolated
  EXPECT_EQ(after, system.committed());
}

TEST_F(LazySystemTest, AfterAnImpulseTheGridIsTheOldOne) {
  system.discontinuity(kStart + 150ms, [](State&) {});
  system.at(kStart + 199ms);
  EXPECT_EQ(system.committed_time(), kStart + 150ms);
  system.at(kStart + 201ms);
  EXPECT_EQ(system.committed_time(), kStart + 200ms);
}

TEST_F(LazySystemTest, ImpulsesAtOneInstantAddUpWithoutAStepBetween) {
  system.discontinuity(kStart + 150ms, [](State& x) { x.rate_radps += 1.0; });
  const std::uint64_t steps = system.steps();
  const State once = system.committed();
  system.discontinuity(kStart + 150ms, [](State& x) { x.rate_radps += 1.0; });
  EXPECT_EQ(system.steps(), steps);
  EXPECT_EQ(system.committed().rate_radps, once.rate_radps + 1.0);
  EXPECT_EQ(system.committed().angle_rad, once.angle_rad);
}

// The point ahead was computed with the old torque; keeping it would be the bug.
TEST_F(LazySystemTest, ChangeOfTheModelDropsThePointAhead) {
  system.at(kStart + 120ms);
  system.discontinuity(kStart + 120ms, [&](State&) { system.model().torque = 0.5; });
  const State cut = system.committed();
  Pendulum pushed;
  pushed.torque = 0.5;
  EXPECT_EQ(system.at(kStart + 200ms), pushed.step(cut, kStart + 120ms, kStart + 200ms));
}

// Not in the order of time, but nothing final is touched: the impulse counts.
TEST_F(LazySystemTest, ImpulseOnTheCommittedPointDropsThePointAhead) {
  system.at(kStart + 30ms);
  system.discontinuity(kStart, [](State& x) { x.rate_radps = 1.0; });
  EXPECT_EQ(system.at(kStart + 100ms),
            Pendulum().step({.angle_rad = 0.3, .rate_radps = 1.0}, kStart, kStart + 100ms));
}

TEST_F(LazySystemTest, ChangeThatThrowsLeavesTheStateBeforeIt) {
  const auto fails = [](State& x) {
    x.rate_radps = 99.0;
    throw std::runtime_error("no");
  };
  EXPECT_THROW(system.discontinuity(kStart + 150ms, fails), std::runtime_error);
  EXPECT_LT(std::fabs(system.at(kStart + 150ms).rate_radps), 1.0);
}

TEST_F(LazySystemTest, LookBeforeTheCommittedPointGivesBothTimes) {
  system.at(kStart + 1s);
  try {
    system.at(kStart + 999ms);
    FAIL() << "a look in the past was answered";
  } catch (const std::logic_error& error) {
    EXPECT_STREQ(error.what(),
                 "LazySystem::at: t = 2025-03-20T00:00:00.999000000 GPST is before the last "
                 "committed point, 2025-03-20T00:00:01.000000000 GPST");
  }
  EXPECT_THROW(system.discontinuity(kStart, [](State&) {}), std::logic_error);
}

TEST(LazySystemErrorsTest, StepMustBePositive) {
  EXPECT_THROW(LazySystem<Pendulum>(Pendulum(), State(), kStart, 0s), std::invalid_argument);
  EXPECT_THROW(LazySystem<Pendulum>(Pendulum(), State(), kStart, -1s), std::invalid_argument);
}

TEST(LazySystemErrorsTest, DiscontinuityThatIsNotAheadIsAnErrorNotAnEndlessLoop) {
  struct Stuck : Pendulum {
    std::optional<SimTime> next_discontinuity(SimTime after) const { return after; }
  };
  LazySystem<Stuck> system(Stuck(), State(), kStart, 1s);
  EXPECT_THROW(system.at(kStart + 1s), std::logic_error);
}

// The naive reference: all that happens is known beforehand, every point is computed, in order.
struct Scenario {
  explicit Scenario(std::uint64_t seed) {
    RandomStream random(seed);
    for (int i = 0; i < 6; ++i) {
      const std::int64_t ms = random.integer(1, 20'000);
      // Every third on a grid point.
      switches.insert(kStart + (i % 3 == 0 ? ms / 100 * 100 : ms) * 1ms);
    }
    for (int i = 0; i < 12; ++i) {
      const std::int64_t ms = random.integer(0, 20'000);
      const double dv = random.uniform(-0.2, 0.2);
      impulses[kStart + (i % 3 == 0 ? ms / 100 * 100 : ms) * 1ms] = dv;
    }
    // One impulse at an announced instant.
    impulses[*switches.begin()] = 0.1;
    model.switches.assign(switches.begin(), switches.end());
  }

  // The point after t, impulses left out of account.
  SimTime point_after(SimTime t) const {
    SimTime next = kStart;
    while (next <= t) next += 100ms;
    const auto cut = switches.upper_bound(t);
    return cut == switches.end() ? next : std::min(next, *cut);
  }

  // State at `t` after all that happens at t or before.
  State truth(SimTime t) const {
    SimTime now = kStart;
    State x;
    for (;;) {
      const auto impulse = impulses.find(now);
      if (impulse != impulses.end()) x.rate_radps += impulse->second;
      const SimTime point = point_after(now);
      const auto next_impulse = impulses.upper_bound(now);
      const SimTime next =
          next_impulse == impulses.end() ? point : std::min(point, next_impulse->first);
      if (now == t) return x;
      if (next > t) return model.interpolate(x, now, model.step(x, now, point), point, t);
      x = model.step(x, now, next);
      now = next;
    }
  }

  std::set<SimTime> switches;
  std::map<SimTime, double> impulses;
  Pendulum model;
};

struct LazySystemLooksTest : testing::TestWithParam<std::uint64_t> {
  // Runs the scenario with looks at these instants; an impulse comes before a look at its instant.
  std::vector<State> run(const std::vector<SimTime>& looks) {
    LazySystem<Pendulum> system(scenario.model, State(), kStart, 100ms);
    std::vector<State> seen;
    auto impulse = scenario.impulses.begin();
    for (const SimTime t : looks) {
      for (; impulse != scenario.impulses.end() && impulse->first <= t; ++impulse) {
        system.discontinuity(impulse->first, [&](State& x) { x.rate_radps += impulse->second; });
      }
      seen.push_back(system.at(t));
    }
    return seen;
  }
  std::vector<SimTime> random_looks(std::size_t count) {
    std::vector<SimTime> looks;
    for (std::size_t i = 0; i < count; ++i)
      looks.push_back(kStart + random.integer(0, 20'999) * 1ms);
    std::sort(looks.begin(), looks.end());
    return looks;
  }

  RandomStream random = RandomStream(GetParam() + 1000);
  Scenario scenario = Scenario(GetParam());
  const SimTime end = kStart + 21s;
};

TEST_P(LazySystemLooksTest, EveryLookAgreesWithTheNaiveReferenceToTheBit) {
  const std::vector<SimTime> looks = random_looks(200);
  const std::vector<State> seen = run(looks);
  for (std::size_t i = 0; i < looks.size(); ++i) {
    EXPECT_EQ(seen[i], scenario.truth(looks[i])) << to_string(looks[i]);
  }
}

TEST_P(LazySystemLooksTest, LookingMoreOftenChangesNoBitOfTheEnd) {
  std::vector<SimTime> looks = random_looks(300);
  looks.push_back(end);
  EXPECT_EQ(run(looks).back(), run({end}).back());
}

TEST_P(LazySystemLooksTest, WhatALookSeesDoesNotDependOnOtherLooks) {
  const std::vector<SimTime> looks = random_looks(100);
  const std::vector<State> seen = run(looks);
  for (std::size_t i = 0; i < looks.size(); i += 10) {
    EXPECT_EQ(run({looks[i]}).back(), seen[i]) << to_string(looks[i]);
  }
}

INSTANTIATE_TEST_SUITE_P(Seeds, LazySystemLooksTest, testing::Range<std::uint64_t>(1, 21));

// A ball that is thrown up and bounces: at the floor, an edge of its state, the rate turns. The
// flight between bounces is a parabola, so that the instants are known in closed form.
struct Ball {
  struct State {
    double height_m = 2.0, rate_mps = 0.0;
    int bounces = 0;
    bool operator==(const State&) const = default;
  };
  struct Crossing {
    SimTime t;
  };
  static constexpr double kGravity_mps2 = 10.0;
  bool bounces = true;

  State step(const State& x, SimTime from, SimTime to) const {
    const double h = to_seconds(to - from);
    return {x.height_m + h * x.rate_mps - kGravity_mps2 / 2 * h * h, x.rate_mps - kGravity_mps2 * h,
            x.bounces};
  }
  State interpolate(const State& a, SimTime t_a, const State&, SimTime, SimTime t) const {
    return step(a, t_a, t);
  }
  std::optional<SimTime> next_discontinuity(SimTime) const { return std::nullopt; }
  bool has_edges() const { return bounces; }
  std::optional<Crossing> crossing(const State& a, SimTime t_a, const State& b, SimTime t_b) const {
    if (b.height_m > 0) return std::nullopt;
    const double root_s =
        (a.rate_mps + std::sqrt(a.rate_mps * a.rate_mps + 2 * kGravity_mps2 * a.height_m)) /
        kGravity_mps2;
    return Crossing{std::min(t_b, t_a + from_seconds(root_s) + 1ns)};
  }
  State beyond(const State& at, const Crossing&) const {
    return {at.height_m, -at.rate_mps, at.bounces + 1};
  }
};

struct LazySystemEdgesTest : testing::Test {
  LazySystem<Ball> system = LazySystem<Ball>(Ball(), Ball::State(), kStart, 100ms);
  // From 2 m: the floor is met after sqrt(0.4) s, and from then on every 2 sqrt(0.4) s. Each point
  // is up to 1.5 ns late, which delays what follows by twice that: 4e-7 m at 6.3 m/s after 20
  // bounces.
  const double fall_s = std::sqrt(0.4);
  double height_m(double t_s) const {
    const double since_top_s = std::remainder(t_s, 2 * fall_s);
    return 2 - 5 * since_top_s * since_top_s;
  }
};

TEST_F(LazySystemEdgesTest, StepsEndWhereTheStateMeetsAnEdge) {
  EXPECT_EQ(system.at(kStart + 600ms).bounces, 0);
  EXPECT_EQ(system.at(kStart + 632ms).bounces, 0) << "before sqrt(0.4) s = 632.456 ms";
  EXPECT_EQ(system.at(kStart + 633ms).bounces, 1);
  EXPECT_EQ(system.committed_time(), kStart + from_seconds(fall_s) + 1ns);
  EXPECT_EQ(system.at(kStart + 700ms).bounces, 1);
  EXPECT_EQ(system.committed_time(), kStart + 700ms) << "on the old grid again";
  EXPECT_EQ(system.steps(), 9u) << "7 to grid points, one of them in vain, one to the edge, one on";
}

TEST_F(LazySystemEdgesTest, EveryEdgeIsMetAndLooksDoNotMatter) {
  LazySystem<Ball> seldom(Ball(), Ball::State(), kStart, 100ms);
  for (int k = 1; k <= 25'000; ++k) {
    const SimTime t = kStart + k * 1ms;
    const Ball::State x = system.at(t);
    ASSERT_NEAR(x.height_m, height_m(1e-3 * k), 4e-7) << k;
    if (k % 4999 == 0) {
      EXPECT_EQ(seldom.at(t), x) << k;
    }
  }
  EXPECT_EQ(system.committed().bounces, 20);  // (25 / 0.632 + 1) / 2
}

// Something that happens after the edge but before the grid point must find the edge first; whether
// a look had found it already must not matter.
TEST_F(LazySystemEdgesTest, AnEdgeBeforeADiscontinuityComesFirst) {
  LazySystem<Ball> looked(Ball(), Ball::State(), kStart, 100ms);
  (void)looked.at(kStart + 640ms);
  (void)system.at(kStart + 610ms);
  const auto kick = [](Ball::State& x) { x.rate_mps += 1; };
  looked.discontinuity(kStart + 650ms, kick);
  system.discontinuity(kStart + 650ms, kick);
  EXPECT_EQ(system.committed().bounces, 1);
  EXPECT_EQ(system.committed(), looked.committed());
  EXPECT_EQ(system.at(kStart + 3s), looked.at(kStart + 3s));
}

TEST_F(LazySystemEdgesTest, ADiscontinuityBeforeTheEdgeMovesIt) {
  (void)system.at(kStart + 620ms);  // the bounce at 632 ms is in the point ahead
  system.discontinuity(kStart + 620ms, [](Ball::State& x) { x.rate_mps = 5; });
  EXPECT_EQ(system.at(kStart + 640ms).bounces, 0);
}

TEST(LazySystemErrorsTest, AnEdgeOutsideTheStepIsAnErrorNotAnEndlessLoop) {
  struct Stuck : Ball {
    std::optional<Crossing> crossing(const State&, SimTime t_a, const State&, SimTime) const {
      return Crossing{t_a};
    }
  };
  LazySystem<Stuck> system(Stuck(), Ball::State(), kStart, 1s);
  EXPECT_THROW(system.at(kStart + 1s), std::logic_error);
}

// The two limits of a hybrid simulation.

constexpr EventKind kCount = {1003, "count"};

// Nothing moves between events.
struct Still {
  using State = std::int64_t;
  State step(const State& x, SimTime, SimTime) const { return x; }
  State interpolate(const State& a, SimTime, const State&, SimTime, SimTime) const { return a; }
  std::optional<SimTime> next_discontinuity(SimTime) const { return std::nullopt; }
};

// Two owners add to a number at random instants and put what they find into the fingerprint.
// `Number` keeps it: a plain variable, or a continuous system.
template <class Number>
std::string fingerprint_of_adding(Number number) {
  EventLoop loop(kStart);
  RandomStream random(1);
  struct Adder {
    EventLoop* loop;
    RandomStream* random;
    Number* number;
    OwnerId owner;
    void schedule() const {
      const Duration delay = from_seconds(random->exponential(0.5));
      loop->schedule(loop->now() + delay, {Phase::kDevice, owner, owner, &kCount}, *this);
    }
    void operator()() const {
      number->add(loop->now(), random->integer(-9, 9));
      const std::int64_t found = number->get(loop->now());
      loop->fingerprint_payload(std::as_bytes(std::span(&found, 1)));
      schedule();
    }
  };
  for (const char* name : {"a", "b"}) {
    Adder{&loop, &random, &number, loop.add_owner(name)}.schedule();
  }
  loop.run_until(kStart + 1000s);
  EXPECT_GT(loop.events_executed(), 3000u);
  return loop.fingerprint().value();
}

struct PlainNumber {
  std::int64_t x = 0;
  void add(SimTime, std::int64_t dx) { x += dx; }
  std::int64_t get(SimTime) const { return x; }
};

struct PropagatedNumber {
  LazySystem<Still> system = LazySystem<Still>(Still(), 0, kStart, 100ms);
  void add(SimTime t, std::int64_t dx) {
    system.discontinuity(t, [dx](std::int64_t& x) { x += dx; });
  }
  std::int64_t get(SimTime t) { return system.at(t); }
};

TEST(HybridLimitsTest, IdentityPropagationGivesTheDiscreteEventSequence) {
  EXPECT_EQ(fingerprint_of_adding(PropagatedNumber()), fingerprint_of_adding(PlainNumber()));
}

TEST(HybridLimitsTest, FixedTickWithoutEventsGivesTheContinuousSequence) {
  std::vector<State> expected;
  State x;
  for (int k = 0; k < 1000; ++k) {
    x = Pendulum().step(x, kStart + k * 100ms, kStart + (k + 1) * 100ms);
    expected.push_back(x);
  }

  EventLoop loop(kStart);
  LazySystem<Pendulum> system(Pendulum(), State(), kStart, 100ms);
  std::vector<State> seen;
  struct Tick {
    EventLoop* loop;
    LazySystem<Pendulum>* system;
    std::vector<State>* seen;
    void schedule() const {
      loop->schedule(loop->now() + 100ms, {Phase::kTick, 0, 0, &kCount}, *this);
    }
    void operator()() const {
      seen->push_back(system->at(loop->now()));
      schedule();
    }
  };
  loop.add_owner("spacecraft");
  Tick{&loop, &system, &seen}.schedule();
  loop.run_until(kStart + 100s);
  EXPECT_EQ(seen, expected);
  EXPECT_EQ(system.steps(), 1000u);
  EXPECT_EQ(system.interpolations(), 0u);
}

TEST(HybridLimitsTest, SoftwareEventsCauseNoPropagation) {
  EventLoop loop(kStart);
  const OwnerId owner = loop.add_owner("spacecraft");
  LazySystem<Pendulum> system(Pendulum(), State(), kStart, 100ms);
  for (int i = 0; i < 100; ++i) {
    loop.schedule(kStart + i * 1s, {Phase::kTick, owner, owner, &kCount}, [] {});
  }
  loop.run_until(kStart + 1h);
  EXPECT_EQ(system.steps(), 0u);
  system.at(loop.now());
  EXPECT_EQ(system.steps(), 36'000u);
}

}  // namespace
}  // namespace orrery
