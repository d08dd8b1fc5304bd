// A flight process on a target: the same answers as from the same library in this program, and what
// breaks there ends that process alone.

#include <orrery/harness/flight/flight_library.hpp>
#include <orrery/harness/flight/flight_process.hpp>
#include <orrery/harness/flight/flight_target.hpp>
#include <orrery/harness/flight/processor_model.hpp>
#include <orrery/harness/remote/shared_core.hpp>

#include <gmock/gmock.h>

#include <arpa/inet.h>
#include <atomic>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <fcntl.h>
#include <netinet/in.h>
#include <poll.h>
#include <string>
#include <sys/socket.h>
#include <termios.h>
#include <thread>
#include <unistd.h>
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

// Whether they yield to each other or wait at their pipes, by turns.
TEST(RemoteProcess, ThroughMemoryItAnswersTheSame) {
  FlightProcess near(here());
  const std::string expected = flown(near);
  for (const bool to_themselves : {true, false, true}) {
    SharedCore::of_this_thread()->assume_to_itself(to_themselves);
    FlightProcess far(there());
    EXPECT_EQ(flown(far), expected) << to_themselves;
  }
  SharedCore::of_this_thread()->assume_to_itself({});
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

// ---- a serial line

// Two pseudo-terminals whose far ends are joined: a cable.
class Cable {
 public:
  Cable() {
    for (int k = 0; k < 2; ++k) {
      far_[k] = posix_openpt(O_RDWR | O_NOCTTY);
      if (far_[k] < 0 || grantpt(far_[k]) != 0 || unlockpt(far_[k]) != 0) return;
      near_[k] = ptsname(far_[k]);
      // Raw, and held open, so that no byte is echoed or lost before its end is opened.
      held_[k] = open(near_[k].c_str(), O_RDWR | O_NOCTTY);
      termios line{};
      tcgetattr(held_[k], &line);
      cfmakeraw(&line);
      tcsetattr(held_[k], TCSANOW, &line);
    }
  }
  ~Cable() {
    end_ = true;
    if (relay_.joinable()) relay_.join();
    for (const int fd : {far_[0], far_[1], held_[0], held_[1]}) close(fd);
  }
  Cable(const Cable&) = delete;
  Cable& operator=(const Cable&) = delete;
  bool made() const { return held_[0] >= 0 && held_[1] >= 0; }
  const std::string& end(int k) const { return near_[k]; }
  void relay() {
    relay_ = std::thread([this] {
      while (!end_) {
        pollfd ends[2] = {{far_[0], POLLIN, 0}, {far_[1], POLLIN, 0}};
        poll(ends, 2, 20);
        for (int k = 0; k < 2; ++k) {
          char bytes[512];
          if ((ends[k].revents & POLLIN) == 0) continue;
          const ssize_t got = read(far_[k], bytes, sizeof bytes);
          for (ssize_t at = 0; at < got;) {
            const ssize_t sent = write(far_[1 - k], bytes + at, static_cast<std::size_t>(got - at));
            if (sent > 0) at += sent;
          }
        }
      }
    });
  }

 private:
  int far_[2] = {-1, -1}, held_[2] = {-1, -1};
  std::string near_[2];
  std::atomic<bool> end_ = false;
  std::thread relay_;
};

// The target is there before anybody asks; the second process finds the library as it was linked.
TEST(RemoteProcess, ASerialLineCarriesTheSameAnswers) {
  Cable cable;
  if (!cable.made()) GTEST_SKIP() << "there are no pseudo-terminals";
  FILE* target = popen((std::string("exec " TARGET_PROGRAM " " SUBJECT_LIBRARY " --serial ") +
                        cable.end(0) + ":115200 2> /dev/null & echo $!")
                           .c_str(),
                       "r");
  int pid = 0;
  ASSERT_EQ(fscanf(target, "%d", &pid), 1);
  cable.relay();
  FlightProcess near(here());
  const std::string expected = flown(near);
  FlightProcessOptions options = here();
  options.target = parse_target_address("serial:" + cable.end(1) + ":115200");
  for (int life = 0; life < 2; ++life) {
    FlightProcess far(options);
    EXPECT_EQ(flown(far), expected) << life;
    if (life == 0) continue;  // cut off without a word: the next must end it
    far.shut_down(SimTime{}, 800);
  }
  kill(pid, SIGTERM);
  pclose(target);
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

// Empty, or why nothing can be counted.
std::string missing_counter(const TargetAddress& emulator) {
  if (const std::string missing = missing_for(emulator); !missing.empty()) return missing;
  const std::string plugin =
      find_flight_library("orrery-instruction-count@" + emulated_processor(emulator));
  const std::string probe = emulator.where == "qemu-aarch64" ? "qemu-aarch64" : "qemu-arm";
  if (std::system((probe + " -plugin '" + plugin + "',page=199 -version > /dev/null").c_str()) !=
      0) {
    return probe + " was built without plugins";
  }
  return "";
}

std::vector<std::uint64_t> counts(const FlightProcessOptions& options) {
  FlightProcess process(options);
  process.create(SimTime{}, 5);
  std::vector<std::uint64_t> work = {process.work()};
  for (const char* text : {"ehello", "n", "w\4four", "y\4", "ehello", "n"}) {
    process.input(SimTime{}, 10, process.ports().front(), order(text));
    work.push_back(process.work());
  }
  return work;
}

// Two processes of the emulator, with another environment; the bounds are those of code that makes
// some calls of the C library and no loop.
TEST_P(EmulatedProcessTest, InstructionsOfEachCallRepeatExactly) {
  FlightProcessOptions options = here();
  options.target = parse_target_address(GetParam());
  options.execution_time = execution_time_on("arm1176 700 MHz");
  const std::string missing = missing_counter(options.target);
  if (!missing.empty()) GTEST_SKIP() << missing;
  const std::vector<std::uint64_t> first = counts(options);
  setenv("ORRERY_TEST_ENVIRONMENT", std::string(5000, 'x').c_str(), 1);
  EXPECT_EQ(counts(options), first);
  unsetenv("ORRERY_TEST_ENVIRONMENT");
  EXPECT_THAT(first, testing::Each(AllOf(testing::Gt(20u), testing::Lt(1'000'000u))));
  EXPECT_EQ(first[2], first.back());  // the same call later
}

// A block is its payload and 8 bytes of tags, rounded up to the ABI's alignment: 8 on 32 bits. What
// the library allocates before its first order is not known, so differences count.
TEST_P(EmulatedProcessTest, TheSimulatedHeapThereHasTheBlocksOfItsWordSize) {
  FlightProcessOptions options = here();
  options.target = parse_target_address(GetParam());
  options.heap_bytes = 10'000;
  const std::string missing = missing_for(options.target);
  if (!missing.empty()) GTEST_SKIP() << missing;
  const bool wide = emulated_processor(options.target) == "arm64";
  const std::uint64_t block = wide ? 1024 : 1016, brief = wide ? 2016 : 2008;  // of 1001 and 2000
  FlightProcess process(options);
  process.create(SimTime{}, 5);
  const FlightPort& port = process.ports().front();
  const HeapFigures before = process.heap();
  process.input(SimTime{}, 10, port, allocate(1001));
  EXPECT_EQ(process.heap().resting_bytes, before.resting_bytes + block);
  process.input(SimTime{}, 10, port, allocate_briefly(2000));
  EXPECT_EQ(process.heap().resting_bytes, before.resting_bytes + block);
  EXPECT_EQ(process.call_record().transient_peak_bytes, before.resting_bytes + block + brief);
  EXPECT_EQ(process.heap().high_water_bytes, before.resting_bytes + block + brief);
  EXPECT_EQ(process.heap().largest_free_bytes, brief);
  EXPECT_EQ(process.call_record().heap_bytes, before.heap_bytes + block + brief);
  process.input(SimTime{}, 10, port, allocate(20'000));  // above the cap: malloc is null there
  EXPECT_EQ(process.heap().resting_bytes, before.resting_bytes + block);
  ASSERT_EQ(process.output_count(), 1u);
  EXPECT_EQ(text_of(process.output(0).data), "null");
}

// ---- debugging

std::uint32_t free_port() {
  const int fd = socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t bytes = sizeof address;
  bind(fd, reinterpret_cast<sockaddr*>(&address), bytes);
  getsockname(fd, reinterpret_cast<sockaddr*>(&address), &bytes);
  close(fd);
  return ntohs(address.sin_port);
}

// The command that a failure prints, in batch: stops where flight code faults and shows its lines.
TEST(RemoteProcess, ADebuggerShowsWhereTheEmulatedLibraryFaults) {
  FlightProcessOptions options = here();
  options.target = parse_target_address("qemu-arm:" + std::to_string(free_port()));
  if (const std::string why = missing_for(options.target); !why.empty()) GTEST_SKIP() << why;
  if (std::system("command -v gdb-multiarch > /dev/null") != 0) {
    GTEST_SKIP() << "gdb-multiarch is not installed (Debian package gdb-multiarch)";
  }
  const internal::TargetDebugging debugging = internal::target_debugging(options);
  EXPECT_THAT(debugging.option, HasSubstr("--orrery_target='dsc/gnc=qemu-arm:"));
  FILE* gdb = popen((debugging.debugger + " -batch -nx 2>&1").c_str(), "r");
  ASSERT_NE(gdb, nullptr);
  {
    FlightProcess process(options);  // waits for the debugger
    process.create(SimTime{}, 0);
    EXPECT_EQ(process.input(SimTime{}, 1, process.ports().front(), order("!s")),
              CallOutcome::kCrashed);
  }
  std::string text;
  for (int c = fgetc(gdb); c != EOF; c = fgetc(gdb)) text += static_cast<char>(c);
  pclose(gdb);
  EXPECT_THAT(text, AllOf(HasSubstr("SIGSEGV"), testing::ContainsRegex("fault .*subject.c:[0-9]+"),
                          testing::ContainsRegex("input .*subject.c:[0-9]+"),
                          testing::ContainsRegex("orrery_wire_serve .*orrery_wire.c:[0-9]+")));
}

TEST(RemoteProcess, TimeByInstructionsNeedsATargetThatCountsThem) {
  FlightProcessOptions options = there();
  options.execution_time = execution_time_on("leon3-class");
  FlightProcess process(options);
  EXPECT_EQ(process.create(SimTime{}, 5), CallOutcome::kCrashed);
  EXPECT_THAT(process.crash().message, HasSubstr("counts no instructions"));
}

INSTANTIATE_TEST_SUITE_P(Emulators, EmulatedProcessTest,
                         testing::Values("qemu-arm", "qemu-arm1176", "qemu-aarch64"),
                         [](const auto& test) {
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
