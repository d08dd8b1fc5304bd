#include <orrery/harness/kernel/sim_state.hpp>

constinit thread_local std::int64_t sim_now = 0;
constinit thread_local const char* sim_process = "";
constinit thread_local std::uint64_t sim_event = 0;
