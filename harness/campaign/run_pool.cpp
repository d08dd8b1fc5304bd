#include <orrery/harness/campaign/run_pool.hpp>
#include <orrery/harness/gtest/child_process.hpp>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <fcntl.h>
#include <fstream>
#include <poll.h>
#include <stdexcept>
#include <string_view>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

namespace orrery {
namespace {

using HostClock = std::chrono::steady_clock;  // for limits and reports; no run sees it

constexpr std::size_t kMostOutput = 4096;  // its tail is kept
constexpr int kRecordPipe = 3;             // in the child
// Where the kernel has no pidfd (before 5.3, some sandboxes) an end is seen by looking.
constexpr int kLookEvery_ms = 2;
constexpr int kWeighEvery_ms = 20;

[[noreturn]] void fail(const char* what) {
  throw std::runtime_error(std::string("RunPool: ") + what + ": " + std::strerror(errno));
}

struct Pipe {
  int read = -1, write = -1;
  Pipe() {
    int ends[2];
    if (pipe2(ends, O_CLOEXEC) != 0) fail("no pipe");
    read = ends[0];
    write = ends[1];
    fcntl(read, F_SETFL, O_NONBLOCK);
  }
  ~Pipe() {
    close_read();
    close_write();
  }
  Pipe(const Pipe&) = delete;
  Pipe& operator=(const Pipe&) = delete;
  // An end that the child has closed would end every wait.
  void close_read() {
    if (read >= 0) close(read);
    read = -1;
  }
  void close_write() {
    if (write >= 0) close(write);
    write = -1;
  }
  void drain(std::string& into) {
    std::array<char, 4096> buffer;
    while (read >= 0) {
      const ssize_t n = ::read(read, buffer.data(), buffer.size());
      if (n < 0 && errno == EINTR) continue;
      if (n < 0) return;  // nothing there yet
      if (n == 0) return close_read();
      into.append(buffer.data(), static_cast<std::size_t>(n));
    }
  }
};

std::vector<std::string> arguments_of(const RunCommand& command) {
  std::vector<std::string> arguments = {
      command.name.empty() ? command.program : command.name, "--gtest_filter=" + command.test,
      "--gtest_also_run_disabled_tests", "--orrery_seed=" + std::to_string(command.base_seed),
      "--orrery_run=" + std::to_string(command.run)};
  arguments.insert(arguments.end(), command.flags.begin(), command.flags.end());
  return arguments;
}

std::vector<char*> pointers_to(std::vector<std::string>& strings) {
  std::vector<char*> pointers;
  for (std::string& string : strings) pointers.push_back(string.data());
  pointers.push_back(nullptr);
  return pointers;
}

// In the child, between fork and exec: nothing that allocates.
[[noreturn]] void become(const char* program, const std::vector<char*>& arguments,
                         const std::vector<char*>& environment, int record, int output,
                         pid_t parent) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(127);  // it died before the call
  setpgid(0, 0);                        // Ctrl-C is the runner's to handle
  // Where memory runs out, the kernel is to take a run, not the runner.
  const int score = open("/proc/self/oom_score_adj", O_WRONLY | O_CLOEXEC);
  if (score >= 0 && write(score, "500", 3) < 0) errno = 0;
  const int nothing = open("/dev/null", O_RDONLY);
  dup2(nothing, STDIN_FILENO);
  dup2(output, STDOUT_FILENO);
  dup2(output, STDERR_FILENO);
  if (record == kRecordPipe) {
    fcntl(record, F_SETFD, 0);
  } else {
    dup2(record, kRecordPipe);
  }
  signal(SIGPIPE, SIG_DFL);
  sigset_t none;
  sigemptyset(&none);
  sigprocmask(SIG_SETMASK, &none, nullptr);
  execve(program, arguments.data(), environment.data());
  dprintf(STDERR_FILENO, "%s: %s", program, std::strerror(errno));
  _exit(127);
}

bool is_of_the_host(int signal) {
  return signal == SIGKILL || signal == SIGTERM || signal == SIGINT || signal == SIGHUP ||
         signal == SIGQUIT || signal == SIGXCPU;
}

std::string last_line(std::string_view text) {
  while (!text.empty() && text.back() == '\n') text.remove_suffix(1);
  return std::string(text.substr(text.rfind('\n') + 1)).substr(0, 200);
}

// Also of one that has just ended: 0.
std::uint64_t resident_bytes_of(pid_t pid) {
  static const auto kPage_bytes = static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
  std::uint64_t total = 0, resident = 0;
  std::ifstream("/proc/" + std::to_string(pid) + "/statm") >> total >> resident;
  return resident * kPage_bytes;
}

std::string megabytes(std::uint64_t bytes) {
  return std::to_string(bytes / 1'000'000) + " MB";
}

double seconds_of(const timeval& t) {
  return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
}

}  // namespace

