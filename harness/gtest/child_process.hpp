/// This test program once more, as a child process.
#pragma once

#include <orrery/harness/kernel/simulator_only.hpp>

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace orrery {

struct ChildCommand {
  std::vector<std::string> arguments;    // without the program's name
  std::vector<std::string> environment;  // "NAME=value", added to this one's
  std::vector<std::string> removed;      // names; all GTEST_* go in any case
  std::string program = "/proc/self/exe";
  /// With address randomisation where this process has none, and without where it has.
  bool other_addresses = false;
};

struct ChildOutcome {
  int exit_code = -1;  // -1: ended by a signal
  int signal = 0;
  std::string tail;  // of what it printed on stdout and stderr, at most 4 kB

  bool passed() const { return exit_code == 0; }
  std::string describe() const;  // "ended with exit code 1", "was ended by signal 11"
};

/// Starts it and waits for it. It dies with this process.
/// @throws std::runtime_error  it cannot be started.
ChildOutcome run_child(const ChildCommand& command);

namespace internal {
/// The environment of such a child.
std::vector<std::string> child_environment(const ChildCommand& command);
}  // namespace internal

/// For what a child leaves; removed with all that is in it.
class TemporaryFolder {
 public:
  /// @param purpose  part of its name: "shrink". @throws std::runtime_error  it cannot be made.
  explicit TemporaryFolder(std::string_view purpose);
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  std::filesystem::path operator/(const char* name) const { return path_ / name; }

 private:
  std::filesystem::path path_;
};

}  // namespace orrery
