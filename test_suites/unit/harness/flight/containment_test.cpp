// Property: whatever flight code does wrong ends its process, and nothing else.

#include <orrery/harness/flight/flight_process.hpp>
#include <orrery/harness/flight/flight_stack.hpp>
#include <orrery/harness/flight/floating_point.hpp>
#include <orrery/harness/heap/simulated_heap.hpp>
#include <orrery/harness/kernel/sanitizers.hpp>
#include <orrery/harness/kernel/sim_state.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <cstdint>
#include <cstring>
#include <exception>
#include <memory>
#include <stdexcept>
#include <string>

#include "orders.hpp"

namespace orrery {
namespace {

using testing::HasSubstr;

constexpr SimTime kTruth = from_ns(1'000'000'000'000);

FlightProcessOptions options(const std::string& library = "flight_test_subject") {
  return {.spacecraft = "dsc", .library = library};
}

std::unique_ptr<FlightProcess> created(const FlightProcessOptions& o) {
  auto process = std::make_unique<FlightProcess>(o);
  EXPECT_EQ(process->create(kTruth, 5), CallOutcome::kDone);
  return process;
}

CallOutcome tell(FlightProcess& process, const ByteBuffer& message) {
  return process.input(kTruth, 7, process.ports().at(0), message);
}

// Whatever happened, the simulator goes on as before.
void expect_simulator_unharmed() {
  EXPECT_EQ(current_heap, nullptr);
  EXPECT_STREQ(sim_process, "");
  EXPECT_EQ(std::current_exception(), nullptr);
  EXPECT_EQ(std::uncaught_exceptions(), 0);
  sigset_t mask;
  pthread_sigmask(SIG_SETMASK, nullptr, &mask);
  for (const int signal : {SIGSEGV, SIGABRT, SIGFPE}) EXPECT_EQ(sigismember(&mask, signal), 0);
  // The next process flies.
  const auto next = created(options());
  EXPECT_EQ(tell(*next, order("ealive")), CallOutcome::kDone);
  EXPECT_EQ(text_of(next->output(0).data), "alive");
}

struct Fault {
  const char* name;
  const char* order;
  CrashKind kind;
  int signal;
  const char* message;
  const char* function;  // on the stack
  bool needs_heap = false;
};
void PrintTo(const Fault& fault, std::ostream* out) {
  *out << fault.name;
}

class FlightCrashTest : public testing::TestWithParam<Fault> {};

TEST_P(FlightCrashTest, EndsTheProcessAndNothingElse) {
  const Fault& fault = GetParam();
  if (fault.needs_heap && !heap_simulation_available()) {
    GTEST_SKIP() << "a sanitizer owns malloc";
  }
  const auto process = created(options());
  EXPECT_EQ(tell(*process, order(fault.order)), CallOutcome::kCrashed);
  EXPECT_FALSE(process->alive());
  const CrashReport& crash = process->crash();
  EXPECT_EQ(crash.kind, fault.kind);
  EXPECT_EQ(crash.signal, fault.signal);
  EXPECT_THAT(crash.message, HasSubstr(fault.message));
  EXPECT_EQ(crash.spacecraft, "dsc");
  EXPECT_EQ(crash.process, "gnc");
  EXPECT_EQ(crash.library, "flight_test_subject");
  EXPECT_EQ(crash.t, kTruth);
  EXPECT_EQ(crash.onboard_ns, 7);
  EXPECT_EQ(crash.call, "input");
  EXPECT_EQ(crash.port, "do");
  EXPECT_EQ(text_of(crash.input), fault.order);
  if (std::string(fault.function) != "") {
    EXPECT_THAT(crash.backtrace,
                testing::Contains(testing::Field(&StackFrame::function, HasSubstr(fault.function))))
        << to_string(crash);
  }
  // Outputs and tick of the call are discarded, its logs kept.
  EXPECT_EQ(process->output_count(), 0u);
  EXPECT_FALSE(process->tick_request().has_value());
  ASSERT_EQ(process->log_count(), 1u);
  EXPECT_EQ(process->log_line(0).text, "going down");
  expect_simulator_unharmed();
}

INSTANTIATE_TEST_SUITE_P(
    Kinds, FlightCrashTest,
    testing::Values(
        Fault{"NullPointer", "!s", CrashKind::kSignal, SIGSEGV, "at address (nil)", "fault"},
        Fault{"DivisionByZero", "!f", CrashKind::kSignal, SIGFPE, "loating point exception",
              "fault"},
        Fault{"IllegalInstruction", "!i", CrashKind::kSignal, SIGILL, "llegal instruction",
              "fault"},
        Fault{"PageBehindItsFile", "!b", CrashKind::kSignal, SIGBUS, "us error at address",
              "fault"},
        Fault{"StackOverflow", "!o", CrashKind::kStackOverflow, SIGSEGV, "is used up: Segmentation",
              "overflow"},
        Fault{"Raise", "!r", CrashKind::kSignal, SIGSEGV, "raised", "fault"},
        Fault{"Abort", "!a", CrashKind::kAbort, SIGABRT, "Aborted", "fault"},
        Fault{"Assert", "!v", CrashKind::kAbort, SIGABRT, "Aborted", "fault"},
        Fault{"BadPointerToOutput", "!p", CrashKind::kSignal, SIGSEGV, "at address (nil)", "fault"},
        Fault{"Exit", "!x", CrashKind::kExit, 0, "exit(3) called", "fault", true},
        Fault{"DoubleFree", "!d", CrashKind::kHeapFault, 0, "double free 0x2000", "fault", true},
        Fault{"FreeOfAStackAddress", "!g", CrashKind::kAbort, SIGABRT, "Aborted", "fault", true},
        Fault{"OverwrittenHeader", "!c", CrashKind::kHeapFault, 0, "overwritten block", "fault",
              true}),
    [](const auto& fault) { return std::string(fault.param.name); });

// 3 frames of 4 kB and what is around them; the figure is that of the deepest call.
TEST(ContainmentTest, StackHighWaterIsThatOfTheDeepestCall) {
  if (!internal::FlightStack::available()) GTEST_SKIP() << "calls run on the caller's stack";
  FlightProcessOptions o = options();
  o.stack_bytes = 128 * 1024;
  const auto process = created(o);
  tell(*process, order("eping"));
  const std::uint64_t shallow = process->stack_high_water_bytes();
  EXPECT_GT(shallow, 0u);
  EXPECT_LT(shallow, 16'000u);
  EXPECT_EQ(tell(*process, order("!o")), CallOutcome::kCrashed);
  EXPECT_THAT(process->crash().message, HasSubstr("the stack of 131072 bytes"));
  EXPECT_GT(process->stack_high_water_bytes(), 131'072u - 3 * 4096u);
  EXPECT_LE(process->stack_high_water_bytes(), 131'072u);
}

TEST(ContainmentTest, StacksOutsideTheirRangeAreRefused) {
  for (const std::uint64_t bytes : {0u, 65'535u, 33'554'433u}) {
    FlightProcessOptions o = options();
    o.stack_bytes = bytes;
    EXPECT_THROW(FlightProcess process(o), std::invalid_argument) << bytes;
  }
}

TEST(ContainmentTest, EndlessLoopRunsIntoTheLimitOfHostTime) {
  FlightProcessOptions o = options();
  o.host_time_limit = 200ms;
  const auto process = created(o);
  EXPECT_EQ(tell(*process, order("!l")), CallOutcome::kCrashed);
  EXPECT_EQ(process->crash().kind, CrashKind::kTimeout);
  EXPECT_THAT(process->crash().message, HasSubstr("more than 0.200 s of CPU time"));
  EXPECT_THAT(process->crash().backtrace,
              testing::Contains(testing::Field(&StackFrame::function, HasSubstr("fault"))));
  expect_simulator_unharmed();
}

// A turn of the loop is a fixed number of edges: so the count is linear, and repeats exactly.
TEST(WorkTest, IsCountedExactlyAndLinearInWhatIsDone) {
  const auto process = created(options("flight_test_worker"));
  ASSERT_TRUE(process->counts_work());
  const auto work_of = [&process](std::uint32_t turns) {
    ByteBuffer message(4);
    std::memcpy(message.data(), &turns, 4);
    EXPECT_EQ(tell(*process, message), CallOutcome::kDone);
    return process->work();
  };
  const std::uint64_t none = work_of(0), ten = work_of(10), million = work_of(1'000'000);
  EXPECT_GT(ten, none);
  EXPECT_EQ((ten - none) % 10, 0u);
  EXPECT_EQ(million - none, (ten - none) * 100'000);
  EXPECT_EQ(work_of(1'000'000), million);
  EXPECT_FALSE(created(options())->counts_work());
}

TEST(WorkTest, BudgetEndsAnEndlessLoopAtTheSameEdgeEveryTime) {
  FlightProcessOptions o = options("flight_test_worker");
  o.work_budget = 1'000'000;
  std::vector<std::string> first;
  for (int i = 0; i < 3; ++i) {
    const auto process = created(o);
    EXPECT_EQ(tell(*process, ByteBuffer(4, std::byte{0xff})), CallOutcome::kCrashed);
    EXPECT_EQ(process->crash().kind, CrashKind::kWorkBudget);
    EXPECT_EQ(process->crash().work, 1'000'000u);
    EXPECT_THAT(process->crash().backtrace,
                testing::Contains(testing::Field(&StackFrame::function, HasSubstr("input"))));
    std::vector<std::string> functions;
    for (const StackFrame& frame : process->crash().backtrace) functions.push_back(frame.function);
    if (i > 0) {
      EXPECT_EQ(functions, first);
    }
    first = functions;
  }
  expect_simulator_unharmed();
}

TEST(WorkTest, BudgetNeedsALibraryThatCounts) {
  FlightProcessOptions o = options();
  o.work_budget = 1;
  try {
    FlightProcess process(o);
    ADD_FAILURE() << "no exception";
  } catch (const std::invalid_argument& error) {
    EXPECT_THAT(error.what(), HasSubstr("COUNT_WORK"));
  }
}

TEST(ContainmentTest, StatusesThatEndAProcessAreCrashes) {
  for (const auto& [status, kind] :
       {std::pair{-100, CrashKind::kFatalStatus}, std::pair{77, CrashKind::kUnknownStatus},
        std::pair{-3, CrashKind::kUnknownStatus}}) {
    const auto process = created(options());
    EXPECT_EQ(tell(*process, return_status(status)), CallOutcome::kCrashed);
    EXPECT_EQ(process->crash().kind, kind);
    EXPECT_EQ(process->crash().status, status);
    EXPECT_THAT(process->crash().message, HasSubstr(std::to_string(status)));
    EXPECT_TRUE(process->crash().backtrace.empty());
  }
}

TEST(ContainmentTest, CreateThatFailsIsABootFailure) {
  FlightProcessOptions o = options();
  o.config = "refuse";
  FlightProcess process(o);
  EXPECT_EQ(process.create(kTruth, 0), CallOutcome::kCrashed);
  EXPECT_EQ(process.crash().kind, CrashKind::kBootFailure);
  EXPECT_EQ(process.crash().call, "create");
  EXPECT_FALSE(process.alive());
}

TEST(ContainmentTest, UncaughtExceptionIsReportedWithTypeAndText) {
  const auto process = created(options("flight_test_statics"));
  EXPECT_EQ(tell(*process, order("x")), CallOutcome::kCrashed);
  EXPECT_EQ(process->crash().kind, CrashKind::kException);
  EXPECT_EQ(process->crash().message, "uncaught statics::OfItsOwn: nobody catches this");
  expect_simulator_unharmed();
}

TEST(ContainmentTest, CrashWithinACatchBlockLeavesNoExceptionBehind) {
  const auto process = created(options("flight_test_statics"));
  EXPECT_EQ(tell(*process, order("c")), CallOutcome::kCrashed);
  expect_simulator_unharmed();
}

TEST(ContainmentTest, PastTheLimitTheProcessCrashesIfAsked) {
  if (!heap_simulation_available()) GTEST_SKIP() << "a sanitizer owns malloc";
  FlightProcessOptions o = options();
  o.heap_bytes = 1024;
  o.heap_exhaustion = HeapExhaustion::kCrash;
  const auto process = created(o);
  EXPECT_EQ(tell(*process, allocate(1000)), CallOutcome::kDone);
  EXPECT_EQ(tell(*process, allocate(20)), CallOutcome::kCrashed);
  EXPECT_EQ(process->crash().kind, CrashKind::kHeapExhausted);
  EXPECT_EQ(process->crash().message,
            "malloc of 32 bytes would pass the heap's limit of 1024");  // 20 + 8, rounded up
  expect_simulator_unharmed();
}

TEST(ContainmentTest, MemoryOfADeadProcessIsGone) {
  if (!heap_simulation_available()) GTEST_SKIP() << "a sanitizer owns malloc";
  const auto process = created(options());
  tell(*process, allocate(100'000));
  tell(*process, order("!s"));
  // Its figures stay, for the report: 100,000 + 8 -> 100,016; the crashing call's 40 + 8 -> 48.
  EXPECT_EQ(process->heap().resting_bytes, 100'016u + 48u);
}

TEST(ContainmentTest, ManyCrashesLeaveTheNextAndTheSimulatorFlying) {
#ifdef ORRERY_ADDRESS_SANITIZER
  constexpr int kCrashes = 200;  // 24 ms each
#else
  constexpr int kCrashes = 1000;
#endif
  for (int i = 0; i < kCrashes; ++i) {
    FlightProcess process(options());
    process.create(kTruth, 0);
    ASSERT_EQ(tell(process, order(i % 2 == 0 ? "!s" : "!a")), CallOutcome::kCrashed);
  }
  expect_simulator_unharmed();
}

TEST(ContainmentTest, FloatingPointControlIsTheSimulatorsAgainAfterEveryCall) {
  const auto before = internal::FloatingPointControl::read();
  FlightProcess process(options("flight_test_fast_math"));
  EXPECT_EQ(internal::FloatingPointControl::read(), before);
  process.create(kTruth, 0);
  for (int i = 0; i < 2; ++i) {
    EXPECT_EQ(tell(process, {}), CallOutcome::kDone);
    EXPECT_EQ(text_of(process.output(0).data), "\1");  // the denormal survived
    EXPECT_EQ(internal::FloatingPointControl::read(), before);
  }
}

TEST(ContainmentTest, ChangedFloatingPointControlIsReportedOnce) {
  FlightProcess process(options("flight_test_fast_math"));
  process.create(kTruth, 0);
  std::size_t lines = process.log_count();
  for (int i = 0; i < 3; ++i) {
    tell(process, {});
    lines += process.log_count();
  }
  EXPECT_EQ(lines, 1u);
}

using ContainmentDeathTest = testing::Test;

TEST(ContainmentDeathTest, FaultsOfTheSimulatorAreNotContained) {
  const auto process = created(options());
  EXPECT_DEATH(*static_cast<volatile int*>(nullptr) = 1, "");
  EXPECT_DEATH(std::abort(), "");
}

TEST(ContainmentDeathTest, SimulatorThatFreesABlockTwiceEndsTheProgram) {
  if (!heap_simulation_available()) GTEST_SKIP() << "a sanitizer owns malloc";
  const auto process = created(options());
  tell(*process, allocate(100));
  void* volatile inside = reinterpret_cast<void*>(Arena::kBase + 32);
  EXPECT_DEATH(std::free(inside), "heap of dsc/gnc, outside of its calls: pointer into a block");
}

TEST(CrashReportTest, PrintsWhatIsKnown) {
  const auto process = created(options());
  tell(*process, order("!s"));
  EXPECT_THAT(to_string(process->crash()),
              testing::AllOf(HasSubstr("dsc/gnc (flight_test_subject) crashed in input on port do"),
                             HasSubstr("Segmentation fault"), HasSubstr("input, 2 bytes: 21 73"),
                             HasSubstr("fault")));
}

// What a call finds on the stack of what the last one left: the byte at that depth.
struct Peek {
  volatile unsigned char found = 0;
  bool writes = false;
};
void peek(void* to) {
  volatile unsigned char local[4096];
  volatile unsigned char* unwritten = local;
  asm volatile("" : "+r"(unwritten) : : "memory");  // the compiler is not to see what this reads
  auto* p = static_cast<Peek*>(to);
  p->found = unwritten[2000];
  for (int i = 0; i < 4096 && p->writes; ++i) unwritten[i] = 0x5a;
}

TEST(FlightStackTest, WhatCallsHaveLeftBecomesOtherBytesAndNoMore) {
  if (!internal::FlightStack::available()) GTEST_SKIP() << "calls run on the caller's stack";
  const auto found_after = [](std::uint64_t seed) {
    internal::FlightStack stack(internal::FlightStack::kLeast_bytes);
    stack.overwrite_used(seed);  // nothing was used
    EXPECT_EQ(stack.high_water_bytes(), 0u);
    Peek first{.writes = true}, second;
    stack.call(peek, &first);
    EXPECT_EQ(first.found, 0);
    const std::uint64_t used = stack.high_water_bytes();
    EXPECT_GT(used, 4000u);
    if (seed != 0) stack.overwrite_used(seed);
    EXPECT_LE(stack.high_water_bytes(), used);
    EXPECT_GT(stack.high_water_bytes(), used - 16);
    stack.call(peek, &second);
    return static_cast<int>(second.found);
  };
  EXPECT_EQ(found_after(0), 0x5a);
  EXPECT_NE(found_after(1), 0x5a);
  EXPECT_NE(found_after(1), found_after(2));  // drawn: one in 256 seeds would be the same
}

}  // namespace
}  // namespace orrery
