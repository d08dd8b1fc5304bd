#include <orrery/harness/record/load_history.hpp>
#include <orrery/harness/record/report_page.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

namespace orrery {
namespace {

TEST(SeriesEnvelopeTest, KeepsEverySampleWhileThereIsRoom) {
  SeriesEnvelope values(10);
  for (int i = 0; i < 10; ++i) values.add(i * 1s, i);
  // Spans of one nanosecond, one sample each.
  ASSERT_EQ(values.spans().size(), 10u);
  EXPECT_EQ(values.spans()[3].begin, 3s);
  EXPECT_EQ(values.spans()[3].least, 3);
  EXPECT_EQ(values.spans()[3].most, 3);
}

// Property: whatever was added, each sample lies within the span of its time, and each bound of a
// span is the value of a sample in it.
TEST(SeriesEnvelopeTest, NoPeakIsLostAndNoneIsMadeUp) {
  SeriesEnvelope values(100);
  std::vector<double> samples;
  for (int i = 0; i < 50'000; ++i) {
    samples.push_back(std::sin(0.001 * i) + (i == 31'234 ? 7 : 0));
    values.add(i * 250ms, samples.back());
  }
  EXPECT_LE(values.spans().size(), 100u);
  EXPECT_GE(values.spans().size(), 50u);
  std::size_t next = 0;
  double highest = 0;
  for (const SeriesEnvelope::Span& span : values.spans()) {
    double least = std::numeric_limits<double>::infinity(), most = -least;
    EXPECT_EQ(span.begin, static_cast<std::int64_t>(next) * 250ms);
    for (; next < samples.size() && static_cast<std::int64_t>(next) * 250ms <= span.end; ++next) {
      least = std::min(least, samples[next]);
      most = std::max(most, samples[next]);
    }
    EXPECT_EQ(span.least, least);
    EXPECT_EQ(span.most, most);
    EXPECT_EQ(span.last, samples[next - 1]);
    highest = std::max(highest, span.most);
  }
  EXPECT_EQ(next, samples.size());
  EXPECT_EQ(highest, samples[31'234]);
}

TEST(SeriesEnvelopeTest, LeavesOutWhatIsNoNumber) {
  SeriesEnvelope values;
  values.add(1s, std::nan(""));
  EXPECT_TRUE(values.empty());
  EXPECT_THROW(SeriesEnvelope(1), std::invalid_argument);
}

nlohmann::json data_of(const std::string& page) {
  const std::string begin = "<script type=\"application/json\" id=\"data\">";
  const std::size_t at = page.find(begin) + begin.size();
  return nlohmann::json::parse(page.substr(at, page.find("</script>", at) - at));
}

SeriesEnvelope series(const std::vector<std::pair<Duration, double>>& samples) {
  SeriesEnvelope values;
  for (const auto& [t, value] : samples) values.add(t, value);
  return values;
}

Report small_report() {
  Report report{.title = "A \"quoted\" </script> name", .result = "passed", .length = 10s};
  report.header = {{"seed", "1"}};
  report.host = {{"speed", "5 x"}};
  report.table = {{"", "delta-v"}, {{"deputy", "0.3"}}};
  report.time_charts = {
      {.title = "Distance", .unit = "m", .series = {{"deputy", series({{0s, 1.5}, {2500ms, -2}})}}},
      {.title = "Nothing", .unit = "m", .series = {{"deputy", {}}}}};
  report.time_charts[0].limit = 3;
  report.time_charts[0].limit_name = "cap";
  report.origin = "chief";
  report.paths = {{"chief", {}}, {"deputy", {{1s, 1, 2, 3}, {2s, 4, 5, 6}}}};
  report.links = {{"chief-deputy",
                   {{.kind = "delivered", .messages = {{1s, 100ms}, {3s, 250ms}}, .count = 2},
                    {.kind = "lost", .messages = {{2s, {}}}, .count = 7}}}};
  report.lanes = {{"process of deputy", {{0s, "on"}, {4s, "off"}}}};
  report.faults = {{"deputy", "outage", 1s, 2s}, {"chief-deputy", "loss", 3s, {}}};
  report.arenas = {{"Heap of deputy", "16 bytes per cell", {"##5.", "1."}}};
  report.films = {{"chief camera", {{1500ms, "frame 1", "aGk="}}}, {"deputy camera", {}}};
  report.events = {{5s, "deputy", "impulse\nof 1 m/s"}};
  return report;
}

TEST(ReportPageTest, HoldsTheDataAsGiven) {
  const auto data = data_of(to_html(small_report()));
  const auto json = [](const char* text) { return nlohmann::json::parse(text); };
  EXPECT_EQ(data["title"], "A \"quoted\" </script> name");
  EXPECT_EQ(data["result"], "passed");
  EXPECT_EQ(data["length"], 10.0);
  EXPECT_EQ(data["header"], json(R"([["seed","1"]])"));
  ASSERT_EQ(data["charts"].size(), 1u) << "a chart without data is left out";
  const auto& chart = data["charts"][0];
  EXPECT_EQ(chart["limit"], 3);
  const auto& values = chart["series"][0]["values"];
  EXPECT_EQ(values["t"], json("[0,2500]")) << "differences, in ms";
  EXPECT_EQ(values["lo"], json("[1.5,-2]"));
  EXPECT_FALSE(values.contains("hi")) << "the same as lo";
  ASSERT_EQ(data["paths"].size(), 1u);
  EXPECT_EQ(data["paths"][0]["T"], json("[2,5]"));
  EXPECT_EQ(data["paths"][0]["t"], json("[1,2]"));
  const auto& groups = data["links"][0]["groups"];
  EXPECT_EQ(groups[0]["sent"], json("[1000,2000]"));
  EXPECT_EQ(groups[0]["took"], json("[100,250]"));
  EXPECT_EQ(groups[1]["took"], json("[null]"));
  EXPECT_EQ(groups[1]["count"], 7);
  EXPECT_EQ(data["lanes"][0]["states"], json(R"([[0,"on"],[4,"off"]])"));
  EXPECT_EQ(data["faults"][0]["until"], 2);
  EXPECT_FALSE(data["faults"][1].contains("until"));
  EXPECT_EQ(data["arenas"][0]["rows"], json(R"(["##5.","1."])"));
  EXPECT_EQ(data["films"], json(R"([{"name":"chief camera",
                      "pictures":[{"at":1.5,"caption":"frame 1","png":"aGk="}]}])"))
      << "a film without pictures is left out";
  EXPECT_EQ(data["events"], json(R"([[5,"deputy","impulse\nof 1 m/s"]])"));
}

// Least, most and last of spans that hold several samples; what is equal is null.
TEST(ReportPageTest, KeepsTheExtremesOfThinnedSeries) {
  Report report = small_report();
  SeriesEnvelope values(2);
  for (const auto& [t, value] :
       std::vector<std::pair<Duration, double>>{{0s, 1}, {1s, 5}, {2s, 2}, {40s, 7}}) {
    values.add(t, value);
  }
  ASSERT_EQ(values.spans().size(), 2u);
  report.time_charts[0].series[0].values = values;
  const auto drawn = data_of(to_html(report))["charts"][0]["series"][0]["values"];
  EXPECT_EQ(drawn["lo"], nlohmann::json::parse("[1,7]"));
  EXPECT_EQ(drawn["hi"], nlohmann::json::parse("[5,null]"));
  EXPECT_EQ(drawn["last"], nlohmann::json::parse("[2,null]"));
}

TEST(LoadHistoryTest, BusyTimeIsSharedAmongTheCellsItFallsInto) {
  LoadHistory load;
  EXPECT_TRUE(load.empty());
  load.add(500ms, 2250ms);
  load.add(3s, 3100ms);
  const auto percent = load.percent(4s);
  std::vector<double> values;
  for (const auto& span : percent.spans()) values.push_back(span.last);
  EXPECT_THAT(values, testing::Pointwise(testing::DoubleNear(1e-9),
                                         std::vector<double>{50, 100, 25, 10, 10}));
}

TEST(LoadHistoryTest, AResetCutsTheCallShort) {
  LoadHistory load;
  load.add(0s, 10s);
  load.cut(1s);
  EXPECT_NEAR(load.percent(10s).spans()[0].last, 100, 1e-9);
  EXPECT_NEAR(load.percent(10s).spans()[1].last, 0, 1e-9);
}

// Property: cells that are joined keep the sum. 0.1 s busy in each second of 100 h.
TEST(LoadHistoryTest, LongRunsKeepTheMean) {
  LoadHistory load(100);
  for (int i = 0; i < 360'000; ++i) load.add(i * 1s, i * 1s + 100ms);
  const auto percent = load.percent(100h);
  EXPECT_LE(percent.spans().size(), 101u);
  for (const auto& span : percent.spans()) EXPECT_NEAR(span.last, 10, 1e-9);
}

TEST(ReportPageTest, NeedsNothingFromOutside) {
  const std::string page = to_html(small_report());
  for (const char* word : {"http:", "https:", "src=", "@import", "url("}) {
    EXPECT_EQ(page.find(word), std::string::npos) << word;
  }
}

TEST(ReportPageTest, WhatDiffersBetweenEqualRunsHasALineOfItsOwn) {
  Report other = small_report();
  other.host = {{"speed", "7 x"}};
  const std::string a = to_html(small_report()), b = to_html(other);
  const std::size_t at = a.find("\n,\"host\":");
  ASSERT_NE(at, std::string::npos);
  EXPECT_EQ(a.substr(0, at), b.substr(0, at));
  EXPECT_EQ(a.substr(a.find('\n', at + 1)), b.substr(b.find('\n', at + 1)));
}

// Property: 50 h at 1 Hz of two spacecraft with everything that there is stays below 3 MB. Each
// series differs in every sample, which is the worst case for the page's size.
TEST(ReportPageTest, FiftyHoursStayBelowThreeMegabytes) {
  Report report = small_report();
  report.length = 50h;
  for (int chart = 0; chart < 12; ++chart) {
    Report::TimeChart one{.title = "Chart " + std::to_string(chart), .unit = "m", .series = {}};
    for (int k = 0; k < 2; ++k) {
      SeriesEnvelope values;
      for (int i = 0; i < 180'000; ++i) values.add(i * 1s, std::sin(0.37 * i) * (k + 1.2345678));
      one.series.push_back({"series", values});
    }
    report.time_charts.push_back(std::move(one));
  }
  for (int link = 0; link < 2; ++link) {
    Report::MessageGroup group{.kind = "delivered", .messages = {}, .count = 180'000};
    for (int i = 0; i < 3000; ++i) group.messages.push_back({i * 60s, 1ms * (i * 7919 % 2000)});
    report.links.push_back({"link", {group, group}});
  }
  for (int i = 0; i < 5000; ++i)
    report.events.push_back({i * 36s, "deputy", "an event of the run"});
  EXPECT_LT(to_html(report).size(), 3'000'000u);
}

}  // namespace
}  // namespace orrery
