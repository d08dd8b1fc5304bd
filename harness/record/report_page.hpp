/// report.html: one page that opens from disk, without a network.
#pragma once

#include <orrery/harness/kernel/simulator_only.hpp>
#include <orrery/harness/kernel/time.hpp>
#include <orrery/harness/record/series_envelope.hpp>

#include <optional>
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
    /// A dashed line, where it is near what is drawn; its name and value are shown in any case.
    std::optional<double> limit = {};
    std::string limit_name = "";
    int colour = 0;     // of the first series, 0 to 5
    int height_px = 0;  // 0: as most
  };
  /// Of something relative to `origin`, in its R, T, N; drawn in three planes, to one scale.
  struct Path {
    std::string name;
    struct Point {
      Duration t{};
      double r = 0, t_along = 0, n = 0;
    };
    std::vector<Point> points;
  };
  /// Messages of one kind ("delivered", "lost", "reordered", ...), which the page colours by it.
  struct MessageGroup {
    std::string kind;
    struct Message {
      Duration sent{};
      std::optional<Duration> took = {};  // empty: it never arrived
    };
    std::vector<Message> messages = {};  // in order of sending
    std::size_t count = 0;               // all of them, where `messages` is thinned
  };
  struct Link {
    std::string name;  // "chief-deputy"
    std::vector<MessageGroup> groups;
  };
  /// What something was: each state holds until the next. "off" is shown as an alarm.
  struct Lane {
    std::string name;
    std::vector<std::pair<Duration, std::string>> states;
  };
  /// Shaded across all that is drawn over time.
  struct Fault {
    std::string where, what;
    Duration from{};
    std::optional<Duration> until = {};  // empty: to the end
  };
  /// Rows as arena_map() has them.
  struct Arena {
    std::string name, caption;
    std::vector<std::string> rows;
  };
  /// Pictures in order of time: PNG as base64.
  struct Film {
    struct Picture {
      Duration at{};
      std::string caption, png_base64;
    };
    std::string name;
    std::vector<Picture> pictures;
  };
  struct Event {
    Duration at{};
    std::string where, what;
  };
  struct Table {
    std::vector<std::string> columns;
    std::vector<std::vector<std::string>> rows;
  };

  std::string title, result;
  Duration length{};
  std::vector<std::pair<std::string, std::string>> header = {};  // shown as a table
  /// Shown after it; equal runs differ in these (orrery-compare passes them over).
  std::vector<std::pair<std::string, std::string>> host = {};
  Table table = {};
  Table host_table = {};  // as `host`
  std::vector<TimeChart> time_charts = {};
  std::string origin = {};  // of the paths: "chief"
  std::vector<Path> paths = {};
  std::vector<Link> links = {};
  std::vector<Lane> lanes = {};
  std::vector<Fault> faults = {};
  std::vector<Arena> arenas = {};
  std::vector<Film> films = {};
  std::vector<Event> events = {};
};

/// The text of the page: data, style and script in one file. Charts, paths and links without data
/// are left out. Opened as report.html#selftest it measures its own curves, for tests.
std::string to_html(const Report& report);

}  // namespace orrery
