#include <orrery/harness/gtest/child_process.hpp>

#include <gtest/gtest.h>

#include <atomic>
#include <dlfcn.h>
#include <fstream>
#include <string>
#include <thread>
#include <unistd.h>

namespace orrery {
namespace {

bool sleeps(pid_t thread) {
  std::ifstream file("/proc/self/task/" + std::to_string(thread) + "/stat");
  std::string text;
  std::getline(file, text);
  const std::size_t name_end = text.rfind(')');
  return name_end != std::string::npos && text.substr(name_end + 2, 1) == "S";
}

// A hook of orrery::allocator looks up the function that it stands for when it is first called. A
// child forked while another thread is doing so must not come to the same hook before its exec: who
// would end the lookup is not in the child. Here the lookup takes as long as a library's
// constructor holds the dynamic loader's lock.
TEST(ChildProcess, StartsWhileAnotherThreadIsInAHook) {
  const ChildCommand command{.program = "/bin/true"};
  // What this process calls itself while the lock is held has been looked up before.
  ASSERT_EQ(run_child(command).exit_code, 0);
  ASSERT_FALSE(sleeps(gettid()));

  int begun[2], may_end[2];
  ASSERT_EQ(pipe(begun), 0);
  ASSERT_EQ(pipe(may_end), 0);
  setenv("ORRERY_TEST_BEGUN", std::to_string(begun[1]).c_str(), 1);
  setenv("ORRERY_TEST_MAY_END", std::to_string(may_end[0]).c_str(), 1);
  std::thread loader([] { EXPECT_NE(dlopen(ORRERY_WAITS_WHEN_LOADED, RTLD_NOW), nullptr); });
  char byte = 0;
  EXPECT_EQ(read(begun[0], &byte, 1), 1);
  std::atomic<pid_t> id = 0;
  std::atomic<bool> is_through = false;
  std::thread in_hook([&] {
    id = gettid();
    EXPECT_EQ(dup2(-1, -1), -1);
    is_through = true;
  });
  while (!is_through && (id == 0 || !sleeps(id))) std::this_thread::yield();
  const bool looks_up = !is_through;

  if (looks_up) {
    EXPECT_EQ(run_child(command).exit_code, 0);
  }
  EXPECT_EQ(write(may_end[1], &byte, 1), 1);
  in_hook.join();
  loader.join();
  if (!looks_up) GTEST_SKIP() << "a test before this one called dup2: run it alone, as ctest does";
}

}  // namespace
}  // namespace orrery
