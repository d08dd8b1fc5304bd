// What recording costs: 20 h of two spacecraft, truth at 1 Hz and all files, against the same run
// with --orrery_record=off in effect. The two alternate, so that a machine that others use slows
// both. A recorder has a thread of its own (call_queue.hpp).
#include <orrery/fixtures/recorder.hpp>
#include <orrery/harness/kernel/sanitizers.hpp>
#include <orrery/orrery.hpp>

#include <benchmark/benchmark.h>

#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <optional>
#include <string>

#include "transfer.hpp"

namespace orrery {
namespace {

double seconds_of(clockid_t clock) {
  timespec t{};
  clock_gettime(clock, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

/// Of one run, or of several: the processor's time that the simulation's own thread took, that of
/// all threads, and the time on the wall.
struct Cost {
  double thread_s = 0, cpu_s = 0, wall_s = 0;
  static Cost now() {
    return {seconds_of(CLOCK_THREAD_CPUTIME_ID), seconds_of(CLOCK_PROCESS_CPUTIME_ID),
            seconds_of(CLOCK_MONOTONIC)};
  }
  Cost& operator+=(const Cost& o) {
    thread_s += o.thread_s, cpu_s += o.cpu_s, wall_s += o.wall_s;
    return *this;
  }
  friend Cost operator-(const Cost& a, const Cost& b) {
    return {a.thread_s - b.thread_s, a.cpu_s - b.cpu_s, a.wall_s - b.wall_s};
  }
};

enum Run : std::int64_t {
  kTransferRun,      // the case study's transfer: both fly formation_gnc
  kFirstFlight,      // formation_keeping on both, receivers that say where they are every 10 s
  kAllMeasurements,  // the same with receivers that give all measurements at 1 Hz
  kCoast,            // no flight software: orbits and receivers alone
};

const char* name_of(std::int64_t run) {
  constexpr const char* kNames[] = {"transfer", "first flight", "all measurements", "coast"};
  return kNames[run];
}

FormationOptions options_of(std::int64_t run, bool record) {
  if (run == kTransferRun) return bench::telescope(record);
  FormationOptions options;
  if (run != kCoast) options.flight.library = "formation_keeping";
  options.world.record = record;
  options = missions::first_flight(options);
  if (run == kAllMeasurements) {
    using novatel::LogTrigger;
    options.gnss.period = 1s;
    options.gnss.logs = {{novatel::kRangeId, LogTrigger::kOnTime, 1s},
                         {novatel::kBestXyzId, LogTrigger::kOnTime, 1s}};
  }
  return options;
}

// From construction to destruction: the report and the index are part of it.
Cost fly(std::int64_t run, bool record, Duration span) {
  const Cost begin = Cost::now();
  {
    FormationWorld world(options_of(run, record));
    if (run == kTransferRun) bench::command_transfer(world);
    world.run_for(span);
  }
  return Cost::now() - begin;
}

/// One for the program, since the setting is read once.
class ScratchFolder {
 public:
  ScratchFolder() {
    std::string pattern = (std::filesystem::temp_directory_path() / "orrery_bench_XXXXXX").string();
    path_ = mkdtemp(pattern.data());
    setenv("ORRERY_OUT", path_.c_str(), 1);
  }
  ~ScratchFolder() { std::filesystem::remove_all(path_); }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }
  void clear() const {
    for (const auto& entry : std::filesystem::directory_iterator(path_)) {
      std::filesystem::remove_all(entry.path());
    }
  }

 private:
  std::filesystem::path path_;
};

const ScratchFolder& scratch_folder() {
  static const ScratchFolder folder;
  return folder;
}

// thread_percent is what a user waits for who has a second processor to spare, cpu_percent what a
// campaign pays that keeps all of them busy. wall_percent lies between them, and shows other
// programs' load.
void BM_RecordingAtOneHertz(benchmark::State& state) {
  const ScratchFolder& out = scratch_folder();
  Cost off, on;
  for (auto _ : state) {
    off += fly(state.range(1), false, state.range(0) * 1h);
    on += fly(state.range(1), true, state.range(0) * 1h);
    out.clear();
  }
  state.SetLabel(name_of(state.range(1)));
  const double runs = static_cast<double>(state.iterations());
  state.counters["off_s"] = off.cpu_s / runs;
  state.counters["on_s"] = on.cpu_s / runs;
  state.counters["thread_percent"] = 100 * (on.thread_s / off.thread_s - 1);
  state.counters["cpu_percent"] = 100 * (on.cpu_s / off.cpu_s - 1);
  state.counters["wall_percent"] = 100 * (on.wall_s / off.wall_s - 1);
}

// What a recorder costs that does not record: the calls that a frame over the crosslink and the
// call of flight software that it causes make of it, eight.
void BM_RecorderOff(benchmark::State& state) {
  Recorder recorder;
  const std::string craft = "deputy", process = "gnc";
  const ProcessLabel label{craft, process, craft};
  const ByteBuffer bytes(96);
  const CallSpan span{};
  const CallRecord call{};
  SimTime t = missions::reference_epoch();
  for (auto _ : state) {
    benchmark::DoNotOptimize(recorder);
    recorder.link(craft, t, t, bytes.size(), "delivered");
    recorder.device_bytes(t, craft, "crosslink", "crosslink", bytes);
    recorder.span(label, span);
    recorder.call(label, call);
    recorder.state(t, craft, process);
    recorder.burn(t, craft, "thruster", true);
    recorder.off(t, label);
    recorder.log(t, craft, process, 0, process);
    t += 1s;
  }
}
BENCHMARK(BM_RecorderOff);

// What is left to do when a run of 50 h ends: digest, report.html, summary, index.
void BM_FilesOfALongRun(benchmark::State& state) {
  const ScratchFolder& out = scratch_folder();
  double end_s = 0, bytes = 0;
  for (auto _ : state) {
    FormationOptions options;
    options.flight.library = "formation_keeping";
    std::optional<FormationWorld> world;
    world.emplace(missions::first_flight(options));
    world->run_for(state.range(0) * 1h);
    const Cost begin = Cost::now();
    world.reset();
    end_s += (Cost::now() - begin).cpu_s;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(out.path())) {
      if (entry.path().filename() == "report.html") bytes += static_cast<double>(entry.file_size());
    }
    out.clear();
  }
  const double runs = static_cast<double>(state.iterations());
  state.counters["end_s"] = end_s / runs;
  state.counters["report_bytes"] = bytes / runs;
}

#ifdef ORRERY_ADDRESS_SANITIZER
constexpr int kHours = 1;
#else
constexpr int kHours = 20;
#endif
BENCHMARK(BM_FilesOfALongRun)
    ->ArgName("hours")
    ->Arg(5 * kHours / 2)
    ->Iterations(1)
    ->Unit(benchmark::kMillisecond);
BENCHMARK(BM_RecordingAtOneHertz)
    ->ArgNames({"hours", "run"})
    ->ArgsProduct({{kHours}, {kTransferRun, kFirstFlight, kAllMeasurements, kCoast}})
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace orrery
