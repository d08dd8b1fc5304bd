#include <orrery/harness/record/output_folder.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>
#include <sys/wait.h>
#include <unistd.h>
#include <vector>

#include "scratch_folder.hpp"

namespace orrery {
namespace {

namespace fs = std::filesystem;

void write(const fs::path& path, std::string_view text) {
  std::ofstream(path, std::ios::binary) << text;
}

// Every file and folder below, relative.
std::set<std::string> tree(const fs::path& root) {
  std::set<std::string> paths;
  for (const auto& entry : fs::recursive_directory_iterator(root)) {
    paths.insert(entry.path().lexically_relative(root).string());
  }
  return paths;
}

struct OutputFolderTest : testing::Test {
  ScratchFolder root;
};

TEST_F(OutputFolderTest, FilesAppearTogetherWhenItCloses) {
  OutputFolder folder(root.path(), "BeaconTest.Beats", 42);
  EXPECT_EQ(folder.path(), root / "BeaconTest.Beats/seed-42");
  write(folder.file("summary.json"), "{}");
  write(folder.file("truth/dsc.csv"), "t\n");
  EXPECT_FALSE(fs::exists(folder.path()));
  folder.close();
  EXPECT_THAT(tree(root.path()),
              testing::ElementsAre("BeaconTest.Beats", "BeaconTest.Beats/seed-42",
                                   "BeaconTest.Beats/seed-42/summary.json",
                                   "BeaconTest.Beats/seed-42/truth",
                                   "BeaconTest.Beats/seed-42/truth/dsc.csv"));
}

TEST_F(OutputFolderTest, EarlierRunIsReplacedWhole) {
  for (const char* name : {"old.csv", "new.csv"}) {
    OutputFolder folder(root.path(), "A.B", 1);
    write(folder.file(name), name);
    folder.close();
  }
  EXPECT_THAT(tree(root / "A.B"), testing::ElementsAre("seed-1", "seed-1/new.csv"));
}

TEST_F(OutputFolderTest, EarlierRunStaysUntilTheNextOneCloses) {
  {
    OutputFolder folder(root.path(), "A.B", 1);
    write(folder.file("old.csv"), "");
    folder.close();
  }
  {
    OutputFolder abandoned(root.path(), "A.B", 1);
    write(abandoned.file("new.csv"), "");
    EXPECT_TRUE(fs::exists(root / "A.B/seed-1/old.csv"));
  }
  EXPECT_THAT(tree(root / "A.B"), testing::ElementsAre("seed-1", "seed-1/old.csv"));
}

TEST_F(OutputFolderTest, RemainsOfAKilledRunAreNotMixedIn) {
  fs::create_directories(root / "A.B/.seed-1.partial");
  write(root / "A.B/.seed-1.partial/torn.csv", "");
  OutputFolder folder(root.path(), "A.B", 1);
  write(folder.file("a.csv"), "");
  folder.close();
  EXPECT_THAT(tree(root / "A.B"), testing::ElementsAre("seed-1", "seed-1/a.csv"));
}

TEST_F(OutputFolderTest, RunsSideBySideDoNotMixAndTheLastOneStays) {
  OutputFolder first(root.path(), "A.B", 1), second(root.path(), "A.B", 1);
  write(first.file("first.csv"), "");
  write(second.file("second.csv"), "");
  second.close();
  EXPECT_THAT(tree(root / "A.B/seed-1"), testing::ElementsAre("second.csv"));
  OutputFolder third(root.path(), "A.B", 1);
  write(third.file("third.csv"), "");
  first.close();
  EXPECT_THAT(tree(root / "A.B/seed-1"), testing::ElementsAre("first.csv"));
  third.close();
  EXPECT_THAT(tree(root / "A.B"), testing::ElementsAre("seed-1", "seed-1/third.csv"));
}

// What a child of the test below does; its exit code. Nothing may leave it: it is a copy of the
// whole test program.
int run_many_times(const fs::path& root, int program) noexcept {
  for (int run = 0; run < 25; ++run) {
    OutputFolder folder(root, "A.B", 1);
    for (const char* name : {"a.csv", "b.csv", "c.csv"})
      write(folder.file(name), std::to_string(1000 * program + run));
    folder.close();
  }
  return 0;
}

TEST_F(OutputFolderTest, ProgramsSideBySideLeaveOneWholeRun) {
  std::vector<pid_t> children;
  for (int program = 0; program < 4; ++program) {
    const pid_t child = fork();
    ASSERT_GE(child, 0);
    if (child == 0) _exit(run_many_times(root.path(), program));
    children.push_back(child);
  }
  for (const pid_t child : children) {
    int status = -1;
    waitpid(child, &status, 0);
    EXPECT_EQ(status, 0);
  }
  EXPECT_THAT(tree(root / "A.B"),
              testing::ElementsAre("seed-1", "seed-1/a.csv", "seed-1/b.csv", "seed-1/c.csv"));
  const std::string content = content_of(root / "A.B/seed-1/a.csv");
  EXPECT_EQ(content_of(root / "A.B/seed-1/b.csv"), content);
  EXPECT_EQ(content_of(root / "A.B/seed-1/c.csv"), content);
}

TEST_F(OutputFolderTest, SlashesOfParameterisedTestsBecomeDashes) {
  OutputFolder folder(root.path(), "Seeds/SwarmTest.NeverCollides/17", 18);
  folder.close();
  EXPECT_EQ(folder.path(), root / "Seeds-SwarmTest.NeverCollides-17/seed-18");
  EXPECT_TRUE(fs::is_directory(folder.path()));
}

TEST_F(OutputFolderTest, RepetitionsHaveFoldersOfTheirOwn) {
  EXPECT_EQ(OutputFolder(root.path(), "A.B", 3, 0).path(), root / "A.B/seed-3");
  EXPECT_EQ(OutputFolder(root.path(), "A.B", 3, 2).path(), root / "A.B/seed-3.rep2");
}

TEST_F(OutputFolderTest, PathsThatLeadOutsideAreRefused) {
  const OutputFolder folder(root.path(), "A.B", 1);
  EXPECT_THROW(folder.file("/etc/passwd"), std::invalid_argument);
  EXPECT_THROW(folder.file("../x"), std::invalid_argument);
  EXPECT_THROW(folder.file("truth/../../x"), std::invalid_argument);
  EXPECT_THROW(folder.file(""), std::invalid_argument);
  EXPECT_THROW(folder.file("truth/"), std::invalid_argument);
}

TEST_F(OutputFolderTest, ClosedFolderTakesNoMoreFiles) {
  OutputFolder folder(root.path(), "A.B", 1);
  folder.close();
  folder.close();
  EXPECT_THROW(folder.file("late.csv"), std::logic_error);
}

TEST_F(OutputFolderTest, NamesThatAreNoTestsAreRefused) {
  EXPECT_THROW(OutputFolder(root.path(), "", 1), std::invalid_argument);
  EXPECT_THROW(OutputFolder(root.path(), "../up", 1), std::invalid_argument);
  EXPECT_THROW(OutputFolder(root.path(), "a\nb", 1), std::invalid_argument);
  EXPECT_THROW(OutputFolder(root.path(), "A.B", 1, -1), std::invalid_argument);
}

TEST_F(OutputFolderTest, RootThatIsAFileIsNamed) {
  write(root / "occupied", "");
  EXPECT_THAT(
      [&] { OutputFolder folder(root / "occupied", "A.B", 1); },
      testing::ThrowsMessage<std::runtime_error>(testing::HasSubstr((root / "occupied").string())));
}

}  // namespace
}  // namespace orrery
