// What a call over the wire costs beyond the flight code's own time: the library in another process
// of this processor, and on emulated ARM; either anywhere, or with both processes on one core.
//
// The counter cpu_us is the processor time of both processes per call, which does not grow with
// what else the machine does; Time is real.

#include <orrery/harness/flight/flight_library.hpp>
#include <orrery/harness/flight/flight_process.hpp>

#include <benchmark/benchmark.h>

#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <sched.h>
#include <stdexcept>
#include <string>
#include <time.h>
#include <unistd.h>
#include <vector>

namespace orrery {
namespace {

double seconds_of(clockid_t clock) {
  timespec t{};
  clock_gettime(clock, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

// Of this process and of those that it started and that still run.
double cpu_s() {
  double sum = seconds_of(CLOCK_PROCESS_CPUTIME_ID);
  const std::string self = std::to_string(getpid());
  std::ifstream children("/proc/" + self + "/task/" + self + "/children");
  for (pid_t child = 0; children >> child;) {
    clockid_t clock{};
    if (clock_getcpuclockid(child, &clock) == 0) sum += seconds_of(clock);
  }
  return sum;
}

// What is started later stays there, too.
class OnOneCore {
 public:
  explicit OnOneCore(bool pin) {
    sched_getaffinity(0, sizeof before_, &before_);
    if (!pin) return;
    cpu_set_t one;
    CPU_ZERO(&one);
    CPU_SET(sched_getcpu(), &one);
    sched_setaffinity(0, sizeof one, &one);
  }
  ~OnOneCore() { sched_setaffinity(0, sizeof before_, &before_); }
  OnOneCore(const OnOneCore&) = delete;
  OnOneCore& operator=(const OnOneCore&) = delete;

 private:
  cpu_set_t before_{};
};

// Asks for the time: 9 bytes come back. In this program that call takes some 0.05 us.
void run(benchmark::State& state, const std::string& target) {
  const OnOneCore cores(state.range(0) != 0);
  FlightProcessOptions options{.spacecraft = "bench", .library = "flight_test_subject"};
  options.target = parse_target_address(target);
  FlightProcess process(options);
  process.create(SimTime{}, 0);
  const FlightPort& port = process.ports().front();
  constexpr std::byte kNow[1] = {std::byte{'n'}};
  for (int i = 0; i < 200; ++i) process.input(SimTime{}, 0, port, kNow);  // translated by then
  const double begin_s = cpu_s();
  for (auto _ : state) benchmark::DoNotOptimize(process.input(SimTime{}, 0, port, kNow));
  state.counters["cpu_us"] = 1e6 * (cpu_s() - begin_s) / static_cast<double>(state.iterations());
}

void BM_Target_ProcessOfThisProcessor(benchmark::State& state) {
  run(state, "exec:" TARGET_PROGRAM " " SUBJECT_LIBRARY);
}
BENCHMARK(BM_Target_ProcessOfThisProcessor)->ArgName("one_core")->Arg(0)->Arg(1)->UseRealTime();

// The same without the memory beside the pipes, which the target then does not know of.
void BM_Target_ByPipes(benchmark::State& state) {
  run(state, "exec:env -u ORRERY_MAILBOX " TARGET_PROGRAM " " SUBJECT_LIBRARY);
}
BENCHMARK(BM_Target_ByPipes)->ArgName("one_core")->Arg(0)->Arg(1)->UseRealTime();

void BM_Target_EmulatedArm(benchmark::State& state) {
  if (std::system("command -v qemu-arm > /dev/null") != 0) {
    state.SkipWithError("qemu-arm is not installed");
    return;
  }
  try {
    find_flight_library("flight_test_subject@armhf");
  } catch (const std::invalid_argument&) {
    state.SkipWithError("flight_test_subject was not built for armhf");
    return;
  }
  run(state, "qemu-arm");
}
BENCHMARK(BM_Target_EmulatedArm)->ArgName("one_core")->Arg(0)->Arg(1)->UseRealTime();

}  // namespace
}  // namespace orrery
