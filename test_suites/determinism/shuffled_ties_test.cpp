// --orrery_shuffle_ties: three spacecraft, two of which speak to the third at the same instants
// over links that take the same time. What it makes of what it hears may depend on who came first,
// or not.
#include <orrery/harness/gtest/child_process.hpp>
#include <orrery/orrery.hpp>

#include <cmath>
#include <string>
#include <utility>
#include <vector>

using namespace orrery;
using testing::HasSubstr;
using testing::Not;

namespace {

class Speaker final : public Device {
 public:
  explicit Speaker(int number) : number_(number) {}
  std::string_view name() const override { return "crosslink"; }
  void start(DeviceContext& io) override {
    io.every(1s, [this, &io] {
      const ByteBuffer frame(1, static_cast<std::byte>(number_));
      io.transmit("listener", frame);
    });
  }

 private:
  int number_;
};

/// Sends back every 10 s the sum of all it has heard, or what it heard last.
class Listener final : public Device {
 public:
  explicit Listener(bool believes_the_last) : believes_the_last_(believes_the_last) {}
  std::string_view name() const override { return "crosslink"; }
  void start(DeviceContext& io) override {
    io.every(10s, [this, &io] {
      const ByteBuffer frame(1, static_cast<std::byte>(kept_));
      io.transmit("a", frame);
    });
  }
  void from_air(DeviceContext&, std::string_view, Bytes frame) override {
    const int number = std::to_integer<int>(frame[0]);
    kept_ = believes_the_last_ ? number : kept_ + number;
  }

 private:
  bool believes_the_last_;
  int kept_ = 0;
};

void fly(bool believes_the_last) {
  World world({.record = false, .run = RunId{3, 0}});
  const InertialState orbit =
      to_inertial(missions::reference_chief_orbit(missions::reference_epoch()));
  for (const char* name : {"a", "b", "listener"}) {
    SpacecraftOptions one{.name = name};
    one.initial.r_ECI = orbit.r_ECI;
    one.initial.v_ECI = orbit.v_ECI;
    one.initial.mass_kg = 11;
    world.add_spacecraft(one);
  }
  const RadioLinkOptions link{.delay = {.mu = std::log(0.1), .sigma = 0}, .p_on = 0};
  for (const auto& [from, to] : {std::pair{"a", "b"}, {"a", "listener"}, {"b", "listener"}}) {
    world.set_crosslink(from, to, link);
  }
  world.spacecraft("a").add<Speaker>(1);
  world.spacecraft("b").add<Speaker>(2);
  world.spacecraft("listener").add<Listener>(believes_the_last);
  world.run_for(1h);
  EXPECT_GT(world.events(), 3u * 4096);  // several checkpoints
}

TEST(TieSubject, AddsUp) {
  fly(false);
}
TEST(TieSubject, BelievesTheLast) {
  fly(true);
}
TEST(TieSubject, KeepsTheOrderOfOneOrigin) {
  World world({.record = false, .run = RunId{3, 0}});
  std::string order;
  world.every(1s, [&order] { order += 'x'; });
  world.every(1s, [&order] { order += 'y'; });
  world.run_for(3s);
  EXPECT_EQ(order, "xyxyxy");  // of one origin: holds in any order of ties
}

ChildOutcome shuffled(const std::string& test) {
  return run_child({.arguments = {"--gtest_filter=TieSubject." + test, "--orrery_shuffle_ties=3"},
                    .environment = {},
                    .removed = {"ORRERY_OUT"}});
}

}  // namespace

TEST(ShuffledTiesTest, ASumIsTheSameInAnyOrder) {
  const ChildOutcome outcome = shuffled("AddsUp");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.tail;
}

TEST(ShuffledTiesTest, ADependenceOnTheOrderIsReportedWithItsFirstEvent) {
  const ChildOutcome outcome = shuffled("BelievesTheLast");
  EXPECT_EQ(outcome.exit_code, 1) << outcome.tail;
  EXPECT_THAT(outcome.tail, HasSubstr("the run (seed 3) depends on tie order: another result with "
                                      "events of equal time and different origin in another order "
                                      "(--orrery_shuffle_ties=3)"));
  EXPECT_THAT(outcome.tail,
              HasSubstr("The first event that differs:\n  first run: frame arrival of a "
                        "from listener-a at "));
}

TEST(ShuffledTiesTest, EventsOfOneOriginStayInTheirOrder) {
  const ChildOutcome outcome = shuffled("KeepsTheOrderOfOneOrigin");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.tail;
}

// Both flags: the second run has the same order of ties as the first.
TEST(ShuffledTiesTest, VerifiesInTheShuffledOrder) {
  const ChildOutcome outcome =
      run_child({.arguments = {"--gtest_filter=TieSubject.AddsUp", "--orrery_shuffle_ties=7",
                               "--orrery_verify_determinism"},
                 .environment = {},
                 .removed = {"ORRERY_OUT"}});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.tail;
}
