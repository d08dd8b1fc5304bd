/// report.html: one page that opens from disk, without a network.
#pragma once

#include <orrery/harness/kernel/simulator_only.hpp>
#include <orrery/harness/kernel/time.hpp>
#include <orrery/harness/record/series_envelope.hpp>

#include <string>
#include <utility>
#include <vector>

namespace orrery {

/// What the page shows. Times count from the run's start.
struct Report {
  struct Series {
    std::string name;
    SeriesEnvelope values;
  };
  /// Over time; all of them are zoomed together.
  struct TimeChart {
    std::string title, unit;
    std::vector<Series> series;
    /// A band of +- this about zero, where there is one.
    SeriesEnvelope sigma = SeriesEnvelope();
    std::string sigma_name = "";
  };
  struct Path {
    std::string name;
    std::vector<std::pair<double, double>> points;
  };
  /// One quantity over another, both axes to one scale.
  struct PlaneChart {
    std::string title, x_label, y_label;
    std::vector<Path> paths;
  };
  /// Instants of one kind on a line of a timeline.
  struct Marks {
    std::string kind;  // "lost", "reordered", ...: the page colours by it
    std::vector<Duration> at;
    std::size_t count = 0;  // all of them, where `at` is thinned
  };
  struct Timeline {
    std::string name;  // "chief-deputy"
    std::vector<Marks> marks;
  };
  struct Event {
    Duration at{};
    std::string where, what;
  };

  std::string title, result;
  Duration length{};
  std::vector<std::pair<std::string, std::string>> header;  // shown as a table
  /// Shown after it; equal runs differ in these (orrery-compare passes them over).
  std::vector<std::pair<std::string, std::string>> host;
  std::vector<TimeChart> time_charts;
  std::vector<PlaneChart> plane_charts;
  std::vector<Timeline> timelines;
  std::vector<Event> events;
};

/// The text of the page: data, style and script in one file. Charts without data are left out.
std::string to_html(const Report& report);

}  // namespace orrery