struct RunPool::Child {
  RunCommand command;
  Pipe record_pipe, output_pipe;
  std::string record, output;
  pid_t pid = -1;
  int pidfd = -1;
  HostClock::time_point begin = HostClock::now();
  bool timed_out = false;
  std::uint64_t too_large_bytes = 0;  // when it was ended for it
  int status = 0;
  rusage used{};

  ~Child() {
    if (pidfd >= 0) close(pidfd);
    if (pid > 0) {
      kill(-pid, SIGKILL);
      kill(pid, SIGKILL);
      while (waitpid(pid, nullptr, 0) < 0 && errno == EINTR) {
      }
    }
  }
  void take_output() {
    record_pipe.drain(record);
    output_pipe.drain(output);
    if (output.size() > kMostOutput) output.erase(0, output.size() - kMostOutput);
  }
  RunRecord result();
};

// What the record says, unless the end of the process says something worse.
RunRecord RunPool::Child::result() {
  take_output();
  RunRecord r;
  std::string_view line = record;
  const bool begun = line.starts_with(internal::kRunBegun);
  if (begun) line.remove_prefix(internal::kRunBegun.size());
  line = line.substr(0, line.find('\n'));
  const std::optional<RunRecord> left = parse_run_record(line);
  if (left) r = *left;
  r.test = command.test;
  r.run = command.run;
  r.seed = command.base_seed + command.run;
  r.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  r.signal = WIFSIGNALED(status) ? WTERMSIG(status) : 0;
  r.wall_s = std::chrono::duration<double>(HostClock::now() - begin).count();
  r.cpu_s = seconds_of(used.ru_utime) + seconds_of(used.ru_stime);
  r.peak_kB = static_cast<std::uint64_t>(used.ru_maxrss);
  if (timed_out) {
    r.outcome = RunOutcome::kTimeout;
    r.failure_site = "time limit";
    r.failure_text = "not at its end after " + std::to_string(r.wall_s) + " s on the host";
  } else if (too_large_bytes > 0) {
    r.outcome = RunOutcome::kMemory;
    r.failure_site = "memory limit";
    r.failure_text = megabytes(too_large_bytes) + " resident after " + std::to_string(r.wall_s) +
                     " s on the host";
  } else if (r.signal != 0) {
    r.outcome = is_of_the_host(r.signal) ? RunOutcome::kKilled : RunOutcome::kCrashed;
    r.failure_site = "signal " + std::to_string(r.signal) + ", " + strsignal(r.signal);
    r.failure_text = output;
  } else if (!left && begun && r.exit_code != 0) {
    r.outcome = RunOutcome::kCrashed;
    r.failure_site = "exit code " + std::to_string(r.exit_code) + " amid the test";
    r.failure_text = output;
  } else if (!left || left->test != r.test || left->run != r.run || left->seed != r.seed) {
    r.outcome = RunOutcome::kError;
    r.failure_site = "left no record, exit code " + std::to_string(r.exit_code);
    r.failure_text = "it ran nothing: " + last_line(output);
  } else if (r.outcome == RunOutcome::kPassed && r.exit_code != 0) {
    r.outcome = RunOutcome::kFailed;
    r.failure_site = "exit code " + std::to_string(r.exit_code) + " after the test";
    r.failure_text = last_line(output);
  }
  return r;
}

std::string replay_command_of(const RunCommand& command) {
  std::string text = (command.name.empty() ? command.program : command.name) + " --gtest_filter='" +
                     command.test + "' --orrery_seed=" + std::to_string(command.base_seed) +
                     " --orrery_run=" + std::to_string(command.run);
  for (const std::string& flag : command.flags) text += " '" + flag + "'";
  return text;
}

