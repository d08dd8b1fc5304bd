#include <orrery/harness/gtest/child_process.hpp>
#include <orrery/harness/gtest/run_trace.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <sstream>
#include <stdexcept>
#include <string>

namespace orrery {
namespace {

RunTrace trace(std::uint64_t seed, std::vector<std::uint64_t> checkpoints,
               const std::string& fingerprint) {
  return {.seed = seed,
          .events = 4096 * checkpoints.size() + 17,
          .fingerprint = fingerprint,
          .random_fingerprint = "0badcafe",
          .checkpoints = std::move(checkpoints)};
}

TEST(RunTraceTest, ReadsBackWhatItWrote) {
  std::vector<RunTrace> traces = {trace(1, {0x123456789abcdef0u, 2}, "aa"), trace(2, {}, "bb")};
  traces[0].unordered = "0123456789abcdef";
  traces[0].instants = {{4099, 7}, {8200, 0xfedcba9876543210u}};
  traces[1].log = {"frame arrival of deputy from chief-deputy at 3610 s, chain 00", ""};
  std::stringstream text;
  write_traces(traces, text);
  EXPECT_EQ(read_traces(text), traces);
}

TEST(RunTraceTest, RefusesTextThatWasCutAnywhere) {
  std::vector<RunTrace> traces = {trace(1, {7, 8}, "aa")};
  traces[0].log = {"an event"};
  std::stringstream written;
  write_traces(traces, written);
  const std::string text = written.str();
  for (std::size_t length = 0; length + 1 < text.size(); ++length) {
    std::istringstream cut(text.substr(0, length));
    EXPECT_THROW(read_traces(cut), std::runtime_error) << length;
  }
  std::istringstream wrong("runs many\n");
  EXPECT_THROW(read_traces(wrong), std::runtime_error);
}

TEST(RunTraceTest, ADifferenceLiesAfterTheLastEqualCheckpoint) {
  const std::vector<RunTrace> a = {trace(1, {5, 6, 7, 8}, "aa")};
  EXPECT_FALSE(first_difference(a, a));
  const auto difference = first_difference(a, {trace(1, {5, 6, 70, 80}, "bb")});
  ASSERT_TRUE(difference);
  EXPECT_EQ(difference->run, 0u);
  EXPECT_EQ(difference->from_event, 2u * 4096);
  EXPECT_EQ(difference->until_event, 3u * 4096);
  EXPECT_THAT(difference->text, testing::HasSubstr("the run (seed 1): fingerprint aa"));
}

// Of runs with other ties the ordered fingerprints say nothing; the instants tell where to look.
TEST(RunTraceTest, AnUnorderedDifferenceLiesAfterTheLastEqualInstant) {
  std::vector<RunTrace> a = {trace(1, {5, 6}, "aa")}, b = {trace(1, {7, 8}, "bb")};
  a[0].unordered = b[0].unordered = "cc";
  EXPECT_FALSE(first_unordered_difference(a, b));
  a[0].instants = {{4099, 1}, {8200, 2}};
  b[0].instants = {{4099, 1}, {8200, 3}};
  b[0].unordered = "dd";
  const auto difference = first_unordered_difference(a, b);
  ASSERT_TRUE(difference);
  EXPECT_EQ(difference->from_event, 4099u);
  EXPECT_EQ(difference->until_event, 4099u + 2 * 4096);
  EXPECT_EQ(difference->text, "the run (seed 1) depends on tie order");
  b.pop_back();
  EXPECT_TRUE(first_unordered_difference(a, b));
}

TEST(RunTraceTest, ASecondRunOrAMissingOneIsNamed) {
  const std::vector<RunTrace> two = {trace(1, {5}, "aa"), trace(2, {6}, "bb")};
  const auto second = first_difference(two, {two[0], trace(2, {6}, "cc")});
  ASSERT_TRUE(second);
  EXPECT_EQ(second->run, 1u);
  EXPECT_EQ(second->from_event, 4096u);  // all checkpoints are equal: after the last
  EXPECT_THAT(second->text, testing::HasSubstr("run 2 of the test (seed 2)"));
  const auto missing = first_difference(two, {two[0]});
  ASSERT_TRUE(missing);
  EXPECT_THAT(missing->text, testing::HasSubstr("made 2 runs; repeated, 1"));
}

TEST(RunTraceTest, LogsAreComparedLineByLine) {
  RunTrace a, b;
  a.log = {"one", "two", "three"};
  b.log = {"one", "zwei", "three"};
  EXPECT_EQ(describe_log_difference(a, b), "  first run: two\n  repeated:  zwei");
  b.log = {"one"};
  EXPECT_EQ(describe_log_difference(a, b), "  first run: two\n  repeated:  (no event)");
  EXPECT_EQ(describe_log_difference(a, a), "");
}

// What the tests below run as a child.
TEST(ChildHelper, DISABLED_Exits) {
  std::printf("the environment says %s\n", std::getenv("CHILD_WORD"));
  std::fflush(stdout);
  std::_Exit(std::getenv("GTEST_BRIEF_PARENT") == nullptr ? 7 : 8);
}
TEST(ChildHelper, DISABLED_IsKilled) {
  raise(SIGKILL);
}

ChildOutcome run_helper(const std::string& name) {
  return run_child({.arguments = {"--gtest_filter=ChildHelper.DISABLED_" + name,
                                  "--gtest_also_run_disabled_tests"},
                    .environment = {"CHILD_WORD=" + std::string(5000, 'x') + "end"}});
}

TEST(ChildProcessTest, TellsExitCodeAndTheEndOfItsOutput) {
  setenv("GTEST_BRIEF_PARENT", "1", 1);  // must not reach the child, as nothing of GoogleTest's
  const ChildOutcome outcome = run_helper("Exits");
  unsetenv("GTEST_BRIEF_PARENT");
  EXPECT_EQ(outcome.exit_code, 7);
  EXPECT_FALSE(outcome.passed());
  EXPECT_EQ(outcome.describe(), "ended with exit code 7");
  EXPECT_EQ(outcome.tail.size(), 4096u);
  EXPECT_TRUE(outcome.tail.ends_with("xxend\n"));
}

TEST(ChildProcessTest, TellsTheSignalThatEndedIt) {
  const ChildOutcome outcome = run_helper("IsKilled");
  EXPECT_EQ(outcome.signal, SIGKILL);
  EXPECT_EQ(outcome.describe(), "was ended by signal 9");
}

}  // namespace
}  // namespace orrery
