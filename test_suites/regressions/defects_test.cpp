// Property: each defect of flight_sw/defects ends its process, where it is, under its name; the
// other spacecraft and the run go on.
#include <orrery/harness/flight/flight_stack.hpp>
#include <orrery/harness/heap/interposition.hpp>
#include <orrery/orrery.hpp>

#include <csignal>
#include <cstring>
#include <fstream>
#include <map>
#include <random>
#include <string>
#include <string_view>
#include <unistd.h>
#include <vector>

using namespace orrery;
using testing::AllOf;
using testing::HasSubstr;

namespace {

FormationOptions flown(const std::string& library) {
  FormationOptions options{.flight = {.library = library}};
  options.world.record = false;
  return options;
}

// A healthy command to both at 10 s, the one that shows the defect to the deputy at 20 s.
class DefectWorld : public FormationWorld {
 public:
  explicit DefectWorld(const FormationOptions& options) : FormationWorld(options) {
    for (const char* name : {"chief", "deputy"}) command(name, 10s, "ping");
    command("deputy", 20s, "x marks the defect");
  }
  void command(const char* to, Duration t, std::string_view text) {
    ground().command(to, at(t), std::as_bytes(std::span(text)));
  }
};

// The whole of what is common: found, named, contained, and found again after a reboot.
void expect_caught(const FormationOptions& options,
                   const testing::Matcher<const CrashReport&>& matcher) {
  DefectWorld world(options);
  world.command("chief", 25s, "ping");
  world.flight("deputy").reboot_after(2s);
  EXPECT_FLIGHT_CRASH(world.run_for(30s), world.flight("deputy"),
                      AllOf(CrashPort("command"), matcher));
  EXPECT_TRUE(world.flight("chief").alive());
  EXPECT_EQ(world.flight("chief").calls(), 3u);  // create and two commands
  EXPECT_TRUE(world.flight("deputy").alive());
  EXPECT_EQ(world.flight("deputy").boots(), 2u);
  world.command("deputy", 40s, "x once more");
  EXPECT_FLIGHT_CRASH(world.run_for(30s), world.flight("deputy"), matcher);
  EXPECT_EQ(world.flight("deputy").crashes(), 2u);
}

std::int64_t resident_bytes() {
  std::int64_t total = 0, resident = 0;
  std::ifstream("/proc/self/statm") >> total >> resident;
  return resident * sysconf(_SC_PAGESIZE);
}

// What the deputy answers.
std::vector<std::uint32_t> telemetry(const FormationOptions& options) {
  DefectWorld world(options);
  std::vector<std::uint32_t> answers;
  world.flight("deputy").on_output("telemetry", [&answers](SimTime, Bytes bytes) {
    answers.emplace_back();
    std::memcpy(&answers.back(), bytes.data(), sizeof answers.back());
  });
  world.run_for(30s);
  return answers;
}

}  // namespace

TEST(DefectTest, NullDereferenceIsCaughtWithItsFunction) {
  expect_caught(flown("defect_null_dereference"),
                AllOf(CrashKindIs(CrashKind::kSignal), CrashSignal(SIGSEGV),
                      CrashMessage(HasSubstr("at address (nil)")), CrashIn("radius_m")));
}

TEST(DefectTest, StackOverflowIsCalledThat) {
  expect_caught(flown("defect_stack_overflow"),
                AllOf(CrashKindIs(CrashKind::kStackOverflow), CrashIn("parse_nested")));
}

TEST(DefectTest, EndlessLoopEndsAtItsWorkBudget) {
  FormationOptions options = flown("defect_endless_loop");
  options.flight.work_budget = 1'000'000;
  expect_caught(options, AllOf(CrashKindIs(CrashKind::kWorkBudget), CrashIn("collect"),
                               testing::Field(&CrashReport::work, 1'000'000u)));
}

TEST(DefectTest, EndlessLoopRunsIntoTheLimitOfHostTimeWithoutABudget) {
  FormationOptions options = flown("defect_endless_loop");
  options.flight.host_time_limit = 200ms;
  expect_caught(options, AllOf(CrashKindIs(CrashKind::kTimeout), CrashIn("collect")));
}

TEST(DefectTest, ThreadAgainstTheRulesIsRefusedByName) {
  if (!services_are_virtual()) GTEST_SKIP() << "a sanitizer owns pthread_create";
  expect_caught(flown("defect_unguarded_thread"),
                AllOf(CrashKindIs(CrashKind::kForbiddenCall),
                      CrashMessage(HasSubstr("pthread_create called")), CrashIn("start_logger")));
}

// g++ terminates with the throwing frame on the stack; clang 14 unwinds to the noexcept entry
// first.
TEST(DefectTest, ExceptionThroughTheBoundaryEndsWhereItWasThrown) {
#ifdef __clang__
  const char* innermost = "Thunks";
#else
  const char* innermost = "check";
#endif
  expect_caught(flown("defect_exception"),
                AllOf(CrashKindIs(CrashKind::kException),
                      CrashMessage("uncaught std::out_of_range: command of an unknown length"),
                      CrashIn(innermost)));
}

