#include <orrery/harness/record/report_page.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

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

Report small_report() {
  Report report{.title = "A \"quoted\" </script> name", .result = "passed", .length = 10s};
  report.header = {{"seed", "1"}};
  report.host = {{"speed", "5 x"}};
  SeriesEnvelope values;
  values.add(0s, 1.5);
  values.add(2500ms, -2);
  report.time_charts = {{.title = "Distance", .unit = "m", .series = {{"deputy", values}}},
                        {.title = "Nothing", .unit = "m", .series = {{"deputy", {}}}}};
  report.plane_charts = {{"Plane", "T [m]", "R [m]", {{"deputy", {{1, 2}, {3, 4}}}}}};
  report.timelines = {{"chief-deputy", {{"lost", {1s, 3s}, 2}}}};
  report.events = {{5s, "deputy", "impulse\nof 1 m/s"}};
  return report;
}

TEST(ReportPageTest, HoldsTheDataAsGiven) {
  const auto data = data_of(to_html(small_report()));
  EXPECT_EQ(data["title"], "A \"quoted\" </script> name");
  EXPECT_EQ(data["result"], "passed");
  EXPECT_EQ(data["length"], 10.0);
  EXPECT_EQ(data["header"], nlohmann::json::parse(R"([["seed","1"]])"));
  ASSERT_EQ(data["charts"].size(), 1u) << "a chart without data is left out";
  const auto& values = data["charts"][0]["series"][0]["values"];
  EXPECT_EQ(values["t"], nlohmann::json::parse("[0,2.5]"));
  EXPECT_EQ(values["lo"], nlohmann::json::parse("[1.5,-2]"));
  EXPECT_EQ(values["hi"], values["lo"]);
  EXPECT_EQ(data["planes"][0]["paths"][0]["y"], nlohmann::json::parse("[2,4]"));
  EXPECT_EQ(data["timelines"][0]["marks"][0]["at"], nlohmann::json::parse("[1,3]"));
  EXPECT_EQ(data["events"], nlohmann::json::parse(R"([[5,"deputy","impulse\nof 1 m/s"]])"));
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

}  // namespace
}  // namespace orrery
