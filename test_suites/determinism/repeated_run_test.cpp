// EXPECT_DETERMINISTIC and --orrery_verify_determinism, on flight software that depends on what
// must not matter. Each library sends what it sees, so the frame's arrival at its peer is what
// differs.
#include <orrery/harness/gtest/child_process.hpp>
#include <orrery/harness/heap/interposition.hpp>
#include <orrery/orrery.hpp>

#include <gtest/gtest-spi.h>

#include <memory>
#include <string>

using namespace orrery;
using testing::HasSubstr;

namespace {

// Only the chief flies, unless both are to, and no message is lost: the deputy gets what the chief
// sends.
struct Flown {
  std::string library = {};
  Isolation isolation = Isolation::kCopy;
  HostServices services = HostServices::kVirtual;
  bool on_both = false;
};

std::unique_ptr<World> make_world(const Flown& flown) {
  auto world = std::make_unique<World>(WorldOptions{.record = false, .run = RunId{3, 0}});
  const InertialState orbit =
      to_inertial(missions::reference_chief_orbit(missions::reference_epoch()));
  for (const char* name : {"chief", "deputy"}) {
    SpacecraftOptions one{.name = name};
    one.initial.r_ECI = orbit.r_ECI;
    one.initial.v_ECI = orbit.v_ECI;
    one.initial.mass_kg = 11;
    if (flown.on_both || one.name == "chief") {
      one.flight = {
          .library = flown.library, .isolation = flown.isolation, .services = flown.services};
    }
    world->add_spacecraft(one);
  }
  world->set_crosslink("chief", "deputy", {.p_on = 0});
  return world;
}

void fly(const Flown& flown) {
  const std::unique_ptr<World> world = make_world(flown);
  world->run_for(5min);
  EXPECT_GT(world->flight("chief").calls(), 20u);
}

#define SKIP_WITHOUT_SIMULATED_HEAPS()                                       \
  if (!heap_simulation_available()) {                                        \
    GTEST_SKIP() << "malloc is the sanitizer's here: no heap can be varied"; \
  }

// What a test author would write; flown again by the flag below.
TEST(SubjectTest, FliesTheBeacon) {
  fly({"fixture_beacon"});
}
TEST(SubjectTest, FliesUninitialisedMemory) {
  fly({"uninitialised"});
}

TEST(SubjectTest, FliesAnUninitialisedVariable) {
  fly({"uninitialised_stack"});
}
TEST(SubjectTest, FliesAContainerOrderedByPointers) {
  fly({"pointer_order"});
}
TEST(SubjectTest, FliesAHiddenStaticOfADependency) {
  fly({.library = "hidden_dependency", .isolation = Isolation::kShared, .on_both = true});
}
TEST(SubjectTest, FliesAWallClock) {
  fly({.library = "wall_clock", .services = HostServices::kHost});
}
TEST(SubjectTest, FliesAnUnseededGenerator) {
  fly({.library = "unseeded", .services = HostServices::kHost});
}

ChildOutcome verified(const std::string& test) {
  return run_child({.arguments = {"--gtest_filter=" + test, "--orrery_verify_determinism"},
                    .environment = {},
                    .removed = {"ORRERY_OUT"}});
}

}  // namespace

TEST(ExpectDeterministicTest, SoundSoftwareFliesEqually) {
  EXPECT_DETERMINISTIC({ fly({"fixture_beacon"}); });
}

TEST(ExpectDeterministicTest, UninitialisedMemoryIsFoundWithItsSpacecraft) {
  SKIP_WITHOUT_SIMULATED_HEAPS();
  const testing::AssertionResult result = flies_equally([] { fly({"uninitialised"}); });
  ASSERT_FALSE(result);
  EXPECT_THAT(result.message(), HasSubstr("The first event that differs:\n  first run: "));
  EXPECT_THAT(result.message(), HasSubstr("of chief"));
}

TEST(ExpectDeterministicTest, AContainerOrderedByPointersIsFound) {
  SKIP_WITHOUT_SIMULATED_HEAPS();
  const testing::AssertionResult result = flies_equally([] { fly({"pointer_order"}); });
  ASSERT_FALSE(result);
  EXPECT_THAT(result.message(), HasSubstr("The first event that differs:\n  first run: "));
}

// Another world keeps the library loaded, as the paper's second object did.
TEST(ExpectDeterministicTest, AStaticThatOutlivesItsInstanceIsFound) {
  const std::unique_ptr<World> other = make_world({"hidden_static", Isolation::kShared});
  EXPECT_FALSE(flies_equally([] { fly({"hidden_static", Isolation::kShared}); }));
  EXPECT_TRUE(flies_equally([] { fly({"hidden_static", Isolation::kCopy}); }));
}

