#include <orrery/harness/gtest/host_conditions.hpp>

#include <cerrno>
#include <climits>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <string>
#include <string_view>
#include <sys/personality.h>
#include <unistd.h>

namespace orrery::internal {
namespace {

constexpr const char* kExecuted = "ORRERY_EXECUTED_ANEW";

bool lists_only(char** arguments) {
  for (char** argument = arguments; *argument != nullptr; ++argument) {
    const std::string_view text = *argument;
    if (text == "--gtest_list_tests" || text == "--help" || text == "-h") return true;
  }
  return std::getenv("GTEST_LIST_TESTS") != nullptr;
}

bool under_valgrind() {
  const char* preload = std::getenv("LD_PRELOAD");
  return preload != nullptr && std::strstr(preload, "vgpreload") != nullptr;
}

bool is_traced() {
  std::ifstream status("/proc/self/status");
  for (std::string word; status >> word;) {
    if (word == "TracerPid:") return status >> word && word != "0";
  }
  return false;
}

// Returns only where it fails.
void execute_anew(char** arguments) {
  char program[PATH_MAX];
  const ssize_t length = readlink("/proc/self/exe", program, sizeof program - 1);
  const int persona = personality(0xffffffff);
  if (length < 0 || persona == -1) return;
  program[length] = 0;
  const auto kept = static_cast<unsigned long>(persona);
  if (personality(kept | ADDR_NO_RANDOMIZE) == -1) return;
  setenv(kExecuted, "1", 1);
  execv(program, arguments);
  const int error = errno;
  personality(kept);
  errno = error;
}

}  // namespace

void fix_host_conditions(char** arguments) {
  setenv("LC_ALL", "C", 1);
  unsetenv("LANGUAGE");
  setenv("TZ", "UTC0", 1);
  if (std::getenv(kExecuted) != nullptr || lists_only(arguments)) return;
  const int persona = personality(0xffffffff);
  if (persona != -1 && (persona & ADDR_NO_RANDOMIZE) != 0) return;
  if (under_valgrind() || is_traced()) return;
  execute_anew(arguments);
  std::fprintf(stderr, "orrery: addresses stay randomised: %s\n", std::strerror(errno));
  setenv(kExecuted, "refused", 1);  // children need not try
}

}  // namespace orrery::internal
