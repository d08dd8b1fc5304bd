/// Where the simulation on this thread stands, for a debugger: `break f if sim_event == 4711`.
///
/// C linkage, so that gdb finds them by these names in any frame. Written by the event loop and the
/// flight process; nothing in a run computes with them.
#pragma once

#include <orrery/harness/kernel/simulator_only.hpp>

#include <cstdint>

extern "C" {
/// Current instant [ns since the GPS epoch] of the loop that last moved.
extern constinit thread_local std::int64_t sim_now;
/// Flight process that is running, "" between calls.
extern constinit thread_local const char* sim_process;
/// Events executed so far, the running one included; the recorder's are not counted.
extern constinit thread_local std::uint64_t sim_event;
}
