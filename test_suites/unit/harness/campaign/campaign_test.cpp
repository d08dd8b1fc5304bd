// fly_campaign() as a user sees it: campaign_program, run as a program.
#include <orrery/harness/campaign/campaign.hpp>
#include <orrery/harness/campaign/run_store.hpp>
#include <orrery/harness/gtest/channel_matchers.hpp>
#include <orrery/harness/gtest/child_process.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <fstream>
#include <limits>
#include <stdexcept>
#include <string>
#include <sys/wait.h>

namespace orrery {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

struct Ended {
  int code = -1;
  std::string output;
};

Ended run(const std::string& arguments, const std::string& environment = "") {
  const std::string command = environment + " " CAMPAIGN_PROGRAM " " + arguments + " 2>&1";
  Ended ended;
  FILE* pipe = popen(command.c_str(), "r");
  std::array<char, 4096> buffer;
  while (std::size_t n = fread(buffer.data(), 1, buffer.size(), pipe)) {
    ended.output.append(buffer.data(), n);
  }
  const int status = pclose(pipe);
  if (WIFEXITED(status)) ended.code = WEXITSTATUS(status);
  return ended;
}

TEST(FlyCampaignTest, PassesWhatIsWithinItsLimits) {
  const Ended ended = run("--gtest_filter=Steady.Passes");
  EXPECT_EQ(ended.code, 0) << ended.output;
  EXPECT_THAT(ended.output, HasSubstr("20 of 20 runs passed"));
}

TEST(FlyCampaignTest, FailsWhatIsNot) {
  const Ended ended = run("--gtest_filter=Steady.MissesItsLimits");
  EXPECT_EQ(ended.code, 1);
  // The 95th percentile of 0.25 ... 5 is the 19th of 20; 0.05^(1/20) = 0.8609.
  EXPECT_THAT(ended.output,
              HasSubstr("at that percentile of 20 runs it is 4.75, in run 18 (seed 19)"));
  EXPECT_THAT(ended.output, HasSubstr("which shows a rate of 0.86089"));
}

TEST(FlyCampaignTest, AFailingOrCrashingRunIsADatum) {
  const Ended ended = run("--gtest_filter=Mixed.*");
  EXPECT_EQ(ended.code, 0) << ended.output;
  EXPECT_THAT(
      ended.output,
      AllOf(HasSubstr("7 of 10 runs passed"), HasSubstr("run 3 (seed 4) crashed: signal 11"),
            HasSubstr("run 5 (seed 6) failed: campaign_program.cpp:"),
            HasSubstr("--gtest_filter='Mixed.IsJudgedAsAWhole' --orrery_seed=1 "
                      "--orrery_run=5")));
}

TEST(FlyCampaignTest, ARunWithoutAResultFailsIt) {
  const struct {
    const char *test, *why;
  } rows[] = {{"AHangIsNoResult", "run 1 (seed 2): timeout"},
              {"AKillIsNoResult", "run 1 (seed 2): killed, signal 9"},
              {"AHogIsNoResult", "run 1 (seed 2): memory, memory limit"},
              {"AnEarlyExitIsNoResult", "run 1 (seed 2): error, left no record, exit code 0"},
              {"ASkipIsNoResult", "run 1 (seed 2): error, left no record, exit code 0"},
              {"ABodyThatFliesNothingIsNoResult",
               "run 0 (seed 1): error, its body did not reach fly_campaign()"}};
  for (const auto& row : rows) {
    const Ended ended = run(std::string("--gtest_filter=Host.") + row.test);
    EXPECT_EQ(ended.code, 1) << row.test;
    EXPECT_THAT(ended.output, AllOf(HasSubstr("without a result"), HasSubstr(row.why)));
  }
}

TEST(FlyCampaignTest, AnExitAmidTheTestIsACrash) {
  EXPECT_EQ(run("--gtest_filter=Host.AnExitAmidTheTestIsACrash").code, 0);
}

TEST(FlyCampaignTest, ASecondOneInATestIsRefused) {
  EXPECT_EQ(run("--gtest_filter=Twice.*").code, 0);
}

TEST(FlyCampaignTest, OneRunIsReplayedInTheProgramItself) {
  const Ended passes = run("--gtest_filter=Mixed.* --orrery_run=6 --orrery_seed=40");
  EXPECT_EQ(passes.code, 0) << passes.output;
  EXPECT_THAT(passes.output, HasSubstr("run 6, seed 46, flown alone"));
  const Ended fails = run("--gtest_filter=Mixed.* --orrery_run=5");
  EXPECT_EQ(fails.code, 1);
  EXPECT_THAT(fails.output, AllOf(HasSubstr("run five"), Not(HasSubstr("of 10 runs"))));
}

TEST(FlyCampaignTest, SeedsHoldThatRunAlone) {
  const Ended passes = run("--gtest_filter=Seeds/* --orrery_run=1");
  EXPECT_EQ(passes.code, 0) << passes.output;
  EXPECT_THAT(passes.output, HasSubstr("1 test from"));
  EXPECT_EQ(run("--gtest_filter=Seeds/* --orrery_run=2").code, 1);
}

std::string content_of(const std::string& path) {
  std::ifstream in(path);
  return {std::istreambuf_iterator<char>(in), {}};
}

// What is left of each run, in the order of the runs, without what differs from host to host.
std::string results_in(const std::filesystem::path& folder) {
  std::string text;
  for (auto& [index, record] : read_runs(folder).runs) {
    RunRecord r = record;
    r.wall_s = r.cpu_s = 0;
    r.peak_kB = 0;
    text += to_json_line(r) + "\n";
  }
  return text;
}

TEST(FlyCampaignTest, ResultsDoNotDependOnHowManyRunAtATime) {
  const TemporaryFolder one("jobs"), four("jobs");
  const std::string flags = "--gtest_filter=Mixed.* --orrery_seed=7 --orrery_jobs=";
  EXPECT_EQ(run(flags + "1 --orrery_out=" + (one / "out").string()).code, 0);
  EXPECT_EQ(run(flags + "4 --orrery_out=" + (four / "out").string()).code, 0);
  const std::string first = results_in(one / "out/Mixed.IsJudgedAsAWhole");
  EXPECT_THAT(first, HasSubstr("\"seed\":16"));
  EXPECT_EQ(first, results_in(four / "out/Mixed.IsJudgedAsAWhole"));
}

TEST(FlyCampaignTest, JudgesResultsThatWereFlownBefore) {
  const TemporaryFolder folder("judge");
  const std::string out = (folder / "out").string(), kept = out + "/Steady.MissesItsLimits";
  run("--gtest_filter=Steady.MissesItsLimits --orrery_out=" + out);
  const Ended judged = run("--gtest_filter=Steady.MissesItsLimits --orrery_campaign=" + kept);
  EXPECT_EQ(judged.code, 1);
  EXPECT_THAT(judged.output, HasSubstr("it is 4.75, in run 18"));
  const Ended other = run("--gtest_filter=Steady.Passes --orrery_campaign=" + kept);
  EXPECT_EQ(other.code, 1);
  EXPECT_THAT(other.output, HasSubstr("results of Steady.MissesItsLimits, not of Steady.Passes"));
  // A run that has gone missing fails it, whatever the limits say.
  const std::string lines = content_of(kept + "/runs.jsonl");
  std::ofstream(kept + "/runs.jsonl") << lines.substr(lines.find('\n') + 1);
  EXPECT_THAT(run("--gtest_filter=Steady.MissesItsLimits --orrery_campaign=" + kept).output,
              HasSubstr("1 of 20 runs of this campaign are without a result"));
}

// ---- the parts

RunRecord sample(std::uint32_t run, RunOutcome outcome) {
  RunRecord r;
  r.test = "Suite.Test";
  r.run = run;
  r.seed = run + 1;
  r.outcome = outcome;
  r.metrics = {{"delta_v_mps", 0.1 * run},
               {"not_a_number", std::numeric_limits<double>::quiet_NaN()}};
  r.dispersions = {{"deputy/mass_kg", 11.25, "Normal(11, 0.11)"}};
  r.failure_site = "x.cpp:3";
  r.failure_text = "two\nlines, \"quoted\", \xff";
  r.hashes = {{"program", "ab"}};
  return r;
}

TEST(RunRecordTest, ReadsBackAsItWasWritten) {
  const std::string line = to_json_line(sample(3, RunOutcome::kFailed));
  EXPECT_THAT(line, Not(HasSubstr("\n")));
  const auto read = parse_run_record(line);
  ASSERT_TRUE(read);
  EXPECT_EQ(to_json_line(*read), line);
  EXPECT_EQ(*read->metric("delta_v_mps"), 0.1 * 3);
  EXPECT_EQ(read->dispersions, sample(3, RunOutcome::kFailed).dispersions);
  for (std::size_t n = 0; n < line.size(); ++n) EXPECT_FALSE(parse_run_record(line.substr(0, n)));
}

TEST(RunStoreTest, ATornLastLineIsPassedOverAndCutOff) {
  const TemporaryFolder folder("store");
  std::filesystem::create_directory(folder / "x");
  const std::filesystem::path file = folder / "x/runs.jsonl";
  const std::string first = to_json_line(sample(0, RunOutcome::kPassed));
  std::ofstream(file) << first << "\n" << first.substr(0, 100);
  EXPECT_EQ(read_runs(folder / "x").runs.size(), 1u);
  {
    RunStore store(file);
    EXPECT_THROW(std::make_unique<RunStore>(file), std::runtime_error) << "two runners";
    store.append(sample(1, RunOutcome::kPassed));
  }
  EXPECT_EQ(read_runs(folder / "x").runs.size(), 2u);
  std::ofstream(file, std::ios::app) << "nonsense\n" << first << "\n";
  EXPECT_THROW(read_runs(folder / "x"), std::runtime_error);
}

TEST(MergedRunsTest, AnotherResultOfTheSameRunIsReportedAndNotTaken) {
  MergedRuns merged;
  merged.add(sample(0, RunOutcome::kTimeout));
  merged.add(sample(0, RunOutcome::kFailed));  // what a host did gives way to a result
  merged.add(sample(0, RunOutcome::kKilled));
  EXPECT_TRUE(merged.contradictions.empty());
  EXPECT_EQ(merged.runs.at(0).outcome, RunOutcome::kFailed);
  merged.add(sample(0, RunOutcome::kFailed));
  EXPECT_TRUE(merged.contradictions.empty());
  merged.add(sample(0, RunOutcome::kPassed));
  ASSERT_EQ(merged.contradictions.size(), 1u);
  EXPECT_EQ(merged.contradictions[0].what, "the outcome is passed, was failed");
  EXPECT_EQ(merged.runs.at(0).outcome, RunOutcome::kFailed);
}

TEST(CampaignTest, AnUnknownMetricListsTheKnownOnes) {
  const Campaign campaign({sample(0, RunOutcome::kPassed), sample(1, RunOutcome::kPassed)});
  EXPECT_THAT([&] { (void)campaign.metric("dv"); },
              testing::ThrowsMessage<std::invalid_argument>(
                  HasSubstr("no run recorded a metric 'dv'; there are delta_v_mps, not_a_number")));
  EXPECT_EQ(campaign.metric("not_a_number").runs_without(), 2u);
  EXPECT_DOUBLE_EQ(campaign.metric("delta_v_mps").mean(), 0.05);
  EXPECT_THROW(PassRateAtLeast(1, 0.95), std::invalid_argument);
  EXPECT_THROW((void)testing::Matcher<const CampaignMetric&>(PercentileBelow(95, 1, from(1s))),
               std::invalid_argument);
}

}  // namespace
}  // namespace orrery
