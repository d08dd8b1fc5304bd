// What a report says of many runs, and the files that merge and report leave.
#include <orrery/harness/campaign/campaign_database.hpp>
#include <orrery/harness/campaign/campaign_report.hpp>
#include <orrery/harness/campaign/campaign_statistics.hpp>
#include <orrery/harness/gtest/child_process.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <cmath>
#include <fstream>
#include <limits>
#include <sqlite3.h>
#include <string>
#include <vector>

#include "../record/browser.hpp"

namespace orrery {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

// The textbook example of IQ and hours of television: rho = -29/165. With ties: the ranks of
// (1, 2, 2, 3) are 1, 2.5, 2.5, 4, against 1 ... 4: Pearson's correlation of these
// is 4.5/sqrt(22.5).
TEST(RankCorrelationTest, IsSpearmans) {
  const std::vector<double> iq = {106, 100, 86, 101, 99, 103, 97, 113, 112, 110};
  const std::vector<double> hours = {7, 27, 2, 50, 28, 29, 20, 12, 6, 17};
  EXPECT_NEAR(rank_correlation(iq, hours), -29.0 / 165, 1e-15);
  EXPECT_NEAR(rank_correlation({1, 2, 2, 3}, {1, 2, 3, 4}), 4.5 / std::sqrt(4.5 * 5), 1e-15);
  EXPECT_EQ(rank_correlation({1, 1, 1}, {1, 2, 3}), 0);
  EXPECT_NEAR(rank_correlation({1, kNan, 2, 3, 9}, {1, 100, 4, 9, kNan}), 1, 1e-15);
}

// 1 ... 1000: IQR 500, so bins of 2 * 500 / 10 = 100: ten of them, of 100 each.
TEST(HistogramTest, BinsAreThoseOfFreedmanAndDiaconis) {
  std::vector<double> values;
  for (int i = 1; i <= 1000; ++i) values.push_back(i);
  values.push_back(kNan);
  const Histogram h = histogram_of(values);
  EXPECT_EQ(h.low, 1);
  EXPECT_EQ(h.high, 1000);
  EXPECT_THAT(h.counts, testing::SizeIs(10));
  EXPECT_THAT(h.counts, testing::Each(100u));
  EXPECT_THAT(histogram_of({3, 3}).counts, ElementsAre(2u));
  EXPECT_THAT(histogram_of({}).counts, testing::IsEmpty());
}

TEST(PercentileTest, IsTheNearestRank) {
  EXPECT_EQ(percentile_of({1, 2, 3, 4}, 50), 2);
  EXPECT_EQ(percentile_of({1, 2, 3, 4}, 50.1), 3);
  EXPECT_EQ(percentile_of({1, 2, 3, 4}, 100), 4);
}

// 40 runs: metric = 2 mass, run 7 failed, run 9 crashed at the same place as 11, 13 hung.
MergedRuns sample() {
  MergedRuns merged;
  for (std::uint32_t i = 0; i < 40; ++i) {
    RunRecord r;
    r.test = "Suite.Test";
    r.run = i;
    r.seed = i + 5;
    r.runs = 40;
    r.outcome = i == 7              ? RunOutcome::kFailed
                : i == 9 || i == 11 ? RunOutcome::kCrashed
                : i == 13           ? RunOutcome::kTimeout
                                    : RunOutcome::kPassed;
    const double mass = (i * 17) % 40;
    if (r.outcome != RunOutcome::kTimeout) r.metrics = {{"delta_v_mps", 2 * mass}};
    r.dispersions = {{"deputy/mass_kg", mass, "Uniform(0, 40)"},
                     {"wind_mps", (i * 13) % 40 / 3.0, "Normal(0, 1)"}};
    if (i == 7) r.failure_site = "a.cpp:1", r.failure_text = "</script> \"quoted\", twice";
    if (i == 9 || i == 11) r.failure_site = "signal 11";
    r.wall_s = i;
    merged.add(r);
  }
  return merged;
}

const CampaignManifest kManifest = {.test = "Suite.Test",
                                    .base_seed = 5,
                                    .runs = 41,
                                    .program = "/opt/x_test",
                                    .flags = {},
                                    .files = {},
                                    .program_sha256 = "ab"};

TEST(CampaignReportTest, ThePageSaysWhatTheResultsDo) {
  const std::string page = campaign_page(kManifest, sample());
  EXPECT_THAT(page, Not(HasSubstr("http")));  // nothing from a network
  const std::string tag = "id=\"data\">";
  const std::size_t begin = page.find(tag) + tag.size();
  const auto json =
      nlohmann::json::parse(page.substr(begin, page.find("</script>", begin) - begin));
  EXPECT_EQ(json["n"], 41);
  EXPECT_EQ(json["missing"], 1);
  EXPECT_EQ(json["passed"], 36);
  // Clopper-Pearson of 36 of 41, by the relation to F quantiles in R: qbeta(.025, 36, 6) = 0.7380,
  // qbeta(.975, 37, 5) = 0.9592.
  EXPECT_NEAR(json["low"].get<double>(), 0.7380, 1e-4);
  EXPECT_NEAR(json["high"].get<double>(), 0.9592, 1e-4);
  const auto& metric = json["metrics"][0];
  EXPECT_EQ(metric["n"], 39);
  EXPECT_EQ(metric["without"], 1);
  EXPECT_EQ(metric["quantiles"].back()[1], 78);  // 2 * 39
  // The strongest first, and it is perfect.
  EXPECT_EQ(json["scatters"][0], nlohmann::json::parse("[0,0,1]"));
  EXPECT_EQ(json["groups"][0]["count"], 2);
  EXPECT_EQ(json["groups"][0]["site"], "signal 11");
  EXPECT_EQ(json["groups"][0]["replay"],
            "/opt/x_test --gtest_filter='Suite.Test' --orrery_seed=5 --orrery_run=9");
  EXPECT_EQ(json["slowest"][0][0], 39);
  EXPECT_EQ(json["worst"][0][0][2], 78);
}

// What a reader sees: bars as high as their bins, a dot for every run, the quantiles as text.
TEST(CampaignReportTest, ABrowserShowsTheData) {
  if (!has_chromium()) {
    GTEST_SKIP() << "no chromium in PATH: apt-get install chromium, or ci/setup";
  }
  const TemporaryFolder folder("campaign_page");
  std::ofstream(folder / "report.html") << campaign_page(kManifest, sample());
  const nlohmann::json page = measured(folder / "report.html", folder / "profile");
  ASSERT_TRUE(page.is_object());
  EXPECT_EQ(page["problems"], nlohmann::json::array()) << "script errors";
  EXPECT_EQ(page["title"], "Suite.Test: campaign");
  EXPECT_EQ(page["rate"][0], "87.8 %");  // 36 of 41
  // 2 mass without that of run 13, 21 kg: 0, 2 ... 78 but 42: the nearest ranks of 39.
  EXPECT_EQ(page["quantiles"], nlohmann::json::array({"5 % 2"
                                                      "25 % 18"
                                                      "50 % 38"
                                                      "75 % 60"
                                                      "90 % 72"
                                                      "95 % 76"
                                                      "99 % 78"
                                                      "largest 78"}));
  EXPECT_THAT(page["groups"].dump(), HasSubstr("</script> "));
  EXPECT_THAT(page["replays"].dump(), HasSubstr("--orrery_run=9"));
  const auto& charts = page["charts"];
  ASSERT_EQ(charts.size(), 3u) << "a metric, and over two dispersions";
  ASSERT_EQ(charts[0]["histogram"], "delta_v_mps");
  std::vector<double> values;
  for (int mass = 0; mass < 40; ++mass) {
    if (mass != 21) values.push_back(2 * mass);
  }
  const Histogram h = histogram_of(values);
  ASSERT_EQ(charts[0]["runs"].size(), h.counts.size());
  for (std::size_t i = 0; i < h.counts.size(); ++i) {  // to the pixel that an edge is blurred over
    EXPECT_NEAR(charts[0]["runs"][i], h.counts[i], 1.5 * charts[0]["pixel"].get<double>()) << i;
  }
  for (const std::size_t i : {1u, 2u}) {  // 3 of 39 did not pass and have the metric
    EXPECT_EQ(charts[i]["dots"], 39) << charts[i];
    EXPECT_EQ(charts[i]["shown"], 39) << charts[i];
    EXPECT_EQ(charts[i]["failed"], 3) << charts[i];
  }
}

TEST(CampaignReportTest, TheTableHasALineForEachRun) {
  const std::string csv = campaign_csv(sample());
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 41);
  EXPECT_THAT(csv, HasSubstr("run,seed,outcome,delta_v_mps,deputy/mass_kg,wind_mps,simulated_s"));
  EXPECT_THAT(csv, HasSubstr("\n13,18,timeout,,21,"));  // 13 * 17 mod 40
}

