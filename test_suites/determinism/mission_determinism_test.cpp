// The reference mission (MISSION_PROGRAM) is run as a child under conditions that must not matter.
#include <orrery/harness/record/folder_comparison.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <sys/wait.h>
#include <vector>

using namespace orrery;

namespace {

namespace fs = std::filesystem;

struct Outcome {
  std::string text;
  int exit_code = -1;
};

Outcome run(const std::string& command) {
  FILE* pipe = popen((command + " 2>&1").c_str(), "r");
  Outcome outcome;
  std::array<char, 4096> buffer;
  while (const std::size_t n = fread(buffer.data(), 1, buffer.size(), pipe)) {
    outcome.text.append(buffer.data(), n);
  }
  const int status = pclose(pipe);
  outcome.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  return outcome;
}

/// The first of the mission's seeds, with nothing inherited from the surrounding ctest.
std::string mission(const std::string& flags, const std::string& environment = {}) {
  return "env -u GTEST_FILTER -u GTEST_TOTAL_SHARDS -u GTEST_SHARD_INDEX -u ORRERY_SEED " +
         environment + " " + MISSION_PROGRAM +
         " --gtest_filter='Seeds/FormationReconfigurationTest.*/0' --orrery_progress " + flags;
}

std::string fingerprint_of(const Outcome& outcome) {
  EXPECT_EQ(outcome.exit_code, 0) << outcome.text;
  const std::string label = "  fingerprint ";
  const std::size_t at = outcome.text.find(label);
  if (at == std::string::npos) return "none printed";
  const std::size_t begin = outcome.text.find_first_not_of(' ', at + label.size());
  return outcome.text.substr(begin, 16);
}

/// A folder of its own for each test, removed at the end.
class MissionDeterminismTest : public testing::Test {
 protected:
  MissionDeterminismTest() {
    std::string pattern = (fs::temp_directory_path() / "orrery_determinism_XXXXXX").string();
    folder_ = mkdtemp(pattern.data());
  }
  ~MissionDeterminismTest() override { fs::remove_all(folder_); }

  std::string out(const std::string& name) const {
    return "--orrery_out=" + (folder_ / name).string();
  }
  fs::path folder_;
};

}  // namespace

TEST_F(MissionDeterminismTest, RecordingLogsAndEnvironmentChangeNoFingerprint) {
  const std::string plain = fingerprint_of(run(mission("")));
  EXPECT_EQ(plain.size(), 16u);
  EXPECT_EQ(fingerprint_of(run(mission(out("a")))), plain);
  EXPECT_EQ(fingerprint_of(run(mission(out("b") + " --orrery_record=7s"))), plain);
  EXPECT_EQ(fingerprint_of(run(mission(out("c") + " --orrery_record=off"))), plain);
  EXPECT_EQ(fingerprint_of(run(mission("--orrery_log=debug"))), plain);
  const std::string large = "PADDING=" + std::string(20000, 'x');
  EXPECT_EQ(fingerprint_of(run(mission("", large))), plain);
  EXPECT_NE(fingerprint_of(run(mission("--orrery_seed=2"))), plain);
}

// The paper's three checks: a hash of 32 bits over the random streams, SHA-256 of the analysis, and
// the figures (report.html without its lines on the host).
TEST_F(MissionDeterminismTest, HashAnalysisAndFiguresAgree) {
  struct Checks {
    fs::path folder;
    std::string random, digest;
  };
  const auto checks = [this](const std::string& name, const std::string& flags) {
    EXPECT_EQ(run(mission(out(name) + flags)).exit_code, 0);
    Checks found{folder_ / name, "", ""};
    for (const auto& entry : fs::recursive_directory_iterator(found.folder)) {
      if (entry.path().filename() != "summary.json") continue;
      found.folder = entry.path().parent_path();
      std::ifstream file(entry.path());
      const std::string text(std::istreambuf_iterator<char>(file), {});
      const auto value = [&text](const std::string& key) {
        const std::size_t at = text.find("\"" + key + "\": \"") + key.size() + 5;
        return text.substr(at, text.find('"', at) - at);
      };
      found.random = value("random_fingerprint");
      found.digest = value("digest");
      break;
    }
    return found;
  };
  const auto figures_differ = [](const Checks& a, const Checks& b) {
    const std::vector<FileDifference> all = compare_folders(a.folder, b.folder);
    return std::any_of(all.begin(), all.end(),
                       [](const FileDifference& d) { return d.file == "report.html"; });
  };
  const Checks a = checks("a", ""), b = checks("b", ""), other = checks("c", " --orrery_seed=2");
  EXPECT_EQ(a.random.size(), 8u);
  EXPECT_EQ(a.digest.size(), 64u);
  EXPECT_EQ(a.random, b.random);
  EXPECT_EQ(a.digest, b.digest);
  EXPECT_FALSE(figures_differ(a, b));
  EXPECT_NE(a.random, other.random);
  EXPECT_NE(a.digest, other.digest);
  EXPECT_TRUE(figures_differ(a, other));
}

// In another order of ties too: what comes at one instant is a set to this mission.
TEST_F(MissionDeterminismTest, TheMissionDoesNotDependOnTieOrder) {
  const Outcome outcome = run(mission("--orrery_shuffle_ties=11"));
  EXPECT_EQ(outcome.exit_code, 0) << outcome.text;
}

// Again as a child, with scattered heaps, other addresses, another environment, recorded and
// logged.
TEST_F(MissionDeterminismTest, TheMissionVerifiesItself) {
  const Outcome outcome = run(mission("--orrery_verify_determinism"));
  EXPECT_EQ(outcome.exit_code, 0) << outcome.text;
  EXPECT_EQ(fingerprint_of(outcome), fingerprint_of(run(mission(""))));
}

// The kernel places stack, heap and libraries anew for each of these runs unless it is told not to.
TEST_F(MissionDeterminismTest, AddressesChangeNoFingerprint) {
  const std::string anywhere = fingerprint_of(run(mission("")));
  const Outcome fixed = run("setarch -R " + mission(""));
  if (fixed.exit_code != 0 && fixed.text.find("setarch") != std::string::npos) {
    GTEST_SKIP() << "this machine does not let a program switch address randomisation off";
  }
  EXPECT_EQ(fingerprint_of(fixed), anywhere);
}

TEST_F(MissionDeterminismTest, EqualRunsWriteEqualFiles) {
  ASSERT_EQ(run(mission(out("a"))).exit_code, 0);
  ASSERT_EQ(run(mission(out("b"))).exit_code, 0);
  int written = 0;
  for (const auto& entry : fs::recursive_directory_iterator(folder_ / "a")) {
    const bool hidden = entry.path().filename().string().starts_with('.');  // a lock
    if (!entry.is_regular_file() || hidden) continue;
    ++written;
    EXPECT_GT(entry.file_size(), 0u) << entry.path();
  }
  EXPECT_GE(written, 9);  // truth, links and GNSS of both, and the summary
  for (const FileDifference& difference : compare_folders(folder_ / "a", folder_ / "b")) {
    ADD_FAILURE() << difference.file << ": " << difference.text;
  }
}
