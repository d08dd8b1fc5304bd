/// What is known about the end of a flight process that crashed.
#pragma once

#include <orrery/harness/kernel/bytes.hpp>
#include <orrery/harness/kernel/time.hpp>

#include <cstdint>
#include <string>
#include <vector>

namespace orrery {

enum class CrashKind : std::uint8_t {
  kSignal,         // SIGSEGV, SIGBUS, SIGFPE, SIGILL
  kAbort,          // abort(), a failed assert
  kException,      // an exception that nothing in the library caught
  kExit,           // exit()
  kFatalStatus,    // the library returned ORRERY_FATAL
  kUnknownStatus,  // the library returned a status that the ABI does not know
  kBootFailure,    // create returned anything but ORRERY_OK
  kHeapFault,      // HeapFault: double free, overwritten header, write after free ...
  kHeapExhausted,  // passed the cap, with HeapExhaustion::kCrash
  kNoProgress,     // its tick fired over and over at one instant
  kStackOverflow,  // passed the end of its stack
  kWorkBudget,     // counted more work in one call than it may (COUNT_WORK)
  kForbiddenCall,  // called what flight code must not: a thread, or with HostServices::kStrict
  kTargetLost,     // runs elsewhere, and the link to there broke, or what came over it was wrong
  kTimeout,        // one call used up its limit of the host's time: no two hosts agree on it
};
const char* to_string(CrashKind kind);

/// One call on the stack, innermost first.
struct StackFrame {
  std::uintptr_t address = 0;
  std::string object;         // file, as the loader knows it: addr2line takes it
  std::uintptr_t offset = 0;  // of the address in that file
  std::string function;       // demangled; empty if the file does not tell
};

/// A line per frame.
std::string to_string(const std::vector<StackFrame>& frames);

struct CrashReport {
  std::string spacecraft, process, library;
  SimTime t;                    // truth
  std::int64_t onboard_ns = 0;  // what the process was told
  CrashKind kind = CrashKind::kSignal;
  int signal = 0;                     // 0 where none was raised
  std::int32_t status = 0;            // what the library returned, where it did
  std::string message;                // one line: what happened, in words
  std::string call;                   // "load", "create", "input", "tick", "destroy"
  std::string port;                   // of an input
  ByteBuffer input;                   // the bytes of that input
  std::uint64_t work = 0;             // edges that the call had counted; 0 without COUNT_WORK
  std::vector<StackFrame> backtrace;  // empty where the library returned a status
  std::uint64_t seed = 0;             // of the run; 0 outside of one
  // The block that a heap fault is about, with HeapRules::track_sites; else empty.
  SimTime block_allocated, block_freed;
  std::vector<StackFrame> block_allocated_by, block_freed_by;
};

/// Several lines for people. Addresses are in it: never for a fingerprint.
std::string to_string(const CrashReport& report);

}  // namespace orrery
