/// The folder of one test's files: there complete, or not at all.
#pragma once

#include <orrery/harness/kernel/simulator_only.hpp>

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace orrery {

/// `root/<Suite>.<Test>/seed-<N>`, with `.rep<k>` after it for repetition k >= 1.
///
/// Files are written to a hidden folder beside it, which close() puts in its place: a reader sees
/// the earlier run's folder or this one's, never a mixture. What a killed run left is removed by
/// the next run of the same name. Two at once (their programs started side by side) write apart,
/// and the one that closes last stays.
class OutputFolder {
 public:
  /// Creates the folders. `test`: "Suite.Test"; '/' in it becomes '-'.
  /// @throws std::invalid_argument  `test` empty, beginning with '.', or holding a backslash or
  ///                                a control character; repetition < 0.
  ///         std::runtime_error     a folder cannot be created; the message names it.
  OutputFolder(const std::filesystem::path& root, std::string_view test, std::uint64_t seed,
               int repetition = 0);
  /// Without close() nothing remains of what was written.
  ~OutputFolder();
  OutputFolder(const OutputFolder&) = delete;
  OutputFolder& operator=(const OutputFolder&) = delete;

  /// Where to write the file of that relative path ("truth/dsc.csv"); its folder is created.
  /// @throws std::invalid_argument  an absolute path or one that leads outside.
  ///         std::logic_error       after close(). std::runtime_error  as above.
  std::filesystem::path file(const std::filesystem::path& relative) const;

  /// In a child process after a fork: files go to the folder `branch-<name>` within this one from
  /// here on, which close() puts in its place there. The parent's lock stays the parent's.
  /// @throws as the constructor.
  void enter_branch(std::string_view name);
  /// In the parent, for a branch that did not close its folder: what it has written is in
  /// `branch-<name>` all the same, as far as it came; nothing else tells why it ended.
  void keep_unfinished_branch(std::string_view name) noexcept;

  /// Where the files are once closed.
  const std::filesystem::path& path() const { return path_; }

  /// Files must be closed before. @throws std::runtime_error  the folder cannot be put in place.
  void close();

 private:
  bool try_to_put_in_place();
  void replace_earlier();

  std::filesystem::path path_, partial_;
  int lock_ = -1;  // of partial_, while this object lives
  bool closed_ = false;
};

/// A run that has not closed its folder.
struct UnfinishedRun {
  std::filesystem::path folder;  // hidden, with what it has written so far
  std::string run;               // "seed-5"
  bool is_running = false;       // false: its process was killed
};
/// Of one test, in the order of their names. @param test_folder  DIR/<Suite>.<Test>
std::vector<UnfinishedRun> unfinished_runs(const std::filesystem::path& test_folder);

}  // namespace orrery
