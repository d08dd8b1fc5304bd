#include <orrery/harness/gtest/flags.hpp>
#include <orrery/harness/gtest/requirements.hpp>
#include <orrery/harness/record/output_file.hpp>

#include <algorithm>
#include <cerrno>
#include <fcntl.h>
#include <fstream>
#include <map>
#include <stdexcept>
#include <sys/file.h>
#include <system_error>
#include <tuple>
#include <unistd.h>

namespace orrery {
namespace {

namespace fs = std::filesystem;
using internal::RequirementRow;

constexpr std::string_view kHeader = "requirement,test,seed,result";

// By requirement, test, seed: the result.
using Table = std::map<std::tuple<std::string, std::string, std::string>, std::string>;

std::vector<std::string>& of_this_test() {
  static std::vector<std::string> ids;
  return ids;
}

bool is_id(std::string_view id) {
  const auto fits = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
           std::string_view("-_./:").find(c) != std::string_view::npos;
  };
  return !id.empty() && std::all_of(id.begin(), id.end(), fits);
}

// Held by one program at a time; the file stays, so that nobody locks one that is gone.
class Lock {
 public:
  explicit Lock(const fs::path& path)
      : file_(open(path.c_str(), O_CREAT | O_RDWR | O_CLOEXEC, 0666)) {
    int result = -1;
    while (file_ >= 0 && (result = flock(file_, LOCK_EX)) != 0 && errno == EINTR) {
    }
    if (result == 0) return;
    const std::error_code why(errno, std::generic_category());
    if (file_ >= 0) close(file_);
    throw std::runtime_error(path.string() + " cannot be locked: " + why.message());
  }
  ~Lock() { close(file_); }
  Lock(const Lock&) = delete;
  Lock& operator=(const Lock&) = delete;

 private:
  int file_;
};

// Neither ids nor names of tests have commas.
Table read(const fs::path& path) {
  Table table;
  std::ifstream in(path);
  std::string line;
  for (int number = 1; std::getline(in, line); ++number) {
    if (number == 1 && line == kHeader) continue;
    std::vector<std::string> fields;
    for (std::size_t begin = 0; begin <= line.size();) {
      const std::size_t end = std::min(line.find(',', begin), line.size());
      fields.push_back(line.substr(begin, end - begin));
      begin = end + 1;
    }
    if (number == 1 || fields.size() != 4) {
      throw std::runtime_error(path.string() + ":" + std::to_string(number) + ": \"" + line +
                               "\"; expected " + std::string(kHeader));
    }
    table[{fields[0], fields[1], fields[2]}] = fields[3];
  }
  return table;
}

void replace(const fs::path& path, const std::string& text) {
  fs::path partial = path;
  partial += ".partial";
  OutputFile file(partial);
  file.write(text);
  file.close();
  fs::rename(partial, path);
}

std::string to_csv(const Table& table) {
  std::string text = std::string(kHeader) + "\n";
  for (const auto& [key, result] : table) {
    const auto& [requirement, test, seed] = key;
    text += requirement + "," + test + "," + seed + "," + result + "\n";
  }
  return text;
}

// What the results of its tests, joined, say of a requirement.
std::string verdict(const std::string& results) {
  for (const char* bad : {"failed", "incomplete"}) {
    if (results.find(bad) != std::string::npos) return bad;
  }
  return results.find("passed") != std::string::npos ? "verified" : "not verified";
}

std::string to_markdown(const Table& table) {
  std::map<std::string, std::pair<std::string, std::string>> lines;  // tests, results
  for (const auto& [key, result] : table) {
    const auto& [requirement, test, seed] = key;
    auto& [tests, results] = lines[requirement];
    tests += (tests.empty() ? "" : "; ") + test + " (seed " + seed + "): " + result;
    results += result + " ";
  }
  std::string text = "| requirement | result | tests |\n|---|---|---|\n";
  for (const auto& [requirement, line] : lines) {
    text += "| " + requirement + " | " + verdict(line.second) + " | " + line.first + " |\n";
  }
  return text;
}

std::string name_of(const testing::TestInfo& test) {
  return std::string(test.test_suite_name()) + "." + test.name();
}

void record(const std::string& test, const std::string& result,
            const std::vector<std::string>& ids) {
  if (flags().out.empty() || ids.empty()) return;
  std::vector<RequirementRow> rows;
  for (const std::string& id : ids) {
    rows.push_back({id, test, std::to_string(flags().seed), result});
  }
  internal::update_requirements(flags().out, rows);
}

}  // namespace

void verifies_requirements(std::initializer_list<std::string_view> ids) {
  const testing::TestInfo* test = testing::UnitTest::GetInstance()->current_test_info();
  if (test == nullptr) throw std::logic_error("TEST_REQUIREMENT: no test is running");
  std::vector<std::string>& known = of_this_test();
  for (const std::string_view id : ids) {
    if (!is_id(id)) {
      throw std::invalid_argument("TEST_REQUIREMENT: \"" + std::string(id) +
                                  "\"; accepted: letters, digits and - _ . / :");
    }
    if (std::find(known.begin(), known.end(), id) == known.end()) known.emplace_back(id);
  }
  std::string all;
  for (const std::string& id : known) all += (all.empty() ? "" : ", ") + id;
  testing::Test::RecordProperty("requirement", all);
  record(name_of(*test), "incomplete", known);
}

namespace internal {

void update_requirements(const fs::path& folder, const std::vector<RequirementRow>& rows) {
  fs::create_directories(folder);
  const Lock lock(folder / ".requirements.lock");
  Table table = read(folder / "requirements.csv");
  for (const RequirementRow& row : rows) table[{row.requirement, row.test, row.seed}] = row.result;
  replace(folder / "requirements.csv", to_csv(table));
  replace(folder / "requirements.md", to_markdown(table));
}

void begin_requirements() {
  of_this_test().clear();
}

void end_requirements(const testing::TestInfo& test) {
  const testing::TestResult& result = *test.result();
  const char* word = result.Failed() ? "failed" : result.Skipped() ? "skipped" : "passed";
  try {
    record(name_of(test), word, of_this_test());
  } catch (const std::exception& error) {
    ADD_FAILURE() << "the table of requirements could not be written: " << error.what();
  }
}

}  // namespace internal
}  // namespace orrery
