// orrery-campaign run and accept, as programs.
#include <orrery/harness/campaign/bisection.hpp>
#include <orrery/harness/campaign/campaign_statistics.hpp>
#include <orrery/harness/campaign/run_store.hpp>
#include <orrery/harness/campaign/slurm_script.hpp>
#include <orrery/harness/gtest/child_process.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <random>
#include <string>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>

namespace orrery {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

struct Ended {
  int code = -1;
  std::string output;
};

Ended shell(const std::string& command) {
  Ended ended;
  FILE* pipe = popen((command + " 2>&1").c_str(), "r");
  std::array<char, 4096> buffer;
  while (std::size_t n = fread(buffer.data(), 1, buffer.size(), pipe)) {
    ended.output.append(buffer.data(), n);
  }
  const int status = pclose(pipe);
  if (WIFEXITED(status)) ended.code = WEXITSTATUS(status);
  return ended;
}

Ended campaign(const std::string& arguments) {
  return shell(ORRERY_CAMPAIGN " " + arguments);
}

// What is left of each run, in the order of the runs, without what differs from host to host.
std::string results_in(const std::filesystem::path& folder) {
  std::string text;
  for (const auto& [index, record] : read_runs(folder).runs) {
    RunRecord r = record;
    r.wall_s = r.cpu_s = 0;
    r.peak_kB = 0;
    text += to_json_line(r) + "\n";
  }
  return text;
}

std::size_t lines_in(const std::filesystem::path& folder) {
  std::size_t n = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() == ".jsonl") n += read_run_file(entry.path()).size();
  }
  return n;
}

class CampaignToolTest : public testing::Test {
 protected:
  std::string out(const char* name = "out") const { return (folder / name).string(); }
  std::string run(const std::string& test, const char* name = "out") const {
    return "run " CAMPAIGN_PROGRAM " --filter " + test + " --out " + out(name) + " ";
  }
  TemporaryFolder folder{"campaign"};
};

TEST_F(CampaignToolTest, FliesWhatTheTestDeclaresAndLetsItJudge) {
  const Ended passes = campaign(run("Steady.Passes"));
  EXPECT_EQ(passes.code, 0) << passes.output;
  EXPECT_EQ(read_runs(out()).runs.size(), 20u);
  EXPECT_THAT(passes.output, AllOf(HasSubstr("passed 20"), HasSubstr("[  PASSED  ] 1 test"),
                                   Not(HasSubstr("\r"))));
  const Ended fails = campaign(run("Steady.MissesItsLimits", "other"));
  EXPECT_EQ(fails.code, 1);
  EXPECT_THAT(fails.output, HasSubstr("it is 4.75, in run 18 (seed 19)"));
  EXPECT_EQ(campaign("accept " + out("other")).code, 1);
}

TEST_F(CampaignToolTest, FliesEveryRunOfAnyOtherTest) {
  const Ended ended = campaign(run("Seeds/PlainTest.HasARun/0") + "--runs 4");
  EXPECT_EQ(ended.code, 1);
  EXPECT_THAT(ended.output, AllOf(HasSubstr("passed 3, failed 1"), HasSubstr("--orrery_run=2")));
  EXPECT_EQ(*read_runs(out()).runs.at(3).metric("seed"), 4);
  EXPECT_THAT(campaign(run("Seeds/PlainTest.HasARun/0", "b")).output, HasSubstr("--runs N"));
}

TEST_F(CampaignToolTest, ResultsDoNotDependOnJobsOrShards) {
  campaign(run("Mixed.IsJudgedAsAWhole", "one") + "-j1 --seed 5");
  campaign(run("Mixed.IsJudgedAsAWhole", "four") + "-j4 --seed 5");
  for (const char* shard : {"1/3", "2/3", "3/3"}) {
    campaign(run("Mixed.IsJudgedAsAWhole", "shards") + "-j2 --seed 5 --runs 10 --shard " + shard);
  }
  const std::string one = results_in(out("one"));
  EXPECT_THAT(one, HasSubstr("\"seed\":14"));
  EXPECT_EQ(one, results_in(out("four")));
  EXPECT_EQ(one, results_in(out("shards")));
  EXPECT_EQ(lines_in(out("shards")), 10u);
  EXPECT_EQ(campaign("accept " + out("shards")).code, 0);
}

