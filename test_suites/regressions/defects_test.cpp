// Property: each defect of flight_sw/defects ends its process, where it is, under its name; the
// other spacecraft and the run go on.
#include <orrery/harness/flight/flight_stack.hpp>
#include <orrery/harness/heap/interposition.hpp>
#include <orrery/orrery.hpp>

#include <csignal>
#include <cstring>
#include <string>
#include <string_view>

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