std::string answer(const std::filesystem::path& file, const char* sql) {
  sqlite3* db = nullptr;
  EXPECT_EQ(sqlite3_open_v2(file.c_str(), &db, SQLITE_OPEN_READONLY, nullptr), SQLITE_OK);
  std::string text;
  const auto row = [](void* to, int n, char** values, char**) {
    for (int i = 0; i < n; ++i) {
      *static_cast<std::string*>(to) += std::string(values[i] ? values[i] : "NULL") + " ";
    }
    return 0;
  };
  EXPECT_EQ(sqlite3_exec(db, sql, row, &text, nullptr), SQLITE_OK) << sqlite3_errmsg(db);
  sqlite3_close(db);
  return text;
}

TEST(CampaignDatabaseTest, HoldsWhatTheResultsDo) {
  const TemporaryFolder folder("database");
  const auto file = folder / "x.sqlite";
  for (int twice = 0; twice < 2; ++twice) write_database(kManifest, sample(), file);
  EXPECT_EQ(answer(file, "SELECT outcome, count(*) FROM runs GROUP BY outcome ORDER BY 1"),
            "crashed 2 failed 1 passed 36 timeout 1 ");
  EXPECT_EQ(answer(file,
                   "SELECT count(*), sum(abs(m.value - 2 * d.value)) FROM metrics m JOIN "
                   "dispersions d USING (run) WHERE d.name = 'deputy/mass_kg'"),
            "39 0.0 ");
  EXPECT_EQ(answer(file, "SELECT * FROM distributions ORDER BY 1"),
            "deputy/mass_kg Uniform(0, 40) wind_mps Normal(0, 1) ");
  EXPECT_EQ(answer(file, "SELECT replay FROM runs WHERE run = 7"),
            "/opt/x_test --gtest_filter='Suite.Test' --orrery_seed=5 --orrery_run=7 ");
}

}  // namespace
}  // namespace orrery