TEST_F(CampaignToolTest, ResumesWhatIsMissingAndNothingElse) {
  campaign(run("Many.Empty") + "--runs 5");
  EXPECT_THAT(campaign(run("Many.Empty") + "--runs 5").output, HasSubstr("--resume"));
  EXPECT_EQ(campaign(run("Many.Empty") + "--runs 9 --resume").code, 0);
  EXPECT_EQ(lines_in(out()), 9u);
  EXPECT_EQ(read_runs(out()).runs.size(), 9u);
}

TEST_F(CampaignToolTest, ResumesWhatOthersHaveKilled) {
  campaign(run("Host.AKillIsNoResult"));
  EXPECT_EQ(campaign(run("Host.AKillIsNoResult") + "--resume").code, 1);
  EXPECT_EQ(lines_in(out()), 4u) << "run 1, which is killed again";
}

TEST_F(CampaignToolTest, AFailureStaysOneWhenItIsRetried) {
  campaign(run("Mixed.IsJudgedAsAWhole"));
  const std::string before = results_in(out());
  const Ended retried = campaign(run("Mixed.IsJudgedAsAWhole") + "--retry-failed");
  EXPECT_EQ(retried.code, 0) << retried.output;  // 7 of 10 are what that test asks for
  EXPECT_EQ(lines_in(out()), 13u);
  EXPECT_EQ(results_in(out()), before);
}

TEST_F(CampaignToolTest, AnotherResultOfTheSameRunIsADefect) {
  setenv("UNSTEADY_FILE", (folder / "times").c_str(), 1);
  campaign(run("Unsteady.GivesAnotherResult"));
  const Ended retried = campaign(run("Unsteady.GivesAnotherResult") + "--retry-failed");
  unsetenv("UNSTEADY_FILE");
  EXPECT_EQ(retried.code, 3);
  EXPECT_THAT(retried.output, HasSubstr("DEFECT: run 0 (seed 1) gave another result: the outcome "
                                        "is passed, was failed"));
  EXPECT_EQ(read_runs(out()).runs.at(0).outcome, RunOutcome::kFailed);
}

TEST_F(CampaignToolTest, IsRefusedWhereTheProgramOrItsDataHasChanged) {
  const std::string copy = out("program"), data = out("data");
  std::filesystem::copy_file(CAMPAIGN_PROGRAM, copy);
  std::ofstream(data) << "one";
  const std::string command =
      "run " + copy + " --filter Many.Empty --runs 3 --out " + out() + " --data " + data + " ";
  EXPECT_EQ(campaign(command).code, 0);
  EXPECT_EQ(campaign(command + "--resume").code, 0);
  EXPECT_THAT(campaign(command + "--resume --seed 2").output,
              HasSubstr("the base seed is 2, was 1"));
  std::ofstream(data) << "two";
  const Ended other_data = campaign(command + "--resume");
  EXPECT_EQ(other_data.code, 2);
  EXPECT_THAT(other_data.output, HasSubstr("the SHA-256 of " + data));
  std::ofstream(data) << "one";
  std::ofstream(copy, std::ios::app | std::ios::binary) << 'x';  // still runs
  const Ended other_program = campaign(command + "--retry-failed");
  EXPECT_EQ(other_program.code, 2);
  EXPECT_THAT(other_program.output, HasSubstr("the program's SHA-256 is"));
  EXPECT_EQ(campaign("accept " + out()).code, 2);
}

TEST_F(CampaignToolTest, StopsAtTheFirstFailure) {
  const Ended ended = campaign(run("Mixed.IsJudgedAsAWhole") + "-j1 --until-failure");
  EXPECT_EQ(ended.code, 1);
  EXPECT_EQ(lines_in(out()), 4u) << "run 3 crashes";
}

TEST_F(CampaignToolTest, ATimeLimitCostsOneRun) {
  const Ended ended = campaign(run("Host.AHangIsNoResult") + "--time-limit 3");
  EXPECT_EQ(ended.code, 1);
  EXPECT_THAT(ended.output, AllOf(HasSubstr("passed 2, timeout 1"), HasSubstr("without a result")));
}

// Run 1 takes up to 1 GB; the others stay below 100 MB, under a sanitizer too.
TEST_F(CampaignToolTest, AMemoryLimitCostsOneRun) {
  const Ended ended = campaign(run("Host.AHogIsNoResult") + "--memory-limit 300 -j2");
  EXPECT_EQ(ended.code, 1);
  EXPECT_THAT(ended.output, AllOf(HasSubstr("passed 2, memory 1"), HasSubstr("without a result"),
                                  HasSubstr("1 memory: memory limit")));
  EXPECT_EQ(read_runs(out()).runs.at(1).outcome, RunOutcome::kMemory);
}

