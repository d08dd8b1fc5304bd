/// Threads of the simulator's own.
#pragma once

#include <orrery/harness/kernel/simulator_only.hpp>

#include <signal.h>
#include <thread>
#include <utility>

namespace orrery {

namespace internal {

/// While it lives, threads that begin take no signals: those of a test program are for its own.
class SignalsBlocked {
 public:
  SignalsBlocked();
  ~SignalsBlocked();
  SignalsBlocked(const SignalsBlocked&) = delete;
  SignalsBlocked& operator=(const SignalsBlocked&) = delete;

 private:
  sigset_t before_;
};

/// Lets the calling thread run wherever the program might when it was started.
void take_all_cores();

}  // namespace internal

/// Starts a thread that takes no signals and may run on any core that the program was started with,
/// though the one that starts it keep to one of them meanwhile (SharedCore).
template <class Run>
std::thread worker_thread(Run run) {
  const internal::SignalsBlocked blocked;
  return std::thread([run = std::move(run)]() mutable {
    internal::take_all_cores();
    run();
  });
}

}  // namespace orrery