TEST(ExpectDeterministicTest, ATestThatItselfDiffersIsFound) {
  int flown = 0;
  const testing::AssertionResult result = flies_equally([&flown] {
    FormationWorld world({.world = {.record = false}, .run = RunId{3, 0}});
    world.run_for(++flown % 2 == 0 ? 1min : 2min);
  });
  ASSERT_FALSE(result);
  EXPECT_THAT(result.message(), HasSubstr("the same seed gave another run: the run (seed 3)"));
  EXPECT_THAT(result.message(), HasSubstr("(no event)"));
}

TEST(VerifyDeterminismTest, APassingTestStaysGreen) {
  const ChildOutcome outcome = verified("SubjectTest.FliesTheBeacon");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.tail;
  EXPECT_THAT(outcome.tail, HasSubstr("[  PASSED  ] 1 test."));
}

TEST(VerifyDeterminismTest, ADependenceOnMemoryFailsTheTestThatHasIt) {
  SKIP_WITHOUT_SIMULATED_HEAPS();
  const ChildOutcome outcome = verified("SubjectTest.FliesUninitialisedMemory");
  EXPECT_EQ(outcome.exit_code, 1) << outcome.tail;
  EXPECT_THAT(outcome.tail, HasSubstr("the same seed gave another run: the run (seed 3)"));
  EXPECT_THAT(outcome.tail, HasSubstr("The first event that differs:\n  first run: "));
  EXPECT_THAT(outcome.tail, HasSubstr("of chief"));
  EXPECT_THAT(outcome.tail, HasSubstr("[  FAILED  ] SubjectTest.FliesUninitialisedMemory"));
}

// Each of the five defects is found and named by varying one thing at a time.
TEST(VerifyDeterminismTest, UninitialisedMemoryIsNamed) {
  SKIP_WITHOUT_SIMULATED_HEAPS();
  EXPECT_THAT(verified("SubjectTest.FliesUninitialisedMemory").tail,
              HasSubstr("Cause: it changes with what fresh memory of heap and stack holds"));
}

// Earlier calls have left addresses there, which the loader draws anew for each run.
TEST(VerifyDeterminismTest, AnUninitialisedVariableOnTheStackIsNamed) {
  SKIP_WITHOUT_SIMULATED_HEAPS();
  const ChildOutcome outcome = verified("SubjectTest.FliesAnUninitialisedVariable");
  EXPECT_EQ(outcome.exit_code, 1) << outcome.tail;
  EXPECT_THAT(outcome.tail, HasSubstr("flight code reads memory that it has not written"));
  EXPECT_THAT(outcome.tail, testing::Not(HasSubstr("wall clock")));
  EXPECT_THAT(outcome.tail, testing::Not(HasSubstr("ordered or hashed by pointers")));
}

TEST(VerifyDeterminismTest, AContainerOrderedByPointersIsNamed) {
  SKIP_WITHOUT_SIMULATED_HEAPS();
  const ChildOutcome outcome = verified("SubjectTest.FliesAContainerOrderedByPointers");
  EXPECT_EQ(outcome.exit_code, 1) << outcome.tail;
  EXPECT_THAT(outcome.tail, HasSubstr("Cause: it changes with the addresses of heap blocks"));
  EXPECT_THAT(outcome.tail, testing::Not(HasSubstr("fresh memory")));
}

// The static is named, and the library that has it is not the flight library.
TEST(VerifyDeterminismTest, AHiddenStaticOfADependencyIsNamed) {
  const ChildOutcome outcome = verified("SubjectTest.FliesAHiddenStaticOfADependency");
  EXPECT_EQ(outcome.exit_code, 1) << outcome.tail;
  EXPECT_THAT(outcome.tail,
              HasSubstr("Cause: it changes when each instance has globals of its own"));
  EXPECT_THAT(outcome.tail, HasSubstr("(next_sequence_number of libsequence.so)"));
}

// By the function that was called, and from where.
TEST(VerifyDeterminismTest, TheWallClockIsNamed) {
  if (!services_are_virtual()) GTEST_SKIP() << "a sanitizer owns the clock's functions";
  const ChildOutcome outcome = verified("SubjectTest.FliesAWallClock");
  EXPECT_EQ(outcome.exit_code, 1) << outcome.tail;
  EXPECT_THAT(outcome.tail, HasSubstr("Cause: it changes from run to run with nothing varied"));
  EXPECT_THAT(outcome.tail, HasSubstr("clock_gettime called, which this test forbids"));
}

TEST(VerifyDeterminismTest, AnUnseededGeneratorIsNamed) {
  if (!services_are_virtual()) GTEST_SKIP() << "a sanitizer owns the functions of chance";
  const ChildOutcome outcome = verified("SubjectTest.FliesAnUnseededGenerator");
  EXPECT_EQ(outcome.exit_code, 1) << outcome.tail;
  EXPECT_THAT(outcome.tail, HasSubstr("Cause: it changes from run to run with nothing varied"));
  EXPECT_THAT(outcome.tail, HasSubstr("called, which this test forbids"));
}
