/// How one flight process is loaded and what it is given.
#pragma once

#include <orrery/harness/heap/heap_options.hpp>
#include <orrery/harness/kernel/time.hpp>

#include <cstdint>
#include <string>

namespace orrery {

class RandomStreams;

enum class Isolation : std::uint8_t {
  kCopy,    // a private copy of the library: each process has its own globals
  kShared,  // one load for all processes, as in the paper: for libraries without globals
};

/// What a process sees when its heap would pass the cap.
enum class HeapExhaustion : std::uint8_t {
  kNull,   // malloc returns null, so `new` throws std::bad_alloc
  kCrash,  // the process ends there
};

struct FlightProcessOptions {
  std::string spacecraft;       // "dsc"; goes into file names, so no '/'
  std::string process = "gnc";  // likewise
  std::string library;          // CMake target name; ORRERY_FLIGHT_PATH may redirect it
  std::string config = {};      // content of the library's own format, handed to create
  Isolation isolation = Isolation::kCopy;
  std::uint64_t heap_bytes = 64'000'000;  // cap, up to 4,293,918,720 (4 GiB less 1 MiB)
  int heap_alignment = 16;                // 16 (the host's ABI) or 8 (the paper's)
  HeapRules heap = {};                    // policy, checks
  HeapExhaustion heap_exhaustion = HeapExhaustion::kNull;
  std::uint64_t storage_bytes = 1'048'576;  // non-volatile, all slots together
  std::uint64_t stack_bytes = 1'048'576;    // 64 KiB ... 32 MiB; see FlightStack::available()
  /// Edges of control flow that one call may take, counted by a library that was built with
  /// COUNT_WORK; 0: any number. Past it the process ends, at the same instruction in every run.
  std::uint64_t work_budget = 0;
  Duration host_time_limit{10'000'000'000};  // of CPU time in one call, the last resort; 0: none
  Duration execution_time{0};                // of every call; outputs leave when it has passed
  RandomStreams* random = nullptr;           // of the run; null: a set of the process's own
  bool clock_keeps_power = false;  // false: after a power cycle the clock starts at its zero
};

/// "dsc/gnc": how messages and records name a process.
inline std::string process_name(const FlightProcessOptions& options) {
  return options.spacecraft + "/" + options.process;
}

}  // namespace orrery
