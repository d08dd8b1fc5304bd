/// The boundary around flight code: what is set on the way in, put back on the way out, and what
/// becomes of a crash in between.
#pragma once

#include <orrery/harness/flight/crash_report.hpp>
#include <orrery/harness/flight/flight_stack.hpp>
#include <orrery/harness/heap/simulated_heap.hpp>

#include <cstdint>
#include <string>
#include <vector>

namespace orrery::internal {

/// What is known at the place of a crash. Filled in a signal handler, so it allocates nothing.
struct CrashCapture {
  CrashKind kind = CrashKind::kSignal;
  int signal = 0;
  char message[256] = "";
  static constexpr int kMostFrames = 64;
  void* frames[kMostFrames];
  int frame_count = 0;
};

class FileServices;
class VirtualServices;

/// A function that a library wants called at the end of its process.
struct ExitFunction {
  void (*function)(void*) = nullptr;
  void* argument = nullptr;
};

/// The part of a process that the boundary needs.
struct ContainedProcess {
  const char* name = "";                // "dsc/gnc", for debuggers
  SimulatedHeap* heap = nullptr;        // null: the system's
  FlightStack* stack = nullptr;         // null: the caller's
  VirtualServices* services = nullptr;  // null: the host's
  FileServices* files = nullptr;        // likewise
  std::int64_t host_limit_ns = 0;       // of thread CPU time in one call; 0: none
  std::vector<ExitFunction> exit_functions;
  std::vector<const void*> statics_begun;  // guards of those whose constructors are running
  bool changed_floating_point = false;     // set when a call left the control registers changed
};

/// Runs function(argument) as flight code. True if it returned; false if it crashed, and then
/// `capture` tells how: its frames are gone, no destructor of them ran.
///
/// A call that uses up its limit of CPU time ends as CrashKind::kTimeout, at most 0.1 s of CPU time
/// later; not under a debugger or valgrind. It may leave locks of the C library held.
///
/// Saved and restored: current heap, stack, sim_process, MXCSR and x87 control word; after a crash
/// the signal mask and the exception state of the thread as well.
/// @throws std::logic_error  flight code is running already: calls do not nest.
bool run_contained(ContainedProcess& process, void (*function)(void*), void* argument,
                   CrashCapture& capture);

/// True while run_contained is on this thread's stack, callbacks included.
bool call_in_progress();

/// True if what runs now is flight code, and not the simulator that it called.
bool flight_code_is_running();

/// The process whose call is on this thread's stack, or null.
ContainedProcess* running_process();

/// From now on whoever wants the static of that guard crashes, for the reason given. The guard's
/// library must stay loaded.
void mark_half_initialised(const void* guard, const std::string& reason);

/// Ends the call of flight code that is running now, as a crash. Returns only if none is.
void end_running_call(CrashKind kind, const char* message);

/// In a child process after a fork: this thread's limit of CPU time gets a timer of its own, since
/// none is inherited.
void renew_call_timer();

/// Within a host callback: simulator code, without heap. What goes wrong in it is not contained.
/// Trivial to leave behind by a crash; hence no members that own anything.
class SimulatorScope {
 public:
  SimulatorScope();
  ~SimulatorScope();
  SimulatorScope(const SimulatorScope&) = delete;
  SimulatorScope& operator=(const SimulatorScope&) = delete;

 private:
  SimulatedHeap* heap_;
};

}  // namespace orrery::internal
