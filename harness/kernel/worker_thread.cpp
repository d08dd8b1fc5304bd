#include <orrery/harness/kernel/worker_thread.hpp>

#include <sched.h>

namespace orrery::internal {
namespace {

const cpu_set_t kCoresAtStart = [] {
  cpu_set_t cores;
  CPU_ZERO(&cores);
  sched_getaffinity(0, sizeof cores, &cores);
  return cores;
}();

}  // namespace

SignalsBlocked::SignalsBlocked() {
  sigset_t all;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &before_);
}

SignalsBlocked::~SignalsBlocked() {
  pthread_sigmask(SIG_SETMASK, &before_, nullptr);
}

void take_all_cores() {
  sched_setaffinity(0, sizeof kCoresAtStart, &kCoresAtStart);
}

}  // namespace orrery::internal
