#include <orrery/harness/record/output_folder.hpp>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <fcntl.h>
#include <optional>
#include <stdexcept>
#include <sys/file.h>
#include <sys/stat.h>
#include <system_error>
#include <unistd.h>

namespace orrery {

namespace {

namespace fs = std::filesystem;

std::string folder_name(std::string_view test) {
  const auto awkward = [](char c) { return c == '\\' || static_cast<unsigned char>(c) < ' '; };
  if (test.empty() || test.front() == '.' || std::any_of(test.begin(), test.end(), awkward)) {
    throw std::invalid_argument("OutputFolder: test = \"" + std::string(test) +
                                "\"; accepted: a test's name, \"Suite.Test\"");
  }
  std::string name(test);
  std::replace(name.begin(), name.end(), '/', '-');
  return name;
}

std::string run_name(std::uint64_t seed, int repetition) {
  if (repetition < 0) {
    throw std::invalid_argument("OutputFolder: repetition = " + std::to_string(repetition) +
                                "; accepted: 0 or more");
  }
  std::string name = "seed-" + std::to_string(seed);
  if (repetition > 0) name += ".rep" + std::to_string(repetition);
  return name;
}

[[noreturn]] void fail(const char* what, const fs::path& path, const std::error_code& why) {
  throw std::runtime_error("OutputFolder: " + path.string() + " cannot be " + what + ": " +
                           why.message());
}

void create_tree(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (!error && !fs::is_directory(folder, error))
    error = std::make_error_code(std::errc::not_a_directory);
  if (error) fail("created", folder, error);
}

void remove_tree(const fs::path& folder) {
  std::error_code error;
  fs::remove_all(folder, error);
  if (error) fail("removed", folder, error);
}

void clear_folder(const fs::path& folder) {
  std::error_code error;
  for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error))
    fs::remove_all(at->path(), error);
  if (error) fail("cleared", folder, error);
}

bool is_still_at(int folder, const fs::path& path) {
  struct stat held {
  }, named{};
  return fstat(folder, &held) == 0 && stat(path.c_str(), &named) == 0 &&
         held.st_dev == named.st_dev && held.st_ino == named.st_ino;
}

// Creates the folder, or takes over one that a killed run left. Nothing: a living run has it.
std::optional<int> claimed(const fs::path& folder) {
  std::error_code error;
  fs::create_directory(folder, error);
  if (error && error != std::errc::file_exists) fail("created", folder, error);
  const int handle = open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (handle < 0 && errno == ENOENT) return {};  // that run has just put it in place
  if (handle < 0) fail("opened", folder, std::error_code(errno, std::generic_category()));
  // The lock goes with the process, however it ends.
  if (flock(handle, LOCK_EX | LOCK_NB) == 0 && is_still_at(handle, folder)) return handle;
  ::close(handle);
  return {};
}

fs::path hidden_branch(const fs::path& folder, std::string_view name) {
  return folder / (".branch-" + std::string(name) + ".partial");
}

// Swaps two folders in one step. False: this file system cannot.
bool exchange(const fs::path& a, const fs::path& b) {
  if (renameat2(AT_FDCWD, a.c_str(), AT_FDCWD, b.c_str(), RENAME_EXCHANGE) == 0) return true;
  if (errno == EINVAL || errno == ENOSYS) return false;
  fail("replaced", b, std::error_code(errno, std::generic_category()));
}

}  // namespace

OutputFolder::OutputFolder(const fs::path& root, std::string_view test, std::uint64_t seed,
                           int repetition) {
  const fs::path parent = root / folder_name(test);
  const std::string run = run_name(seed, repetition);
  path_ = parent / run;
  create_tree(parent);
  std::optional<int> lock;
  for (int k = 1; !lock; ++k) {
    partial_ = parent / ("." + run + ".partial" + (k > 1 ? std::to_string(k) : ""));
    lock = claimed(partial_);
  }
  lock_ = *lock;
  clear_folder(partial_);
}

OutputFolder::~OutputFolder() {
  std::error_code ignored;
  if (!closed_) fs::remove_all(partial_, ignored);
  if (lock_ >= 0) ::close(lock_);
}

fs::path OutputFolder::file(const fs::path& relative) const {
  if (closed_) throw std::logic_error("OutputFolder: " + path_.string() + " is closed");
  const fs::path normal = relative.lexically_normal();
  if (normal.empty() || normal.is_absolute() || !normal.has_filename() || *normal.begin() == "..") {
    throw std::invalid_argument("OutputFolder::file: \"" + relative.string() +
                                "\"; accepted: a relative path within the folder");
  }
  create_tree((partial_ / normal).parent_path());
  return partial_ / normal;
}

void OutputFolder::close() {
  if (closed_) return;
  while (!try_to_put_in_place()) {
  }
  closed_ = true;
  if (lock_ >= 0) ::close(lock_);
  lock_ = -1;
}

void OutputFolder::enter_branch(std::string_view name) {
  if (closed_) throw std::logic_error("OutputFolder: " + path_.string() + " is closed");
  const std::string folder = "branch-" + std::string(name);
  path_ = partial_ / folder;
  partial_ = hidden_branch(partial_, name);
  ::close(lock_);
  lock_ = -1;
  create_tree(partial_);
}

void OutputFolder::keep_unfinished_branch(std::string_view name) noexcept {
  std::error_code error;
  const fs::path folder = partial_ / ("branch-" + std::string(name));
  fs::rename(hidden_branch(partial_, name), folder, error);
  if (error) fs::create_directory(folder, error);  // it wrote nothing, or closed it and then died
}

// False: another run of this name was put in place meanwhile.
bool OutputFolder::try_to_put_in_place() {
  std::error_code error;
  fs::rename(partial_, path_, error);
  if (!error) return true;
  if (error != std::errc::directory_not_empty && error != std::errc::file_exists)
    fail("put in place", path_, error);
  // The earlier run is locked until it is gone, so that nobody claims it under its hidden name.
  const int earlier = open(path_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (earlier < 0 && errno == ENOENT) return false;
  if (earlier < 0) fail("replaced", path_, std::error_code(errno, std::generic_category()));
  const bool mine = flock(earlier, LOCK_EX) == 0 && is_still_at(earlier, path_);
  if (mine) replace_earlier();
  ::close(earlier);
  return mine;
}

void OutputFolder::replace_earlier() {
  if (exchange(partial_, path_)) return remove_tree(partial_);
  // There is an instant at which no folder of this name exists, but never a mixture.
  remove_tree(path_);
  fs::rename(partial_, path_);
}

std::vector<UnfinishedRun> unfinished_runs(const fs::path& test_folder) {
  constexpr std::string_view kEnd = ".partial";
  std::vector<UnfinishedRun> runs;
  std::error_code ignored;  // another program may be putting one in its place
  for (const fs::directory_entry& entry : fs::directory_iterator(test_folder, ignored)) {
    const std::string name = entry.path().filename().string();
    const std::size_t end = name.rfind(kEnd);
    if (!name.starts_with(".seed-") || end == std::string::npos) continue;
    const int handle = open(entry.path().c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (handle < 0) continue;
    const bool is_running = flock(handle, LOCK_SH | LOCK_NB) != 0;
    // Gone from here meanwhile: it has just been closed.
    if (is_still_at(handle, entry.path())) {
      runs.push_back({entry.path(), name.substr(1, end - 1), is_running});
    }
    ::close(handle);
  }
  std::sort(runs.begin(), runs.end(),
            [](const UnfinishedRun& a, const UnfinishedRun& b) { return a.folder < b.folder; });
  return runs;
}

}  // namespace orrery
