#include <orrery/harness/record/output_folder.hpp>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <fcntl.h>
#include <stdexcept>
#include <system_error>

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
  partial_ = parent / ("." + run + ".partial");
  remove_tree(partial_);
  create_tree(partial_);
}

OutputFolder::~OutputFolder() {
  if (closed_) return;
  std::error_code ignored;
  fs::remove_all(partial_, ignored);
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
  std::error_code error;
  if (fs::exists(path_)) {
    // After the exchange the earlier run is in partial_. Without it there is an instant at which
    // no folder of this name exists, but never a mixture.
    if (!exchange(partial_, path_)) {
      remove_tree(path_);
      fs::rename(partial_, path_, error);
    }
  } else {
    fs::rename(partial_, path_, error);
  }
  if (error) fail("put in place", path_, error);
  closed_ = true;
  remove_tree(partial_);
}

}  // namespace orrery
