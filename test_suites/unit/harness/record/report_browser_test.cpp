// Opens report.html in headless Chromium, and reads the curves back from the pixels that it drew.
#include <orrery/harness/record/report_page.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>

#include "browser.hpp"
#include "scratch_folder.hpp"

namespace orrery {
namespace {

constexpr Duration kLength = 50h;

// The curves, by their formulas. The second one jumps between 0 and 7 from sample to sample around
// the middle of the run: a page that thins by leaving samples out, or by means, shows something
// else.
double slow(double t_s) {
  return 40 + 30 * std::sin(2 * M_PI * t_s / 40'000);
}
double jumping(double t_s, int sample) {
  const bool middle = std::abs(t_s - to_seconds(kLength) / 2) < 1800;
  return middle ? 7.0 * (sample % 2) : 2.0;
}

// As a filter's error: metres until it has converged, within millimetres from there on.
double converging(double t_s) {
  return t_s < 600 ? -5 : 0.004 * std::sin(2 * M_PI * t_s / 20'000);
}

Report full_report() {
  Report report{.title = "ReportBrowserTest", .result = "failed", .length = kLength};
  SeriesEnvelope a, b, c, sigma, burns;
  for (int i = 0; i <= 180'000; ++i) {
    a.add(i * 1s, slow(i));
    b.add(i * 1s, jumping(i, i));
    c.add(i * 1s, converging(i));
    sigma.add(i * 1s, 3);
  }
  for (const Duration t : std::initializer_list<Duration>{5h, 5h + 6min, 25h, 25h + 6min, 45h})
    burns.add(t, 1);
  report.header = {{"seed", "1"}};
  report.host = {{"replay", "./test --gtest_filter='A.B' --orrery_seed=1 & more <of it>"}};
  report.table = {{"", "delta-v"}, {{"deputy", "0.3"}}};
  report.time_charts = {{.title = "Slow", .unit = "m", .series = {{"slow", a}}},
                        {.title = "Jumping", .unit = "bytes", .series = {{"a", b}, {"b", a}}},
                        {.title = "Converging", .unit = "m", .series = {{"c", c}}},
                        {.title = "Burns", .unit = "Ns", .series = {{"burns", burns}}}};
  report.time_charts[1].sigma = sigma;
  report.time_charts[1].limit = 60;
  report.time_charts[2].sigma = sigma;
  report.origin = "chief";
  report.paths = {{"deputy", {}}};
  for (int i = 0; i < 100; ++i) {
    report.paths[0].points.push_back({i * 30min, std::cos(0.1 * i), 2 * std::sin(0.1 * i), 1});
  }
  report.links = {{"chief-deputy",
                   {{.kind = "delivered", .messages = {{1h, 100ms}, {3h, 250ms}}, .count = 2},
                    {.kind = "lost", .messages = {{2h, {}}}, .count = 1},
                    {.kind = "reordered", .messages = {{2h, 3h}}, .count = 1}}}};
  report.lanes = {{"deputy process", {{0s, "on"}, {20h, "off"}}}};
  report.faults = {{"deputy/gnss", "outage", 10h, 12h}, {"chief-deputy", "loss", 30h, {}}};
  report.arenas = {{"Heap of deputy", "16 bytes per cell", {"##5.", "1."}}};
  // One white pixel.
  report.films = {
      {"chief camera",
       {{1h, "frame 1",
         "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAAAAAA6fptVAAAACklEQVR4nGP4DwABAQEAsTj2FAAAAABJRU5E"
         "rkJggg=="}}}};
  report.events = {{5s, "deputy", "impulse of 1 m/s"}};
  return report;
}

// The least and the most that a curve has between two times.
std::pair<double, double> range_of(const std::string& name, double from_s, double until_s) {
  double least = 1e9, most = -1e9;
  for (int i = static_cast<int>(std::ceil(from_s)); i <= static_cast<int>(until_s); ++i) {
    const double value = name == "a" ? jumping(i, i) : name == "c" ? converging(i) : slow(i);
    least = std::min(least, value);
    most = std::max(most, value);
  }
  return {least, most};
}

TEST(ReportBrowserTest, EveryPlotShowsItsData) {
  if (!has_chromium()) {
    GTEST_SKIP() << "no chromium in PATH: apt-get install chromium, or ci/setup";
  }
  const ScratchFolder scratch;
  std::ofstream(scratch / "report.html") << to_html(full_report());
  const nlohmann::json page = measured(scratch / "report.html", scratch / "profile");
  ASSERT_TRUE(page.is_object());
  EXPECT_EQ(page["problems"], nlohmann::json::array()) << "script errors";
  std::vector<std::string> titles;
  for (const auto& chart : page["charts"]) {
    titles.push_back(chart["title"]);
    EXPECT_GT(chart["painted"].get<int>(), 500) << chart["title"];
  }
  EXPECT_THAT(titles, testing::UnorderedElementsAre(
                          "Along track and radial", "Cross track and radial",
                          "Along track and cross track", "Modes", "Slow [m]", "Jumping [bytes]",
                          "Converging [m]", "Burns [Ns]", "Link chief-deputy", "Heap of deputy"));
  EXPECT_EQ(page["pictures"], nlohmann::json::array({1})) << "widths, 0 where not decoded";
  int points = 0;
  for (const auto& chart : page["charts"]) {
    for (const auto& series : chart["series"]) {
      if (series["name"] == "burns") continue;
      // Half of the line's 1.4 px, half a pixel of rounding, and the blurred edge.
      const double tolerance = 2 * series["pixel"].get<double>();
      for (const auto& point : series["points"]) {
        // At least its column's values, at most those of the columns beside it, too.
        const double from_s = point["from"], until_s = point["until"], column_s = until_s - from_s;
        const auto own = range_of(series["name"], from_s, until_s);
        const auto wide = range_of(series["name"], from_s - column_s, until_s + column_s);
        const double least = point["least"], most = point["most"];
        EXPECT_LE(least, own.first + tolerance) << series["name"] << point;
        EXPECT_GE(least, wide.first - tolerance) << series["name"] << point;
        EXPECT_GE(most, own.second - tolerance) << series["name"] << point;
        EXPECT_LE(most, wide.second + tolerance) << series["name"] << point;
        ++points;
      }
    }
  }
  EXPECT_EQ(points, 4 * 7) << "seven columns of each curve";
  std::map<std::string, nlohmann::json> series;
  for (const auto& chart : page["charts"]) {
    for (const auto& one : chart["series"]) series[one["name"]] = one;
  }
  // The first ten minutes do not flatten the other 50 h: a chart of 5 m would have pixels of 30 mm.
  EXPECT_LT(series["c"]["pixel"].get<double>(), 2e-4);
  // Points at 5 h, 25 h and 45 h, of the columns that are measured; no line between them.
  ASSERT_EQ(series["burns"]["points"].size(), 3u) << series["burns"];
  for (const auto& point : series["burns"]["points"]) {
    // Of 2.2 px radius.
    const double tolerance = 4 * series["burns"]["pixel"].get<double>();
    EXPECT_NEAR(point["least"].get<double>(), 1, tolerance);
    EXPECT_NEAR(point["most"].get<double>(), 1, tolerance);
  }
}

}  // namespace
}  // namespace orrery
