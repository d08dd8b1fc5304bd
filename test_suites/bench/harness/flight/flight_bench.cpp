// What the boundary around flight code costs.

#include <orrery/harness/flight/containment.hpp>
#include <orrery/harness/flight/flight_computer.hpp>

#include <benchmark/benchmark.h>

#include <cstddef>
#include <memory>

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

}  // namespace
}  // namespace orrery
