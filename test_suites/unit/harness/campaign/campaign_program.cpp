// Campaigns that do what campaigns must bear: runs that fail, crash, hang, end early, differ.
#include <orrery/harness/campaign/campaign.hpp>
#include <orrery/harness/gtest/seeds.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <thread>

using namespace orrery;

namespace {

// A metric that a reader can work out: 0.25, 0.5 ... by index.
double quarter(RunId run) {
  return 0.25 * (run.index + 1);
}

std::string variable(const char* name) {
  const char* text = std::getenv(name);
  return text == nullptr ? "" : text;
}

}  // namespace

TEST(Steady, Passes) {
  const Campaign campaign = fly_campaign(Runs{20}, [](RunId run) {
    record_metric("quarter_m", quarter(run));
    record_metric("seed", static_cast<double>(run.seed));
  });
  EXPECT_THAT(campaign.metric("quarter_m"), PercentileBelow(95, 4.9));
  EXPECT_THAT(campaign.passed(), PassRateAtLeast(0.86, /*confidence=*/0.95));
}

TEST(Steady, MissesItsLimits) {
  const Campaign campaign =
      fly_campaign(Runs{20}, [](RunId run) { record_metric("quarter_m", quarter(run)); });
  EXPECT_THAT(campaign.metric("quarter_m"), PercentileBelow(95, 4.7));
  EXPECT_THAT(campaign.passed(), PassRateAtLeast(0.87, /*confidence=*/0.95));
}

// What fails or crashes is a datum: 7 of 10 pass.
TEST(Mixed, IsJudgedAsAWhole) {
  const Campaign campaign = fly_campaign(Runs{10}, [](RunId run) {
    if (run.index == 3) {
      std::signal(SIGSEGV, SIG_DFL);  // a sanitizer's handler would exit instead
      std::raise(SIGSEGV);
    }
    if (run.index % 4 != 1) record_metric("quarter_m", quarter(run));
    EXPECT_NE(run.index, 5u) << "run five";
    ASSERT_NE(run.index, 7u) << "run seven";
  });
  EXPECT_EQ(campaign.passed().passed, 7u);
  EXPECT_EQ(campaign.runs().size(), 10u);
  // Of 10 runs 1, 3, 5 and 9 have no value: the 60th percentile is the largest there is.
  EXPECT_DOUBLE_EQ(campaign.metric("quarter_m").percentile(60), 0.25 * 9);
  EXPECT_THAT(campaign.metric("quarter_m"), testing::Not(PercentileBelow(61, 1e9)));
}

TEST(Host, AHangIsNoResult) {
  fly_campaign(Runs{.n = 3, .time_limit = 3s}, [](RunId run) {
    if (run.index == 1) std::this_thread::sleep_for(std::chrono::seconds(60));
  });
}
// Up to 1 GB, 20 MB at a time.
TEST(Host, AHogIsNoResult) {
  fly_campaign(Runs{.n = 3, .memory_limit_bytes = 400'000'000}, [](RunId run) {
    std::vector<std::string> kept;
    for (int i = 0; run.index == 1 && i < 50; ++i) {
      kept.emplace_back(std::size_t{20'000'000}, 'x');
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
  });
}
TEST(Host, AKillIsNoResult) {
  fly_campaign(Runs{3}, [](RunId run) {
    if (run.index == 1) std::raise(SIGKILL);
  });
}
TEST(Host, AnEarlyExitIsNoResult) {
  fly_campaign(Runs{3}, [](RunId run) {
    if (run.index == 1) std::_Exit(0);
  });
}
TEST(Host, AnExitAmidTheTestIsACrash) {
  const Campaign campaign = fly_campaign(Runs{3}, [](RunId run) {
    if (run.index == 1) std::_Exit(99);
  });
  EXPECT_EQ(campaign.runs().at(1).outcome, RunOutcome::kCrashed);
  EXPECT_EQ(campaign.runs().at(1).failure_site, "exit code 99 amid the test");
}
TEST(Host, ASkipIsNoResult) {
  fly_campaign(Runs{3}, [](RunId run) {
    if (run.index == 1) GTEST_SKIP();
  });
}
// In a child nothing is flown: the body ends before.
TEST(Host, ABodyThatFliesNothingIsNoResult) {
  if (testing::UnitTest::GetInstance()->random_seed() >= 0 && std::getenv("CAMPAIGN_CHILD")) return;
  setenv("CAMPAIGN_CHILD", "1", 1);
  fly_campaign(Runs{2}, [](RunId) {});
}

TEST(Twice, IsRefused) {
  fly_campaign(Runs{1}, [](RunId) {});
  EXPECT_THROW(fly_campaign(Runs{1}, [](RunId) {}), std::logic_error);
}

// As many as the caller likes.
TEST(Many, Empty) {
  fly_campaign(Runs{1000}, [](RunId run) { record_metric("quarter_m", quarter(run)); });
}

// Another result each time that it is asked.
TEST(Unsteady, GivesAnotherResult) {
  fly_campaign(Runs{2}, [](RunId run) {
    int times = 0;
    const std::string file = variable("UNSTEADY_FILE") + std::to_string(run.index);
    std::ifstream(file) >> times;
    std::ofstream(file) << times + 1;
    EXPECT_GT(times, 0);
  });
}

struct PlainTest : testing::TestWithParam<RunId> {};
TEST_P(PlainTest, HasARun) {
  record_metric("seed", static_cast<double>(GetParam().seed));
  EXPECT_NE(GetParam().index, 2u);
}
INSTANTIATE_TEST_SUITE_P(Seeds, PlainTest, Seeds(4));

// Something to interrupt: each run takes as long as the caller says.
TEST(Slow, Sleeps) {
  const Campaign campaign = fly_campaign(Runs{200}, [](RunId run) {
    std::this_thread::sleep_for(
        std::chrono::milliseconds(std::atoi(variable("CAMPAIGN_RUN_MS").c_str())));
    record_metric("quarter_m", quarter(run));
  });
  EXPECT_THAT(campaign.passed(), PassRateAtLeast(0.9, 0.95));
}