// No crash: the chief's count shows the deputy's command. Copies do not meet.
TEST(DefectTest, GlobalStateShowsUnderSharedIsolationAndIsNamed) {
  for (const Isolation isolation : {Isolation::kShared, Isolation::kCopy}) {
    FormationOptions options = flown("defect_global_state");
    options.flight.isolation = isolation;
    DefectWorld world(options);
    world.command("chief", 25s, "x");
    std::uint32_t counted = 0;
    world.flight("chief").on_output("telemetry", [&counted](SimTime, Bytes bytes) {
      std::memcpy(&counted, bytes.data(), sizeof counted);
    });
    world.run_for(30s);
    const bool shared = isolation == Isolation::kShared;
    EXPECT_EQ(counted, shared ? 2u : 1u);
    EXPECT_THAT(world.flight("deputy").written_global(), HasSubstr(shared ? "commands_heard" : ""));
    EXPECT_EQ(world.flight("deputy").written_global().empty(), !shared);
  }
}

TEST(DefectTest, DoubleFreeIsNamedWithItsSecondCaller) {
  if (!heap_simulation_available()) GTEST_SKIP() << "a sanitizer owns malloc";
  expect_caught(flown("defect_double_free"),
                AllOf(CrashKindIs(CrashKind::kHeapFault), CrashMessage(HasSubstr("double free")),
                      CrashIn("discard")));
}

TEST(DefectTest, OverrunIsFoundWhenTheBlockIsFreed) {
  if (!heap_simulation_available()) GTEST_SKIP() << "a sanitizer owns malloc";
  expect_caught(flown("defect_overrun"),
                AllOf(CrashKindIs(CrashKind::kHeapFault),
                      CrashMessage(HasSubstr("overwritten block header, footer or link")),
                      CrashIn("copy_name")));
}

TEST(DefectTest, LeakIsNamedWithWhoAllocatedIt) {
  if (!heap_simulation_available()) GTEST_SKIP() << "a sanitizer owns malloc";
  FormationOptions options = flown("defect_leak");
  options.flight.heap.track_sites = true;
  DefectWorld world(options);
  world.command("deputy", 25s, "x: and another");
  world.run_for(15s);  // the first healthy command has been answered
  const std::uint64_t begin = world.heap("deputy").mark();
  world.run_for(15s);
  const std::vector<LeakReport> leaks = world.heap("deputy").leaks(begin);
  ASSERT_EQ(leaks.size(), 1u);
  EXPECT_EQ(leaks[0].blocks, 2u);
  EXPECT_EQ(leaks[0].bytes, 18u + 14u);  // of the two texts
  EXPECT_THAT(to_string(leaks[0]), HasSubstr("keep"));
}

// The answer to the healthy command, of 4 bytes, is the same under any fill.
TEST(DefectTest, UninitialisedReadShowsUnderAnotherFill) {
  if (!heap_simulation_available()) GTEST_SKIP() << "a sanitizer owns malloc";
  FormationOptions options = flown("defect_uninitialised_read");
  options.flight.heap.fill = true;
  options.flight.heap.seed = 1;
  const std::vector<std::uint32_t> first = telemetry(options);
  EXPECT_EQ(telemetry(options), first);
  options.flight.heap.seed = 2;
  const std::vector<std::uint32_t> second = telemetry(options);
  ASSERT_EQ(first.size(), 2u);
  ASSERT_EQ(second.size(), 2u);
  EXPECT_EQ(first[0], 4u);
  EXPECT_EQ(second[0], 4u);
  EXPECT_NE(first[1], second[1]);
}

// Property: crashes are ordinary events. A random spacecraft crashes every 2 to 6 minutes for 12
// hours; each boots again after 2 s, hears everything that is sent after that, and nothing of it
// stays in the test program. Bound: 1 MB for the 150 or so crashes after the first hour.
TEST(DefectTest, AMissionOfRandomCrashesEndsWithoutLoss) {
  FormationWorld world(flown("defect_null_dereference"));
  std::map<std::string, std::uint64_t> crashes, heard, answered;
  for (const char* name : {"chief", "deputy"}) {
    world.flight(name).reboot_after(2s);
    world.flight(name).on_output("telemetry",
                                 [&answered, name](SimTime, Bytes) { ++answered[name]; });
  }
  std::mt19937_64 random(flags().seed);
  const auto command = [&](const std::string& to, Duration t, std::string_view text) {
    world.ground().command(to, at(t), std::as_bytes(std::span(text)));
    ++heard[to];
  };
  std::uint64_t rounds = 0;
  for (Duration t = 2min; t < 12h; t += std::chrono::seconds(120 + random() % 241), ++rounds) {
    const std::string unlucky = random() % 2 == 0 ? "chief" : "deputy";
    command(unlucky, t, "x");
    ++crashes[unlucky];
    for (const char* name : {"chief", "deputy"}) command(name, t + 30s, "ping");
  }
  world.run_for(1h);
  const std::int64_t before = resident_bytes();
  world.run_for(11h + 1min);
  if (heap_simulation_available()) {
    EXPECT_LT(resident_bytes() - before, 1'000'000);
  }
  EXPECT_GT(rounds, 120u);
  for (const std::string name : {"chief", "deputy"}) {
    const FlightHandle flight = world.flight(name);
    EXPECT_TRUE(flight.alive());
    EXPECT_GT(crashes[name], 40u);
    EXPECT_EQ(flight.crashes(), crashes[name]);
    EXPECT_EQ(flight.boots(), crashes[name] + 1);
    EXPECT_EQ(flight.calls(), flight.boots() + heard[name]);
    EXPECT_EQ(flight.inputs_lost(), 0u);
    EXPECT_EQ(answered[name], rounds);
  }
}
