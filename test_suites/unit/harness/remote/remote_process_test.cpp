// A flight process on a target: the same answers as from the same library in this program, and what
// breaks there ends that process alone.

#include <orrery/harness/flight/flight_library.hpp>
#include <orrery/harness/flight/flight_process.hpp>

#include <gmock/gmock.h>

#include <cstdlib>
#include <string>
#include <vector>

#include "../flight/orders.hpp"

namespace orrery {
namespace {

using testing::AllOf;
using testing::HasSubstr;

FlightProcessOptions here() {
  return {.spacecraft = "dsc", .library = "flight_test_subject", .config = "say"};
}
FlightProcessOptions there() {
  FlightProcessOptions options = here();
  options.target = parse_target_address("exec:" TARGET_PROGRAM " " SUBJECT_LIBRARY);
  return options;
}

// All that can be seen of a process from outside, call by call.
std::string told(const FlightProcess& process, CallOutcome outcome) {
  std::string text = std::to_string(static_cast<int>(outcome));
  for (std::size_t i = 0; i < process.output_count(); ++i) {
    const FlightProcess::Output output = process.output(i);
    text += " " + output.port->name + "=" + text_of(output.data);
  }
  for (std::size_t i = 0; i < process.log_count(); ++i) {
    text += " log=" + std::string(process.log_line(i).text);
  }
  if (process.tick_request()) text += " tick=" + std::to_string(*process.tick_request());
  return text + "\n";
}

std::string flown(FlightProcess& process) {
  std::string text = told(process, process.create(SimTime{}, 5, 2, ResetCause::kWatchdog));
  const FlightPort& port = process.ports().front();
  const std::vector<ByteBuffer> orders = {
      order("ehello"),  order("e"),       order("n"),          request_tick(700), order("e"),
      order("w\4four"), order("y\4"),     order("y\5"),        order("u"),        order(""),
      order("unknown"), return_status(1), order("lcareful\0x")};
  for (const ByteBuffer& input : orders) {
    text += told(process, process.input(SimTime{}, 10, port, input));
  }
  text += told(process, process.tick(SimTime{}, 700));
  return text;
}

TEST(RemoteProcess, AnswersAsTheLibraryDoesInThisProgram) {
  FlightProcess near(here()), far(there());
  ASSERT_EQ(near.ports().size(), far.ports().size());
  const std::string expected = flown(near);
  EXPECT_THAT(expected, HasSubstr("say=hello"));
  EXPECT_EQ(flown(far), expected);
  EXPECT_EQ(far.memory()->slots(), near.memory()->slots());
}

TEST(RemoteProcess, StorageOutlivesAReboot) {
  FlightProcess first(there());
  first.create(SimTime{}, 0);
  first.input(SimTime{}, 1, first.ports().front(), order("w\4kept"));
  first.cut_off();
  FlightProcess second(there(), first.memory());
  second.create(SimTime{}, 2, 1, ResetCause::kCommanded);
  second.input(SimTime{}, 3, second.ports().front(), order("y\4"));
  ASSERT_EQ(second.output_count(), 1u);
  EXPECT_EQ(text_of(second.output(0).data), "kept");
}

TEST(RemoteProcess, ACrashThereEndsThatProcessByName) {
  FlightProcess process(there());
  process.create(SimTime{}, 0);
  EXPECT_EQ(process.input(from_ns(7), 1, process.ports().front(), order("!a")),
            CallOutcome::kCrashed);
  EXPECT_FALSE(process.alive());
  EXPECT_EQ(process.crash().kind, CrashKind::kTargetLost);
  EXPECT_THAT(process.crash().message,
              AllOf(HasSubstr("the link to its processor broke"), HasSubstr("ended by signal 6")));
  EXPECT_EQ(process.crash().port, "do");
  EXPECT_EQ(process.output_count(), 0u);  // what had not left is lost
}

TEST(RemoteProcess, WhatCannotBeReachedIsRefusedByName) {
  FlightProcessOptions options = here();
  options.target = parse_target_address("unix:/nowhere");
  options.target_patience = std::chrono::milliseconds(50);
  try {
    FlightProcess process(options);
    FAIL() << "it was reached";
  } catch (const std::invalid_argument& error) {
    EXPECT_THAT(error.what(), AllOf(HasSubstr("dsc/gnc"), HasSubstr("unix:/nowhere")));
  }
}

TEST(RemoteProcess, AFunctionOfThisProgramCannotRunThere) {
  FlightProcess process(there());
  process.create(SimTime{}, 0);
  EXPECT_THROW(process.run(SimTime{}, 1, [] {}), std::logic_error);
  EXPECT_EQ(process.symbol("orrery_flight_entry"), nullptr);
  EXPECT_EQ(process.flip_bit(FlightMemory::kGlobals, 0.5), "");
}

// ---- other instruction sets

// Empty, or why there is nothing to test.
std::string missing_for(const TargetAddress& emulator) {
  if (std::system("command -v qemu-arm > /dev/null") != 0) {
    return "qemu-arm is not installed (Debian package qemu-user)";
  }
  const std::string library = "flight_test_subject@" + emulated_processor(emulator);
  try {
    find_flight_library(library);
  } catch (const std::invalid_argument&) {
    return library + " was not built: no cross compiler, or ORRERY_CROSS is off";
  }
  return "";
}

struct EmulatedProcessTest : testing::TestWithParam<const char*> {};

TEST_P(EmulatedProcessTest, AnswersAsTheLibraryDoesInThisProgram) {
  FlightProcessOptions options = here();
  options.target = parse_target_address(GetParam());
  const std::string missing = missing_for(options.target);
  if (!missing.empty()) GTEST_SKIP() << missing;
  FlightProcess near(here()), far(options);
  EXPECT_EQ(flown(far), flown(near));
  EXPECT_EQ(far.memory()->slots(), near.memory()->slots());
}

INSTANTIATE_TEST_SUITE_P(Emulators, EmulatedProcessTest,
                         testing::Values("qemu-arm", "qemu-arm1176"), [](const auto& test) {
                           std::string name = test.param;
                           std::erase(name, '-');
                           return name;
                         });

TEST(RemoteProcess, ALibraryThatWasNotBuiltForAProcessorIsNamed) {
  FlightProcessOptions options = here();
  options.library = "beacon";
  options.target = parse_target_address("qemu-aarch64");
  try {
    FlightProcess process(options);
    FAIL() << "it was found";
  } catch (const std::invalid_argument& error) {
    EXPECT_THAT(error.what(), HasSubstr("@arm64"));
  }
}

}  // namespace
}  // namespace orrery