class FlightCampaignTest : public CampaignToolTest {
 protected:
  std::string run_flying(const char* test) const {
    return "run " FAILING_PROGRAM " --filter FlightCampaign." + std::string(test) + " --out " +
           out() + " ";
  }
};

// Both crashes are one line of the report, under the function that flight code crashed in.
TEST_F(FlightCampaignTest, CrashesOfFlightCodeAreGroupedByTheirSite) {
  EXPECT_EQ(campaign(run_flying("EveryOtherCrashes")).code, 0);
  const std::vector<FailureGroup> groups = failure_groups_of(table_of(read_runs(out())));
  ASSERT_EQ(groups.size(), 1u);
  EXPECT_EQ(groups[0].outcome, "failed");
  EXPECT_EQ(groups[0].runs, (std::vector<std::uint32_t>{1, 3}));
  EXPECT_THAT(groups[0].site, AllOf(HasSubstr("deputy"), HasSubstr("input")));
  EXPECT_THAT(groups[0].text, HasSubstr("Aborted raised"));
}

TEST_F(FlightCampaignTest, IsRefusedWhereAFlightLibraryHasChanged) {
  const std::string libraries = out("libraries");
  const std::string library = libraries + "/libfixture_beacon.so";
  std::filesystem::create_directory(libraries);
  std::filesystem::copy_file(FIXTURE_BEACON, library);
  setenv("ORRERY_FLIGHT_PATH", libraries.c_str(), 1);
  const std::string command = run_flying("EveryOtherCrashes");
  EXPECT_EQ(campaign(command + "--runs 3").code, 0);
  EXPECT_EQ(campaign(command + "--runs 4 --resume").code, 0);
  std::ofstream(library, std::ios::app | std::ios::binary) << 'x';  // still flies
  for (const char* way : {"--resume", "--retry-failed"}) {
    const Ended refused = campaign(command + way);
    EXPECT_EQ(refused.code, 2) << way;
    EXPECT_THAT(refused.output, HasSubstr("with another flight library: " + library)) << way;
  }
  unsetenv("ORRERY_FLIGHT_PATH");
  EXPECT_EQ(lines_in(out()), 4u);
}

TEST_F(FlightCampaignTest, IsRefusedWhereADispersionOrAFlagHasChanged) {
  const std::string command = run_flying("HeavyOnesFail");
  campaign(command + "--runs 3");
  EXPECT_THAT(campaign(command + "--runs 3 --resume -- --orrery_set=deputy/mass_kg=11").output,
              HasSubstr("flags are others"));
  setenv("CAMPAIGN_SIGMA_KG", "0.25", 1);
  const Ended refused = campaign(command + "--runs 6 --resume");
  unsetenv("CAMPAIGN_SIGMA_KG");
  EXPECT_EQ(refused.code, 2);
  EXPECT_THAT(
      refused.output,
      HasSubstr("the dispersion of deputy/mass_kg is Normal(11, 0.25), was Normal(11, 0.5)"));
  EXPECT_EQ(lines_in(out()), 3u);
}

// A typing mistake must not pass for a value that changes nothing.
TEST_F(FlightCampaignTest, AValueForWhatIsNotDispersedIsRefusedByName) {
  const std::string program =
      FAILING_PROGRAM " --gtest_filter=FlightCampaign.HeavyOnesFail --orrery_run=0 --orrery_set=";
  EXPECT_EQ(shell(program + "deputy/mass_kg=11").code, 0);
  const Ended unknown = shell(program + "deputy/mass=11");
  EXPECT_EQ(unknown.code, 1);
  EXPECT_THAT(unknown.output,
              HasSubstr("--orrery_set=deputy/mass=11: this test draws no dispersion "
                        "of that name; it draws deputy/mass_kg"));
  const Ended wrong = shell(program + "deputy/mass_kg=-5");
  EXPECT_EQ(wrong.code, 1);
  EXPECT_THAT(wrong.output, AllOf(HasSubstr("mass_kg"), HasSubstr("-5")));
  for (const char* text : {"deputy/mass_kg=nan", "deputy/mass_kg=heavy", "deputy/mass_kg", "=3"}) {
    const Ended malformed = shell(program + text);
    EXPECT_EQ(malformed.code, 2) << text;
    EXPECT_THAT(malformed.output, HasSubstr("expected NAME=NUMBER")) << text;
  }
  // The runs are refused, not the program that flies them.
  const Ended all =
      shell(FAILING_PROGRAM " --gtest_filter=FlightCampaign.HeavyOnesFail --orrery_set=mass_kg=11");
  EXPECT_THAT(all.output, HasSubstr("0 of 8 runs passed"));
}

