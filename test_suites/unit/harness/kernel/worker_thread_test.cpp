#include <orrery/harness/kernel/worker_thread.hpp>

#include <gtest/gtest.h>

#include <sched.h>

namespace orrery {
namespace {

TEST(WorkerThreadTest, RunsAnywhereThoughTheStarterKeepsToACore) {
  cpu_set_t before, one, seen;
  ASSERT_EQ(sched_getaffinity(0, sizeof before, &before), 0);
  CPU_ZERO(&one);
  CPU_SET(sched_getcpu(), &one);
  ASSERT_EQ(sched_setaffinity(0, sizeof one, &one), 0);
  CPU_ZERO(&seen);
  worker_thread([&seen] { sched_getaffinity(0, sizeof seen, &seen); }).join();
  cpu_set_t now;
  sched_getaffinity(0, sizeof now, &now);
  sched_setaffinity(0, sizeof before, &before);
  EXPECT_TRUE(CPU_EQUAL(&seen, &before));
  EXPECT_TRUE(CPU_EQUAL(&now, &one)) << "the starter's own cores changed";
}

TEST(WorkerThreadTest, TakesNoSignalsAndLeavesTheStarterItsOwn) {
  sigset_t there, before, now;
  sigemptyset(&there);
  ASSERT_EQ(pthread_sigmask(SIG_SETMASK, nullptr, &before), 0);
  worker_thread([&there] { pthread_sigmask(SIG_SETMASK, nullptr, &there); }).join();
  ASSERT_EQ(pthread_sigmask(SIG_SETMASK, nullptr, &now), 0);
  for (const int signal : {SIGINT, SIGTERM, SIGUSR1, SIGALRM}) {
    EXPECT_EQ(sigismember(&there, signal), 1) << signal;
    EXPECT_EQ(sigismember(&now, signal), sigismember(&before, signal)) << signal;
  }
}

}  // namespace
}  // namespace orrery
