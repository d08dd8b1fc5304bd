#include <orrery/harness/campaign/run_store.hpp>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string_view>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

namespace orrery {
namespace {

[[noreturn]] void fail(const std::string& path, const std::string& why) {
  throw std::runtime_error(path + ": " + why);
}

std::string content_of(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) fail(file.string(), "cannot be read");
  return {std::istreambuf_iterator<char>(in), {}};
}

// Where the whole lines of a file end.
off_t end_of_lines(int file, off_t size) {
  constexpr off_t kBlock = 4096;
  for (off_t end = size; end > 0;) {
    const off_t begin = std::max<off_t>(0, end - kBlock);
    std::string block(static_cast<std::size_t>(end - begin), ' ');
    const ssize_t n = pread(file, block.data(), block.size(), begin);
    if (n != static_cast<ssize_t>(block.size())) return size;
    const std::size_t found = block.rfind('\n');
    if (found != std::string::npos) return begin + static_cast<off_t>(found) + 1;
    end = begin;
  }
  return 0;
}

}  // namespace

RunStore::RunStore(const std::filesystem::path& file) : path_(file.string()) {
  file_ = open(path_.c_str(), O_RDWR | O_CREAT | O_APPEND | O_CLOEXEC, 0666);
  if (file_ < 0) fail(path_, std::strerror(errno));
  if (flock(file_, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
    close(file_);
    fail(path_, "another runner is writing to it");
  }
  struct stat info {};
  if (fstat(file_, &info) != 0) fail(path_, std::strerror(errno));
  const off_t end = end_of_lines(file_, info.st_size);
  if (end < info.st_size && ftruncate(file_, end) != 0) fail(path_, std::strerror(errno));
}

RunStore::~RunStore() {
  close(file_);
}

void RunStore::append(const RunRecord& record) {
  const std::string line = to_json_line(record) + "\n";
  ssize_t n = 0;
  while ((n = write(file_, line.data(), line.size())) < 0 && errno == EINTR) {
  }
  if (n == static_cast<ssize_t>(line.size())) return;
  fail(path_, n < 0 ? std::strerror(errno) : "a line was cut off: is the disk full?");
}

void MergedRuns::add(const RunRecord& record) {
  const auto [known, is_new] = runs.try_emplace(record.run, record);
  if (is_new) return;
  RunRecord& before = known->second;
  if (!is_result(before.outcome)) {
    before = record;
  } else if (is_result(record.outcome)) {
    const std::string what = record.difference_from(before);
    if (!what.empty()) contradictions.push_back({record.run, record.seed, what});
  }
}

std::vector<RunRecord> read_run_file(const std::filesystem::path& file) {
  const std::string content = content_of(file);
  std::vector<RunRecord> records;
  int number = 0;
  for (std::string_view rest = content; !rest.empty();) {
    const std::size_t end = rest.find('\n');
    if (end == std::string_view::npos) break;  // torn
    ++number;
    if (auto record = parse_run_record(rest.substr(0, end))) {
      records.push_back(std::move(*record));
    } else {
      fail(file.string(), "line " + std::to_string(number) + " is no record of a run");
    }
    rest.remove_prefix(end + 1);
  }
  return records;
}

std::vector<RunRecord> all_records(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    if (name.starts_with("runs") && name.ends_with(".jsonl")) files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  std::vector<RunRecord> records;
  for (const auto& file : files) {
    for (RunRecord& record : read_run_file(file)) records.push_back(std::move(record));
  }
  return records;
}

MergedRuns read_runs(const std::filesystem::path& folder) {
  MergedRuns merged;
  for (const RunRecord& record : all_records(folder)) merged.add(record);
  return merged;
}

}  // namespace orrery
