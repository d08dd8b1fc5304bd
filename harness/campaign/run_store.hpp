/// Results of runs in a folder: a line of JSON each, in one file per runner.
#pragma once

#include <orrery/harness/gtest/run_record.hpp>

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace orrery {

/// Appends to one file. A line goes out in one write, to the end of the file whoever else writes:
/// a runner that is killed loses the runs in flight and no more.
class RunStore {
 public:
  /// Opens or makes `file`. A torn last line, of a runner that was killed or a full disk, is cut
  /// off. @throws std::runtime_error  it cannot be opened, or another runner has it.
  explicit RunStore(const std::filesystem::path& file);
  ~RunStore();
  RunStore(const RunStore&) = delete;
  RunStore& operator=(const RunStore&) = delete;
  /// @throws std::runtime_error  the disk is full, say.
  void append(const RunRecord& record);

 private:
  std::string path_;
  int file_ = -1;
};

/// The same run with another result: what must not be.
struct Contradiction {
  std::uint32_t run = 0;
  std::uint64_t seed = 0;
  std::string what;  // "the fingerprint is 0123456789abcdef, was ..."
};

/// What several files, or several tries of a run, say together.
struct MergedRuns {
  /// By index. Of several results of a run the first counts; a result counts before what a host
  /// did.
  std::map<std::uint32_t, RunRecord> runs = {};
  std::vector<Contradiction> contradictions = {};

  void add(const RunRecord& record);
};

/// All files runs*.jsonl of a folder, in the order of their names. The torn last line of a file is
/// passed over. @throws std::runtime_error  another line that is no record: file, line.
MergedRuns read_runs(const std::filesystem::path& folder);
/// The same one by one, every try of a run. @throws as above.
std::vector<RunRecord> all_records(const std::filesystem::path& folder);
/// The records of one file. @throws as above.
std::vector<RunRecord> read_run_file(const std::filesystem::path& file);

}  // namespace orrery