RunPool::RunPool(int jobs, const RunLimits& limits)
    : jobs_(static_cast<std::size_t>(jobs)), limits_(limits) {
  if (jobs < 1) {
    throw std::invalid_argument("RunPool: jobs = " + std::to_string(jobs) + "; accepted: from 1");
  }
  if (limits.time <= Duration::zero()) {
    throw std::invalid_argument("RunPool: time_limit = " + to_string(limits.time) +
                                "; accepted: above 0 s");
  }
}

RunPool::~RunPool() = default;

void RunPool::start(const RunCommand& command) {
  auto child = std::make_unique<Child>();
  child->command = command;
  std::vector<std::string> arguments = arguments_of(command);
  std::vector<std::string> environment = internal::child_environment(
      {.arguments = {},
       .environment = {"ORRERY_RUN_RECORD=" + std::to_string(kRecordPipe)},
       .removed = {"ORRERY_RUNS", "ORRERY_CAMPAIGN", "ORRERY_JOBS", "ORRERY_PROGRESS",
                   "ORRERY_VERIFY_DETERMINISM", "ORRERY_SHRINK"}});
  const std::vector<char*> argv = pointers_to(arguments), envp = pointers_to(environment);
  const pid_t parent = getpid();
  child->begin = HostClock::now();
  const pid_t pid = fork();
  if (pid == 0) {
    become(command.program.c_str(), argv, envp, child->record_pipe.write, child->output_pipe.write,
           parent);
  }
  if (pid < 0) fail("no process");
  child->pid = pid;
  child->record_pipe.close_write();
  child->output_pipe.close_write();
  child->pidfd = static_cast<int>(syscall(SYS_pidfd_open, pid, 0));
  children_.push_back(std::move(child));
}

// Until a child has ended or something is to be read; pipes that fill up would stop their writers.
void RunPool::listen(Duration at_most) {
  std::vector<pollfd> asked;
  auto until = HostClock::now() + at_most;
  bool look = false;
  for (const auto& child : children_) {
    until = std::min(until, child->begin + limits_.time);
    look = look || child->pidfd < 0;
    if (child->pidfd >= 0) asked.push_back({child->pidfd, POLLIN, 0});
    asked.push_back({child->output_pipe.read, POLLIN, 0});
    asked.push_back({child->record_pipe.read, POLLIN, 0});
  }
  const auto left = std::chrono::ceil<std::chrono::milliseconds>(until - HostClock::now()).count();
  const int most_ms = look ? kLookEvery_ms : limits_.memory_bytes > 0 ? kWeighEvery_ms : 1000;
  const auto wait_ms = std::clamp<std::int64_t>(left, 0, most_ms);
  poll(asked.data(), asked.size(), static_cast<int>(wait_ms));
}

// Whether it may go on: within its limits.
bool RunPool::may_go_on(Child& child) const {
  child.timed_out = HostClock::now() >= child.begin + limits_.time;
  if (child.timed_out) return false;
  if (limits_.memory_bytes == 0) return true;
  const std::uint64_t bytes = resident_bytes_of(child.pid);
  if (bytes <= limits_.memory_bytes) return true;
  child.too_large_bytes = bytes;
  return false;
}

bool RunPool::has_ended(Child& child) {
  child.take_output();
  pid_t ended = wait4(child.pid, &child.status, WNOHANG, &child.used);
  if (ended == 0 && !may_go_on(child)) {
    kill(-child.pid, SIGKILL);
    kill(child.pid, SIGKILL);  // it may not have its group yet
    while ((ended = wait4(child.pid, &child.status, 0, &child.used)) < 0 && errno == EINTR) {
    }
  }
  if (ended == 0) return false;
  child.pid = -1;
  return true;
}

std::vector<RunRecord> RunPool::finished(Duration at_most) {
  if (children_.empty()) return {};
  listen(at_most);
  std::vector<RunRecord> records;
  for (auto child = children_.begin(); child != children_.end();) {
    if (has_ended(**child)) {
      records.push_back((*child)->result());
      child = children_.erase(child);
    } else {
      ++child;
    }
  }
  return records;
}

void RunPool::kill_all() {
  children_.clear();
}

}  // namespace orrery
