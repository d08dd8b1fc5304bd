// What the boundary around flight code costs.

#include <orrery/harness/flight/containment.hpp>
#include <orrery/harness/flight/flight_computer.hpp>
#include <orrery/harness/flight/flight_stack.hpp>
#include <orrery/harness/heap/simulated_heap.hpp>

#include <benchmark/benchmark.h>

#include <cstddef>
#include <cstdint>
#include <fstream>
#include <memory>
#include <string>
#include <unistd.h>
#include <vector>

namespace orrery {
namespace {

constexpr SimTime kStart = from_ns(0);

FlightProcessOptions subject() {
  return {.spacecraft = "bench", .library = "flight_test_subject"};
}

[[gnu::noinline]] void nothing(void* count) {
  ++*static_cast<std::uint64_t*>(count);
}

void BM_Boundary_PlainCall(benchmark::State& state) {
  void (*volatile function)(void*) = nothing;
  std::uint64_t count = 0;
  for (auto _ : state) function(&count);
  benchmark::DoNotOptimize(count);
}
BENCHMARK(BM_Boundary_PlainCall);

void BM_Boundary_ContainedCall(benchmark::State& state) {
  internal::ContainedProcess process;
  internal::CrashCapture capture;
  std::uint64_t count = 0;
  for (auto _ : state) internal::run_contained(process, nothing, &count, capture);
  benchmark::DoNotOptimize(count);
}
BENCHMARK(BM_Boundary_ContainedCall);

// As a process has it: heap, stack and limit of host time of its own.
void BM_Boundary_ContainedCallOfAProcess(benchmark::State& state) {
  SimulatedHeap heap({.limit_bytes = 1 << 20});
  internal::FlightStack stack(1 << 20);
  internal::ContainedProcess process;
  if (heap_simulation_available()) process.heap = &heap;
  if (internal::FlightStack::available()) process.stack = &stack;
  process.host_limit_ns = 10'000'000'000;
  internal::CrashCapture capture;
  std::uint64_t count = 0;
  for (auto _ : state) internal::run_contained(process, nothing, &count, capture);
  benchmark::DoNotOptimize(count);
}
BENCHMARK(BM_Boundary_ContainedCallOfAProcess);

void BM_FlightProcess_InputAndOutput(benchmark::State& state) {
  FlightProcess process(subject());
  process.create(kStart, 0);
  const std::byte message[32] = {std::byte{'e'}};  // it echoes the other 31
  for (auto _ : state) process.input(kStart, 0, process.ports()[0], message);
}
BENCHMARK(BM_FlightProcess_InputAndOutput);

void BM_FlightComputer_InputAndOutput(benchmark::State& state) {
  EventLoop loop(kStart);
  const OwnerId test = loop.add_owner("test");
  const OwnerId owner = loop.add_owner("bench");
  std::uint64_t bytes = 0;
  FlightComputer::Hooks hooks;
  hooks.on_output = [&bytes](std::string_view, Bytes message) { bytes += message.size(); };
  FlightComputer computer(loop, owner, subject(), hooks);
  computer.boot();
  const std::byte message[32] = {std::byte{'e'}};
  for (auto _ : state) {
    computer.deliver("do", message, test);
    loop.run_until(loop.now() + 1us);
  }
  benchmark::DoNotOptimize(bytes);
}
BENCHMARK(BM_FlightComputer_InputAndOutput);

void BM_FlightProcess_LoadAndUnload(benchmark::State& state) {
  for (auto _ : state) FlightProcess process(subject());
}
BENCHMARK(BM_FlightProcess_LoadAndUnload)->Unit(benchmark::kMicrosecond);

void BM_FlightProcess_Crash(benchmark::State& state) {
  const std::byte message[2] = {std::byte{'!'}, std::byte{'s'}};
  for (auto _ : state) {
    state.PauseTiming();
    auto process = std::make_unique<FlightProcess>(subject());
    process->create(kStart, 0);
    state.ResumeTiming();
    process->input(kStart, 0, process->ports()[0], message);
    state.PauseTiming();
    process.reset();
    state.ResumeTiming();
  }
}
BENCHMARK(BM_FlightProcess_Crash)->Unit(benchmark::kMicrosecond);

std::int64_t resident_bytes() {
  std::int64_t total = 0, resident = 0;
  std::ifstream("/proc/self/statm") >> total >> resident;
  return resident * sysconf(_SC_PAGESIZE);
}

// 64 isolated instances at once, created; their files are in the cache after the first round.
void BM_FlightProcess_Load64Copies(benchmark::State& state) {
  double bytes = 0;
  for (auto _ : state) {
    std::vector<std::unique_ptr<FlightProcess>> processes;
    const std::int64_t before = resident_bytes();
    for (int i = 0; i < 64; ++i) {
      FlightProcessOptions options = subject();
      options.spacecraft = "sc" + std::to_string(i);
      processes.push_back(std::make_unique<FlightProcess>(options));
      processes.back()->create(kStart, 0);
    }
    bytes = static_cast<double>(resident_bytes() - before) / 64;
    state.PauseTiming();
    processes.clear();
    state.ResumeTiming();
  }
  state.counters["bytes_each"] = bytes;
}
BENCHMARK(BM_FlightProcess_Load64Copies)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace orrery
