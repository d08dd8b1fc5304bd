#include <orrery/harness/flight/flight_process.hpp>
#include <orrery/harness/kernel/sim_state.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "orders.hpp"

namespace orrery {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

constexpr SimTime kTruth = from_ns(1'000'000'000'000);

class FlightProcessTest : public testing::Test {
 protected:
  static FlightProcessOptions options(const std::string& library = "flight_test_subject") {
    return {.spacecraft = "dsc", .library = library};
  }
  static std::unique_ptr<FlightProcess> created(const FlightProcessOptions& o) {
    auto process = std::make_unique<FlightProcess>(o);
    EXPECT_EQ(process->create(kTruth, 5), CallOutcome::kDone);
    return process;
  }
  static CallOutcome tell(FlightProcess& process, const ByteBuffer& message) {
    return process.input(kTruth, 7, process.ports().at(0), message);
  }
  static std::vector<std::string> said(const FlightProcess& process) {
    std::vector<std::string> result;
    for (std::size_t i = 0; i < process.output_count(); ++i) {
      result.push_back(text_of(process.output(i).data));
    }
    return result;
  }
};

TEST_F(FlightProcessTest, PortTableIsRead) {
  const FlightProcess process(options());
  ASSERT_EQ(process.ports().size(), 4u);
  const FlightPort& bits = process.ports()[1];
  EXPECT_EQ(bits.name, "bits");
  EXPECT_EQ(bits.direction, PortDirection::kIn);
  EXPECT_EQ(bits.kind, PortKind::kStream);
  EXPECT_EQ(bits.id, 2u);
  EXPECT_EQ(bits.max_bytes, 8u);
  EXPECT_EQ(process.ports()[2].direction, PortDirection::kOut);
  EXPECT_TRUE(process.has_tick());
}

TEST_F(FlightProcessTest, BootRecordArrives) {
  FlightProcessOptions o = options();
  o.config = "say this";
  FlightProcess process(o);
  EXPECT_EQ(process.create(kTruth, 123, 4, ResetCause::kWatchdog), CallOutcome::kDone);
  ASSERT_EQ(process.output_count(), 5u);
  EXPECT_EQ(text_of(process.output(0).data), std::string("\4\0\0\0\2\0\0\0", 8));
  EXPECT_EQ(text_of(process.output(1).data), "dsc");
  EXPECT_EQ(text_of(process.output(2).data), "gnc");
  EXPECT_EQ(text_of(process.output(3).data), "say this");
  EXPECT_EQ(process.output(4).port->name, "times");
  EXPECT_EQ(time_of(process.output(4).data), 123);
}

TEST_F(FlightProcessTest, OutputsKeepTheirOrderAndEndWithTheNextCall) {
  const auto process = created(options());
  EXPECT_EQ(tell(*process, order("efirst")), CallOutcome::kDone);
  EXPECT_THAT(said(*process), ElementsAre("first"));
  EXPECT_EQ(tell(*process, order("e")), CallOutcome::kDone);
  EXPECT_THAT(said(*process), ElementsAre(""));
  EXPECT_EQ(tell(*process, order("n")), CallOutcome::kDone);
  EXPECT_EQ(time_of(process->output(0).data), 7);  // onboard time, not truth
}

TEST_F(FlightProcessTest, UnknownPortsAndTooLongOutputsComeBackAsStatus) {
  const auto process = created(options());
  EXPECT_EQ(tell(*process, order("u")), CallOutcome::kDone);
  EXPECT_THAT(said(*process), ElementsAre("\xFF\xFE"));  // ORRERY_NOT_FOUND, ORRERY_TOO_SMALL
}

TEST_F(FlightProcessTest, StatusesAreJudgedAsTheAbiSays) {
  const auto process = created(options());
  EXPECT_EQ(tell(*process, return_status(0)), CallOutcome::kDone);
  EXPECT_EQ(tell(*process, return_status(1)), CallOutcome::kRejected);
  EXPECT_EQ(tell(*process, return_status(-1)), CallOutcome::kRejected);
  EXPECT_EQ(tell(*process, order("")), CallOutcome::kRejected);
  EXPECT_TRUE(process->alive());
}

TEST_F(FlightProcessTest, TickRequestIsTheLastOneOfTheCall) {
  const auto process = created(options());
  EXPECT_FALSE(process->tick_request().has_value());
  tell(*process, request_tick(99));
  EXPECT_EQ(process->tick_request(), 99);
  tell(*process, order('Q', std::int64_t{-5}));
  EXPECT_EQ(process->tick_request(), -5);
  tell(*process, order("n"));
  EXPECT_FALSE(process->tick_request().has_value());
}

TEST_F(FlightProcessTest, LogLinesArriveWithTheirLevel) {
  const auto process = created(options());
  tell(*process, order(std::string("lbattery low\0", 13)));
  ASSERT_EQ(process->log_count(), 1u);
  EXPECT_EQ(process->log_line(0).level, LogLevel::kWarning);
  EXPECT_EQ(process->log_line(0).text, "battery low");
}

TEST_F(FlightProcessTest, StorageOutlivesTheProcess) {
  FlightProcessOptions o = options();
  o.storage_bytes = 8;
  std::shared_ptr<NonVolatileMemory> memory;
  {
    const auto process = created(o);
    EXPECT_EQ(tell(*process, order("y\1")), CallOutcome::kRejected);  // no such slot
    EXPECT_EQ(tell(*process, order("w\1abc")), CallOutcome::kDone);
    EXPECT_EQ(tell(*process, order("w\2defg")), CallOutcome::kDone);
    EXPECT_EQ(tell(*process, order("w\1123456")), CallOutcome::kRejected);  // 10 of 8 bytes
    EXPECT_EQ(tell(*process, order("w\1xyz")), CallOutcome::kDone);         // replaces 3 by 3
    tell(*process, order("!s"));
    EXPECT_FALSE(process->alive());
    memory = process->memory();
  }
  FlightProcess next(o, memory);
  next.create(kTruth, 0, 1, ResetCause::kCrash);
  tell(next, order("y\1"));
  EXPECT_THAT(said(next), ElementsAre("xyz"));
  tell(next, order("y\2"));
  EXPECT_THAT(said(next), ElementsAre("defg"));
}

// malloc(n) takes 8 + n rounded up to 16 (alignment 16) or 8 (alignment 8); see block_heap.hpp.
TEST_F(FlightProcessTest, HeapFiguresAreExactToTheByte) {
  if (!heap_simulation_available()) GTEST_SKIP() << "a sanitizer owns malloc";
  for (const int alignment : {8, 16}) {
    FlightProcessOptions o = options();
    o.heap_alignment = alignment;
    const auto process = created(o);
    EXPECT_EQ(process->heap().heap_bytes, 0u);
    const auto block = [&](std::uint64_t n) {
      const auto a = static_cast<std::uint64_t>(alignment);
      return (n + 8 + a - 1) / a * a;
    };
    tell(*process, allocate(1000));
    EXPECT_EQ(process->call_record().resting_bytes, block(1000));
    EXPECT_EQ(process->call_record().transient_peak_bytes, block(1000));
    EXPECT_EQ(process->call_record().allocations, 1u);
    tell(*process, allocate_briefly(500));
    EXPECT_EQ(process->call_record().resting_bytes, block(1000));
    EXPECT_EQ(process->call_record().transient_peak_bytes, block(1000) + block(500));
    EXPECT_EQ(process->call_record().largest_free_bytes, block(500));
    tell(*process, allocate(100));
    EXPECT_EQ(process->call_record().transient_peak_bytes, block(1000) + block(100));
    EXPECT_EQ(process->call_record().heap_bytes, block(1000) + block(500));
    EXPECT_EQ(process->call_record().largest_free_bytes, block(500) - block(100));
    tell(*process, order("z"));
    tell(*process, order("z"));
    EXPECT_EQ(process->call_record().resting_bytes, 0u);
    EXPECT_EQ(process->heap().high_water_bytes, block(1000) + block(500));
    EXPECT_EQ(process->heap().live_blocks, 0u);
  }
}

TEST_F(FlightProcessTest, HostCallbacksTakeNothingFromTheHeap) {
  if (!heap_simulation_available()) GTEST_SKIP() << "a sanitizer owns malloc";
  const auto process = created(options());
  tell(*process, order("ea line that is long enough to need memory of the host's"));
  tell(*process, order("la line that is long enough to need memory of the host's"));
  tell(*process, order("w\1a record that is long enough to need memory"));
  EXPECT_EQ(process->heap().allocations, 0u);
}

TEST_F(FlightProcessTest, PastTheLimitMallocReturnsNull) {
  if (!heap_simulation_available()) GTEST_SKIP() << "a sanitizer owns malloc";
  FlightProcessOptions o = options();
  o.heap_bytes = 1024;
  const auto process = created(o);
  tell(*process, allocate(1000));
  tell(*process, allocate(1000));
  EXPECT_THAT(said(*process), ElementsAre("null"));
  EXPECT_TRUE(process->alive());
  process->set_heap_limit(4096);
  tell(*process, allocate(1000));
  EXPECT_THAT(said(*process), ElementsAre());
  EXPECT_EQ(process->heap().limit_bytes, 4096u);
  EXPECT_THROW(process->set_heap_limit(std::uint64_t{1} << 32), std::invalid_argument);
}

// Under a sanitizer: requested bytes, no tags; and a cap that can only end the process.
TEST_F(FlightProcessTest, WhatASanitizerAllocatesIsAccountedFor) {
  if (!heap_accounting_available()) GTEST_SKIP() << "heaps are simulated";
  FlightProcessOptions o = options();
  o.heap_bytes = 8192;
  const auto process = created(o);
  const std::uint64_t before = process->heap().resting_bytes;
  tell(*process, allocate(1000));
  EXPECT_EQ(process->call_record().resting_bytes, before + 1000);
  tell(*process, allocate_briefly(500));
  EXPECT_EQ(process->call_record().resting_bytes, before + 1000);
  EXPECT_EQ(process->call_record().transient_peak_bytes, before + 1500);
  tell(*process, order("z"));
  EXPECT_EQ(process->heap().resting_bytes, before);
  EXPECT_EQ(process->heap().high_water_bytes, before + 1500);
  EXPECT_EQ(tell(*process, allocate(9000)), CallOutcome::kCrashed);
  EXPECT_EQ(process->crash().kind, CrashKind::kHeapExhausted);
  EXPECT_THAT(process->crash().message, HasSubstr("malloc of 9000 bytes would pass"));
}

TEST_F(FlightProcessTest, CopiesHaveGlobalsOfTheirOwn) {
  FlightProcessOptions a = options("flight_test_statics"), b = a;
  b.spacecraft = "osc";
  const auto first = created(a), second = created(b);
  // Inline variable, static of an inline function, static member of a template; a table with an
  // entry from its constructor.
  for (const char* expected : {"\1\1\1\1", "\2\2\2\2", "\3\3\3\3"}) {
    tell(*first, order("+"));
    EXPECT_THAT(said(*first), ElementsAre(expected));
  }
  tell(*second, order("+"));
  EXPECT_THAT(said(*second), ElementsAre("\1\1\1\1"));
}

TEST_F(FlightProcessTest, SymbolsMadePrivateAreNamed) {
  const FlightProcess process(options("flight_test_statics"));
#ifdef __clang__
  EXPECT_THAT(process.edited_symbols(), testing::IsEmpty());  // clang never emits STB_GNU_UNIQUE
#else
  EXPECT_THAT(process.edited_symbols(), testing::Contains("statics::inline_variable"));
#endif
}

TEST_F(FlightProcessTest, NextInstanceStartsAfresh) {
  for (int i = 0; i < 3; ++i) {
    const auto process = created(options("flight_test_statics"));
    tell(*process, order("+"));
    EXPECT_THAT(said(*process), ElementsAre("\1\1\1\1"));
  }
}

TEST_F(FlightProcessTest, SharedInstancesShareGlobalsAndHaveHeapsOfTheirOwn) {
  FlightProcessOptions a = options(), b = a;
  a.isolation = b.isolation = Isolation::kShared;
  b.spacecraft = "osc";
  const auto first = created(a), second = created(b);
  tell(*first, allocate(100));
  tell(*second, allocate(200));
  if (heap_simulation_available()) {
    EXPECT_EQ(first->heap().payload_bytes, 104u);
    EXPECT_EQ(second->heap().payload_bytes, 200u);
  }
  tell(*first, order("z"));  // the newest of the one table: the second's
  if (heap_simulation_available()) {
    EXPECT_EQ(second->heap().payload_bytes, 0u);
  }
}

TEST_F(FlightProcessTest, ShutDownCallsDestroyWhichMayOnlyLog) {
  const auto process = created(options());
  tell(*process, allocate(100));
  EXPECT_EQ(process->shut_down(kTruth, 0), CallOutcome::kDone);
  EXPECT_EQ(process->output_count(), 0u);
  ASSERT_EQ(process->log_count(), 1u);
  EXPECT_EQ(process->log_line(0).text, "destroyed");
  EXPECT_FALSE(process->alive());
  EXPECT_EQ(process->heap().live_blocks, 0u);
}

TEST_F(FlightProcessTest, StaticDestructorsLeaveNothingBehind) {
  const auto process = created(options("flight_test_statics"));
  tell(*process, order("+"));
  EXPECT_EQ(process->shut_down(kTruth, 0), CallOutcome::kDone);
  // Under a sanitizer the C library runs them, and not before the library is unloaded.
  if (heap_accounting_available()) return;
  EXPECT_EQ(process->heap().live_blocks, 0u);  // what static constructors made included
}

TEST_F(FlightProcessTest, CallsOutOfTurnAreTheCallersMistake) {
  FlightProcess process(options());
  EXPECT_THROW(process.tick(kTruth, 0), std::logic_error);
  process.create(kTruth, 0);
  EXPECT_THROW(process.create(kTruth, 0), std::logic_error);
  process.shut_down(kTruth, 0);
  EXPECT_THROW(process.tick(kTruth, 0), std::logic_error);
  EXPECT_THROW(process.shut_down(kTruth, 0), std::logic_error);
}

TEST_F(FlightProcessTest, HeapOptionsOutsideTheirRangesAreRefused) {
  FlightProcessOptions o = options();
  o.heap_alignment = 32;
  EXPECT_THROW(FlightProcess{o}, std::invalid_argument);
  o = options();
  o.heap_bytes = std::uint64_t{1} << 32;
  EXPECT_THROW(FlightProcess{o}, std::invalid_argument);
}

TEST_F(FlightProcessTest, HostTimeIsCounted) {
  const auto process = created(options());
  const Duration before = process->host_time_in_flight();
  for (int i = 0; i < 1000; ++i) tell(*process, allocate_briefly(100));
  EXPECT_GT(process->host_time_in_flight(), before);
  EXPECT_LT(process->host_time_in_flight(), 10s);
}

}  // namespace
}  // namespace orrery
