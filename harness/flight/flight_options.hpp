/// How one flight process is loaded and what it is given.
#pragma once

#include <orrery/harness/flight/execution_time.hpp>
#include <orrery/harness/flight/flight_port.hpp>
#include <orrery/harness/heap/heap_options.hpp>
#include <orrery/harness/kernel/time.hpp>
#include <orrery/harness/remote/target_address.hpp>

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace orrery {

class CallRecording;
class RandomStreams;
class FlightAdapter;
class Process;

enum class Isolation : std::uint8_t {
  kCopy,    // a private copy of the library: each process has its own globals
  kShared,  // one load for all processes, as in the paper: for libraries without globals
};

/// What a process sees when its heap would pass the cap.
enum class HeapExhaustion : std::uint8_t {
  kNull,   // malloc returns null, so `new` throws std::bad_alloc
  kCrash,  // the process ends there
};

/// What the C library answers flight code that asks for the time, for random numbers, for sleep.
enum class HostServices : std::uint8_t {
  kVirtual,  // from the onboard clock and the run's random streams; threads are refused
  kStrict,   // each such call ends the process, by name
  kHost,     // as outside of a simulation: no two runs are the same
};

/// What flight code finds at a path that is none of FlightProcessOptions::files.
enum class OtherFiles : std::uint8_t {
  kRefuse,  // the call ends the process, by name; under AddressSanitizer as kHost
  kAbsent,  // nothing is there, and nothing can be made there
  kHost,    // the host's file: no two runs need be the same
};

struct FlightProcessOptions {
  std::string spacecraft;       // "dsc"; goes into file names, so no '/'
  std::string process = "gnc";  // likewise
  int priority = 0;             // of several processes on one processor the highest goes first
  std::string library;          // CMake target name; ORRERY_FLIGHT_PATH may redirect it
  std::string config = {};      // content of the library's own format, handed to create
  Isolation isolation = Isolation::kCopy;
  std::uint64_t heap_bytes = 64'000'000;  // cap, up to 4,293,918,720 (4 GiB less 1 MiB)
  int heap_alignment = 16;                // 16 (the host's ABI) or 8 (the paper's)
  HeapRules heap = {};                    // policy, checks
  HeapExhaustion heap_exhaustion = HeapExhaustion::kNull;
  /// Instead of the ABI's entry, which the library then need not have (flight_adapter.hpp); the
  /// ids of the ports are of no account.
  std::function<std::unique_ptr<FlightAdapter>(Process&)> adapter = {};
  std::vector<FlightPort> adapter_ports = {};
  std::uint64_t storage_bytes = 1'048'576;        // non-volatile, all slots together
  std::map<std::string, std::string> files = {};  // see FlightFiles
  OtherFiles other_files = OtherFiles::kRefuse;
  std::uint64_t file_bytes = 64'000'000;   // capacity, all files together
  bool power_loss_takes_unsynced = false;  // what was written to files since the last fsync
  std::uint64_t stack_bytes = 1'048'576;   // 64 KiB ... 32 MiB; see FlightStack::available()
  /// Edges of control flow that one call may take, counted by a library that was built with
  /// COUNT_WORK; 0: any number. Past it the process ends, at the same instruction in every run.
  std::uint64_t work_budget = 0;
  Duration host_time_limit{10'000'000'000};  // of CPU time in one call, the last resort; 0: none
  ExecutionTime execution_time = {};         // of every call; outputs leave when it has passed
  /// By input port, "create" or "tick": in place of execution_time.
  std::map<std::string, ExecutionTime> execution_time_of = {};
  /// By input port, or "tick": a call starts later by a time drawn evenly from 0 to this, without
  /// overtaking one of the same port.
  std::map<std::string, Duration> scheduling_jitter = {};
  HostServices services = HostServices::kVirtual;
  RandomStreams* random = nullptr;            // of the run; null: a set of the process's own
  std::shared_ptr<CallRecording> calls = {};  // gets every call of every life; null: none is kept
  /// Where the library runs, if not in this program: `library` is then a name only, and what
  /// concerns its memory here (heap, stack, files, services, isolation) has no effect.
  TargetAddress target = {};
  Duration target_patience{30'000'000'000};  // host time for one call there, and to be reached
  bool clock_keeps_power = false;  // false: after a power cycle the clock starts at its zero
};

/// "dsc/gnc": how messages and records name a process.
inline std::string process_name(const FlightProcessOptions& options) {
  return options.spacecraft + "/" + options.process;
}

}  // namespace orrery
