/// The seam between orrery::allocator, which replaces malloc in a test program, and the harness.
#pragma once

#include <orrery/harness/kernel/simulator_only.hpp>

#include <cstddef>
#include <cstdint>
#include <ctime>
#include <string>

namespace orrery {

/// What the C library and the loader keep must not lie in the heap of the spacecraft that happened
/// to make them need it: stdout's buffer, time zone, locale, the exception machinery. Once per
/// program, before the first call into flight code; more calls do nothing.
void warm_up_libraries();

/// Self-test of the allocator's hooks: empty, or a message naming those that shared libraries of
/// this program do not reach. Also empty where heaps are not simulated.
std::string verify_interposition();

/// True where time, chance and threads of flight code are answered by us: not under a sanitizer
/// that owns these functions.
bool services_are_virtual();

namespace internal {

/// The dynamic loader's code. What it allocates (thread-local storage of a library, say) outlives
/// the process in whose call it does so.
extern std::uintptr_t loader_begin, loader_bytes;

/// What flight code must not do to the test program; set once by harness/flight.
struct ProcessHooks {
  /// True: the running process keeps it, and runs it at its own end.
  bool (*register_exit)(void (*function)(void*), void* argument);
  /// Returns if no flight code is running.
  void (*exit)(int status);
  /// The flight code on this thread's stack, innermost first: number of frames written.
  int (*call_stack)(void** frames, int most);
};
extern const ProcessHooks* process_hooks;

/// What the C library answers flight code; set once by harness/flight. Each gets the name of the
/// function that was called. False: the C library answers.
struct ServiceHooks {
  bool (*read_clock)(const char* function, clockid_t clock, std::int64_t& ns);
  bool (*sleep)(const char* function, std::int64_t ns);
  bool (*sleep_until)(const char* function, clockid_t clock, std::int64_t ns);
  bool (*random_bytes)(const char* function, void* to, std::size_t bytes);
  bool (*random_number)(const char* function, std::int32_t& number);  // 0 ... 2^31 - 1
  bool (*seed)(const char* function, unsigned value);
  bool (*start_thread)(const char* function);
};
extern const ServiceHooks* service_hooks;

}  // namespace internal
}  // namespace orrery
