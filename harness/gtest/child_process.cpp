#include <orrery/harness/gtest/child_process.hpp>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <fcntl.h>
#include <stdexcept>
#include <string_view>
#include <sys/personality.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <system_error>
#include <unistd.h>

namespace orrery {
namespace {

constexpr std::size_t kMostTail = 4096;

std::string_view name_of(std::string_view entry) {
  return entry.substr(0, entry.find('='));
}

std::vector<char*> pointers_to(std::vector<std::string>& strings) {
  std::vector<char*> pointers;
  for (std::string& string : strings) pointers.push_back(string.data());
  pointers.push_back(nullptr);
  return pointers;
}

void turn_address_randomisation_round() {
  const int now = personality(0xffffffff);
  if (now != -1) personality(static_cast<unsigned long>(now) ^ ADDR_NO_RANDOMIZE);
}

// Not dup2: orrery::allocator stands in for it and looks the system's own up at the first call. Was
// another thread doing so when this one forked, the child would wait for it for ever.
void copy_descriptor(int from, int to) {
  syscall(SYS_dup3, from, to, 0);
}

// In the child, between fork and exec: nothing that allocates, and no call that is interposed.
[[noreturn]] void become(const char* program, const std::vector<char*>& arguments,
                         const std::vector<char*>& environment, int output, pid_t parent,
                         bool other_addresses) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(127);  // it died before the call
  copy_descriptor(output, STDOUT_FILENO);
  copy_descriptor(output, STDERR_FILENO);
  if (other_addresses) turn_address_randomisation_round();
  execve(program, arguments.data(), environment.data());
  _exit(127);
}

std::string tail_of(int pipe) {
  std::string text;
  std::array<char, 4096> buffer;
  for (;;) {
    const ssize_t n = read(pipe, buffer.data(), buffer.size());
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return text;
    text.append(buffer.data(), static_cast<std::size_t>(n));
    if (text.size() > kMostTail) text.erase(0, text.size() - kMostTail);
  }
}

}  // namespace

std::vector<std::string> internal::child_environment(const ChildCommand& command) {
  std::vector<std::string> all;
  const auto is_replaced = [&command](std::string_view name) {
    const auto named = [name](const std::string& entry) { return name_of(entry) == name; };
    return name.starts_with("GTEST_") ||
           std::any_of(command.removed.begin(), command.removed.end(), named) ||
           std::any_of(command.environment.begin(), command.environment.end(), named);
  };
  for (char** entry = environ; *entry != nullptr; ++entry) {
    if (!is_replaced(name_of(*entry))) all.emplace_back(*entry);
  }
  all.insert(all.end(), command.environment.begin(), command.environment.end());
  return all;
}

std::string ChildOutcome::describe() const {
  if (exit_code >= 0) return "ended with exit code " + std::to_string(exit_code);
  return "was ended by signal " + std::to_string(signal);
}

ChildOutcome run_child(const ChildCommand& command) {
  std::vector<std::string> arguments = {command.program};
  arguments.insert(arguments.end(), command.arguments.begin(), command.arguments.end());
  std::vector<std::string> environment = internal::child_environment(command);
  const std::vector<char*> argv = pointers_to(arguments), envp = pointers_to(environment);

  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0)
    throw std::runtime_error(std::string("run_child: ") + std::strerror(errno));
  const pid_t parent = getpid();
  const pid_t child = fork();
  if (child == 0) {
    become(command.program.c_str(), argv, envp, ends[1], parent, command.other_addresses);
  }
  close(ends[1]);
  if (child < 0) {
    close(ends[0]);
    throw std::runtime_error(std::string("run_child: ") + std::strerror(errno));
  }
  ChildOutcome outcome;
  outcome.tail = tail_of(ends[0]);
  close(ends[0]);
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (WIFEXITED(status)) outcome.exit_code = WEXITSTATUS(status);
  if (WIFSIGNALED(status)) outcome.signal = WTERMSIG(status);
  return outcome;
}

TemporaryFolder::TemporaryFolder(std::string_view purpose) {
  const std::filesystem::path parent = std::filesystem::temp_directory_path();
  std::string pattern = (parent / ("orrery_" + std::string(purpose) + "_XXXXXX")).string();
  if (mkdtemp(pattern.data()) == nullptr) {
    throw std::runtime_error("no folder can be made in " + parent.string());
  }
  path_ = pattern;
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

}  // namespace orrery