// The limit in the test is 11.25 kg; the interval some tenths, of which a thousandth is asked.
TEST_F(FlightCampaignTest, BisectionFindsTheValueAtWhichARunBeginsToFail) {
  campaign(run_flying("HeavyOnesFail"));
  std::uint32_t failed = 0;
  for (const auto& [index, record] : read_runs(out()).runs) {
    if (record.outcome == RunOutcome::kFailed) failed = index;
  }
  const std::string bisects =
      "bisect " + out() + " --run " + std::to_string(failed) + " --parameter ";
  const Ended ended = campaign(bisects + "deputy/mass_kg");
  EXPECT_EQ(ended.code, 0) << ended.output;
  double passes_kg = 0, fails_kg = 0;
  const std::size_t at = ended.output.find("passes at ");
  ASSERT_NE(at, std::string::npos) << ended.output;
  ASSERT_EQ(
      std::sscanf(ended.output.c_str() + at, "passes at %lf, fails at %lf", &passes_kg, &fails_kg),
      2);
  EXPECT_LT(passes_kg, 11.25);
  EXPECT_GE(fails_kg, 11.25);
  EXPECT_LT(fails_kg - passes_kg, 0.002);
  EXPECT_THAT(campaign(bisects + "deputy/mass").output,
              HasSubstr("no dispersion 'deputy/mass'; there are deputy/mass_kg"));
}

TEST_F(CampaignToolTest, SaysWhatIsWrongWithItsArguments) {
  for (const char* arguments :
       {"fly", "run", "run x", "run x --filter 'A.*'", "run x --filter A.B -j0",
        "run x --filter A.B --shard 3/2", "run x --filter A.B --memory-limit 0",
        "run x --filter A.B --bogus", "run x --filter A.B -- --gtest_repeat=2", "report"}) {
    EXPECT_EQ(campaign(arguments).code, 2) << arguments;
  }
  EXPECT_THAT(campaign("run /nowhere/x --filter A.B").output, HasSubstr("/nowhere/x"));
}

// 200 runs of 0.3 s are 60 s: one task of a minute, two on half of it; never more than runs.
TEST(SlurmTasksTest, AreSizedByTheTimeOfARun) {
  CampaignOptions options;
  EXPECT_EQ(slurm_tasks(options, 200, 0.3), 1u);
  options.chunk = 30s;
  EXPECT_EQ(slurm_tasks(options, 200, 0.3), 2u);
  options.processors = 2;
  EXPECT_EQ(slurm_tasks(options, 200, 0.3), 1u);
  EXPECT_EQ(slurm_tasks(options, 3, 1e6), 3u);
  EXPECT_EQ(slurm_tasks(options, 9999999, 100), 10000u);
}

TEST_F(CampaignToolTest, WritesAJobArrayThatMayBeRequeued) {
  const Ended ended = campaign("submit --slurm " CAMPAIGN_PROGRAM
                               " --filter Many.Empty --runs 50 --dry-run --chunk 1 --out " +
                               out());
  EXPECT_EQ(ended.code, 0) << ended.output;
  EXPECT_EQ(read_runs(out()).runs.size(), 3u) << "what was measured counts";
  std::ifstream in(out() + "/campaign.slurm");
  const std::string script{std::istreambuf_iterator<char>(in), {}};
  EXPECT_THAT(script, AllOf(HasSubstr("#SBATCH --requeue"), HasSubstr("#SBATCH --open-mode=append"),
                            HasSubstr("#SBATCH --array=1-"), HasSubstr("--resume")));
  // A task of it, as Slurm would start it, twice: the second finds nothing left.
  for (int twice = 0; twice < 2; ++twice) {
    EXPECT_EQ(shell("SLURM_ARRAY_TASK_ID=1 bash " + out() + "/campaign.slurm").code, 0);
  }
  const std::size_t lines = lines_in(out());
  EXPECT_GT(lines, 3u);
  EXPECT_EQ(lines, read_runs(out()).runs.size());
}

