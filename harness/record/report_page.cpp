#include <orrery/harness/record/number_format.hpp>
#include <orrery/harness/record/report_page.hpp>
#include <orrery/harness/record/report_template.hpp>

#include <charconv>
#include <cmath>
#include <string_view>

namespace orrery {
namespace {

// JSON by hand: numbers in arrays by the ten thousand, few strings.
void append_text(std::string& out, std::string_view text) {
  out += '"';
  for (const char c : text) {
    if (c == '"' || c == '\\') {
      out += '\\';
      out += c;
    } else if (c == '<') {
      out += "\\u003c";  // or "</script>" in a name would end the script
    } else if (static_cast<unsigned char>(c) < ' ') {
      constexpr std::string_view kHex = "0123456789abcdef";
      out += "\\u00";
      out += kHex[static_cast<unsigned char>(c) >> 4];
      out += kHex[static_cast<unsigned char>(c) & 15];
    } else {
      out += c;
    }
  }
  out += '"';
}

// Seven digits are finer than any screen, and half of what a double needs.
void append_value(std::string& out, double value) {
  if (!std::isfinite(value)) {
    out += "null";
    return;
  }
  char text[32];
  const auto end =
      std::to_chars(text, text + sizeof text, value, std::chars_format::general, 7).ptr;
  out.append(text, end);
}

void append_seconds(std::string& out, Duration t) {
  append_number(out, static_cast<double>(t / 1ms) / 1000);
}

template <class Items, class Append>
void append_array(std::string& out, const Items& items, Append append) {
  out += '[';
  bool first = true;
  for (const auto& item : items) {
    if (!first) out += ',';
    first = false;
    append(item);
  }
  out += ']';
}

void append_key(std::string& out, const char* key) {
  const char before = out.back() == '\n' ? out[out.size() - 2] : out.back();
  if (before != '{') out += ',';
  out += '"';
  out += key;
  out += "\":";
}

void append_envelope(std::string& out, const SeriesEnvelope& values) {
  using Span = SeriesEnvelope::Span;
  out += '{';
  append_key(out, "t");
  append_array(out, values.spans(), [&](const Span& s) { append_seconds(out, s.begin); });
  append_key(out, "lo");
  append_array(out, values.spans(), [&](const Span& s) { append_value(out, s.least); });
  append_key(out, "hi");
  append_array(out, values.spans(), [&](const Span& s) { append_value(out, s.most); });
  append_key(out, "last");
  append_array(out, values.spans(), [&](const Span& s) { append_value(out, s.last); });
  out += '}';
}

bool has_data(const Report::TimeChart& chart) {
  for (const Report::Series& series : chart.series) {
    if (!series.values.empty()) return true;
  }
  return false;
}

void append_chart(std::string& out, const Report::TimeChart& chart) {
  out += '{';
  append_key(out, "title");
  append_text(out, chart.title);
  append_key(out, "unit");
  append_text(out, chart.unit);
  append_key(out, "series");
  append_array(out, chart.series, [&](const Report::Series& series) {
    out += '{';
    append_key(out, "name");
    append_text(out, series.name);
    append_key(out, "values");
    append_envelope(out, series.values);
    out += '}';
  });
  if (!chart.sigma.empty()) {
    append_key(out, "sigma");
    append_envelope(out, chart.sigma);
    append_key(out, "sigma_name");
    append_text(out, chart.sigma_name);
  }
  out += '}';
}

void append_chart(std::string& out, const Report::PlaneChart& chart) {
  out += '{';
  append_key(out, "title");
  append_text(out, chart.title);
  append_key(out, "x");
  append_text(out, chart.x_label);
  append_key(out, "y");
  append_text(out, chart.y_label);
  append_key(out, "paths");
  append_array(out, chart.paths, [&](const Report::Path& path) {
    out += '{';
    append_key(out, "name");
    append_text(out, path.name);
    append_key(out, "x");
    append_array(out, path.points, [&](const auto& p) { append_value(out, p.first); });
    append_key(out, "y");
    append_array(out, path.points, [&](const auto& p) { append_value(out, p.second); });
    out += '}';
  });
  out += '}';
}

void append_timeline(std::string& out, const Report::Timeline& timeline) {
  out += '{';
  append_key(out, "name");
  append_text(out, timeline.name);
  append_key(out, "marks");
  append_array(out, timeline.marks, [&](const Report::Marks& marks) {
    out += '{';
    append_key(out, "kind");
    append_text(out, marks.kind);
    append_key(out, "at");
    append_array(out, marks.at, [&](Duration t) { append_seconds(out, t); });
    append_key(out, "count");
    append_number(out, std::uint64_t{marks.count});
    out += '}';
  });
  out += '}';
}

// A line of its own, so that a comparison can pass it over.
void append_rows(std::string& out, const char* key,
                 const std::vector<std::pair<std::string, std::string>>& rows) {
  out += '\n';
  append_key(out, key);
  append_array(out, rows, [&](const auto& row) {
    append_array(out, std::vector{row.first, row.second},
                 [&](const std::string& text) { append_text(out, text); });
  });
}

std::string to_json(const Report& report) {
  std::string out = "{";
  append_key(out, "title");
  append_text(out, report.title);
  append_key(out, "result");
  append_text(out, report.result);
  append_key(out, "length");
  append_seconds(out, report.length);
  append_rows(out, "header", report.header);
  append_rows(out, "host", report.host);
  out += '\n';
  append_key(out, "charts");
  std::vector<Report::TimeChart> with_data;
  for (const Report::TimeChart& chart : report.time_charts) {
    if (has_data(chart)) with_data.push_back(chart);
  }
  append_array(out, with_data, [&](const Report::TimeChart& chart) { append_chart(out, chart); });
  append_key(out, "planes");
  append_array(out, report.plane_charts,
               [&](const Report::PlaneChart& chart) { append_chart(out, chart); });
  append_key(out, "timelines");
  append_array(out, report.timelines,
               [&](const Report::Timeline& timeline) { append_timeline(out, timeline); });
  append_key(out, "events");
  append_array(out, report.events, [&](const Report::Event& event) {
    out += '[';
    append_seconds(out, event.at);
    out += ',';
    append_text(out, event.where);
    out += ',';
    append_text(out, event.what);
    out += ']';
  });
  return out + "}";
}

}  // namespace

std::string to_html(const Report& report) {
  constexpr std::string_view kPlace = "@DATA@";
  std::string page(report_template());
  return page.replace(page.find(kPlace), kPlace.size(), to_json(report));
}

}  // namespace orrery
