// Property: orrery-heap-replay says of a trace what replay() says, and names what it cannot read.
#include <orrery/harness/heap/heap_trace.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <fstream>
#include <string>
#include <sys/wait.h>
#include <unistd.h>

namespace orrery {
namespace {

using testing::AllOf;
using testing::ContainsRegex;
using testing::HasSubstr;

struct Said {
  int exit_code;
  std::string text;
};

Said run(const std::string& arguments) {
  FILE* pipe = popen((ORRERY_HEAP_REPLAY " " + arguments + " 2>&1").c_str(), "r");
  std::string text;
  char buffer[4096];
  while (const std::size_t n = std::fread(buffer, 1, sizeof buffer, pipe)) text.append(buffer, n);
  return {WEXITSTATUS(pclose(pipe)), text};
}

class HeapReplayProgramTest : public testing::Test {
 protected:
  // Blocks of 24, 104 and 24 bytes (alignment 8: 16, 96 and 16 asked for); the second is freed, and
  // 200 are asked for, so that the heap is 24 + 104 + 24 + 208 bytes with a hole of 104.
  HeapReplayProgramTest() {
    HeapTraceWriter writer(from_ns(1'000));
    char blocks[4];
    writer.malloc(&blocks[0], 16);
    writer.malloc(&blocks[1], 96);
    writer.malloc(&blocks[2], 16);
    writer.call_returned(from_ns(2'000));
    writer.free(&blocks[1]);
    writer.malloc(&blocks[3], 200);
    writer.call_returned(from_ns(3'000));
    const Bytes trace = writer.trace();
    std::ofstream(path_, std::ios::binary)
        .write(reinterpret_cast<const char*>(trace.data()),
               static_cast<std::streamsize>(trace.size()));
  }
  ~HeapReplayProgramTest() override {
    std::remove(path_.c_str());
    std::remove((path_ + ".csv").c_str());
  }
  const std::string path_ = testing::TempDir() + "orrery_heap_replay_" + std::to_string(getpid());
};

TEST_F(HeapReplayProgramTest, PrintsTheFiguresOfEachPolicy) {
  const Said said = run(path_ + " --alignment=8");
  EXPECT_EQ(said.exit_code, 0) << said.text;
  for (const char* policy : {"first-fit", "best-fit", "next-fit", "heap-4", "newlib"}) {
    EXPECT_THAT(said.text, ContainsRegex(std::string(policy) + " +360 +256 +104 +1 +4 +0 "));
  }
  // A block of TLSF is 32 bytes at least: 32 + 104 + 32 + 208.
  EXPECT_THAT(said.text, ContainsRegex("tlsf +376 +272 +104 +1 +4 +0 "));
}

TEST_F(HeapReplayProgramTest, CountsWhatALimitRefuses) {
  const Said said = run(path_ + " --alignment=8 --policy=first-fit --limit=200");
  EXPECT_EQ(said.exit_code, 1);
  EXPECT_THAT(said.text, ContainsRegex("first-fit +152 +152 +104 +1 +3 +1 "));
}

TEST_F(HeapReplayProgramTest, WritesARowPerCall) {
  EXPECT_EQ(run(path_ + " --alignment=8 --policy=first-fit --history=" + path_ + ".csv").exit_code,
            0);
  std::ifstream file(path_ + ".csv");
  std::string header, first, second;
  std::getline(file, header);
  std::getline(file, first);
  std::getline(file, second);
  EXPECT_EQ(first, "0.000001000,152,152,152,0,0,3");
  EXPECT_EQ(second, "0.000002000,256,256,360,104,1,1");
}

TEST_F(HeapReplayProgramTest, NamesWhatItCannotUse) {
  EXPECT_THAT(run("/nonexistent.trace").text, HasSubstr("/nonexistent.trace: No such file"));
  EXPECT_THAT(run(path_ + " --policy=worst-fit").text,
              AllOf(HasSubstr("\"worst-fit\""), HasSubstr("heap-4 newlib")));
  EXPECT_THAT(run(path_ + " --alignment=12").text, HasSubstr("it is 8 or 16"));
  EXPECT_THAT(run(path_ + " --limit=1k").text, HasSubstr("--limit takes a number of bytes"));
  EXPECT_THAT(run(path_ + " --history=x").text, HasSubstr("--history needs --policy"));
  for (const char* bad : {"/nonexistent.trace", "--speed", ""}) EXPECT_EQ(run(bad).exit_code, 2);
}

}  // namespace
}  // namespace orrery