TEST(BisectTest, FindsTheThreshold) {
  const auto above = [](double x) { return x > 2.625; };
  const Threshold t = bisect(0, 10, 1e-9, above);
  EXPECT_LE(t.passes, 2.625);
  EXPECT_GT(t.fails, 2.625);
  EXPECT_LE(t.fails - t.passes, 1e-9);
  EXPECT_LE(t.runs, 34);  // log2(1e10)
  // To neighbouring doubles, in the other direction.
  const Threshold to_bits = bisect(10, 0, 0, [](double x) { return x <= 2.625; });
  EXPECT_EQ(to_bits.fails, 2.625);
}

// Three hosts without a common disk: their folders become one, which is judged and reported.
TEST_F(CampaignToolTest, MergesFoldersOfOneCampaign) {
  campaign(run("Steady.Passes", "whole"));
  campaign(run("Steady.Passes", "a") + "--runs 20 --shard 1/2");
  campaign(run("Steady.Passes", "b") + "--runs 20 --shard 2/2");
  const std::string parts = out("a") + " " + out("b");
  EXPECT_EQ(campaign("accept " + out("a")).code, 1) << "half of it is missing";
  EXPECT_EQ(campaign("merge " + out("all") + " " + parts).code, 0);
  EXPECT_EQ(results_in(out("all")), results_in(out("whole")));
  EXPECT_EQ(campaign("accept " + out("all")).code, 0);
  EXPECT_EQ(campaign("report " + out("all") + " --csv " + out("table.csv")).code, 0);
  for (const char* file : {"all/report.html", "all/campaign.sqlite", "table.csv"}) {
    EXPECT_GT(std::filesystem::file_size(out(file)), 1000u) << file;
  }
  campaign(run("Steady.Passes", "other") + "--seed 2");
  EXPECT_EQ(campaign("merge " + out("mixed") + " " + parts + " " + out("other")).code, 2);
}

// Whenever it is killed: what was written stays, is whole, and the rest is flown once. 200 times
// with ORRERY_KILLS=200.
TEST_F(CampaignToolTest, AKillLosesTheRunsInFlightAndNoMore) {
  constexpr std::uint32_t kRuns = 40;
  const char* asked = std::getenv("ORRERY_KILLS");
  const int kills = asked == nullptr ? 5 : std::atoi(asked);
  const std::string flags = "-j2 --runs " + std::to_string(kRuns) + " ";
  campaign(run("Many.Empty", "whole") + flags);
  const std::string whole = results_in(out("whole"));
  std::mt19937 random(1);
  const std::string command = "exec " ORRERY_CAMPAIGN " " + run("Many.Empty", "killed") + flags;
  for (int i = 0; i < kills; ++i) {
    std::filesystem::remove_all(out("killed"));
    std::size_t kept = 0;
    for (int lives = 0; kept < kRuns; ++lives) {
      const pid_t child = fork();
      if (child == 0) {
        const std::string quiet = command + (lives > 0 ? "--resume" : "") + " >/dev/null 2>&1";
        execl("/bin/sh", "sh", "-c", quiet.c_str(), nullptr);
        _exit(127);
      }
      const auto after = std::chrono::milliseconds(random() % 250);
      std::this_thread::sleep_for(after);
      // Ctrl-C, as a terminal sends it, or worse; the last life is left alone.
      if (lives < 3) kill(child, random() % 3 == 0 ? SIGINT : SIGKILL);
      waitpid(child, nullptr, 0);
      if (!std::filesystem::exists(out("killed"))) continue;
      const std::size_t now = lines_in(out("killed"));
      EXPECT_GE(now, kept) << "a result is gone";
      kept = now;
      ASSERT_LT(lives, 10);
    }
    ASSERT_EQ(results_in(out("killed")), whole);
    ASSERT_EQ(lines_in(out("killed")), kRuns) << "a run was flown twice";
  }
}

// 1,000 empty runs in less than 10 s with -j2 is what is aimed at; no time is asserted, but shown.
TEST_F(CampaignToolTest, ManyEmptyRunsEndSoon) {
  const int runs = std::getenv("ORRERY_KILLS") == nullptr ? 100 : 1000;
  const Ended ended = campaign(run("Many.Empty") + "-j2 --runs " + std::to_string(runs));
  EXPECT_EQ(ended.code, 0);
  std::printf("%s", ended.output.substr(0, ended.output.find('\n') + 1).c_str());
}

}  // namespace
}  // namespace orrery
