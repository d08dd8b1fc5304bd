#include <orrery/harness/record/json_text.hpp>
#include <orrery/harness/record/number_format.hpp>
#include <orrery/harness/record/report_assets.hpp>
#include <orrery/harness/record/report_page.hpp>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <stdexcept>
#include <string_view>

namespace orrery {
namespace {

using Span = SeriesEnvelope::Span;

// JSON by hand: numbers in arrays by the ten thousand, few strings.

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

void append_ms(std::string& out, Duration t) {
  append_number(out, std::int64_t{t / 1ms});
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

void append_texts(std::string& out, const std::vector<std::string>& texts) {
  append_array(out, texts, [&out](const std::string& text) { append_json_text(out, text); });
}

void append_key(std::string& out, const char* key) {
  const char before = out.back() == '\n' ? out[out.size() - 2] : out.back();
  if (before != '{') out += ',';
  out += '"';
  out += key;
  out += "\":";
}

void append_member(std::string& out, const char* key, std::string_view text) {
  append_key(out, key);
  append_json_text(out, text);
}

// Differences of times are short, and most often the same.
template <class Items, class Time>
void append_times(std::string& out, const Items& items, Time time) {
  std::int64_t last_ms = 0;
  append_array(out, items, [&](const auto& item) {
    const std::int64_t ms = time(item) / 1ms;
    append_number(out, ms - last_ms);
    last_ms = ms;
  });
}

// A column that is the same as the one before is left out, and so is (as null) a value of it.
void append_unless_equal(std::string& out, const char* key, const std::vector<Span>& spans,
                         double Span::*value, double Span::*before) {
  const auto same = [&](const Span& s) { return s.*value == s.*before; };
  if (std::all_of(spans.begin(), spans.end(), same)) return;
  append_key(out, key);
  append_array(out, spans, [&](const Span& s) {
    if (same(s)) {
      out += "null";
    } else {
      append_value(out, s.*value);
    }
  });
}

void append_envelope(std::string& out, const SeriesEnvelope& values) {
  const std::vector<Span>& spans = values.spans();
  out += '{';
  append_key(out, "t");
  append_times(out, spans, [](const Span& s) { return s.begin; });
  append_key(out, "lo");
  append_array(out, spans, [&](const Span& s) { append_value(out, s.least); });
  append_unless_equal(out, "hi", spans, &Span::most, &Span::least);
  append_unless_equal(out, "last", spans, &Span::last, &Span::most);
  out += '}';
}

bool has_data(const Report::TimeChart& chart) {
  return std::any_of(chart.series.begin(), chart.series.end(),
                     [](const Report::Series& series) { return !series.values.empty(); });
}

void append_chart(std::string& out, const Report::TimeChart& chart) {
  out += '{';
  append_member(out, "title", chart.title);
  append_member(out, "unit", chart.unit);
  append_key(out, "series");
  append_array(out, chart.series, [&](const Report::Series& series) {
    out += '{';
    append_member(out, "name", series.name);
    append_key(out, "values");
    append_envelope(out, series.values);
    out += '}';
  });
  if (!chart.sigma.empty()) {
    append_key(out, "sigma");
    append_envelope(out, chart.sigma);
    append_member(out, "sigma_name", chart.sigma_name);
  }
  if (chart.limit) {
    append_key(out, "limit");
    append_value(out, *chart.limit);
    append_member(out, "limit_name", chart.limit_name);
  }
  append_key(out, "colour");
  append_number(out, std::int64_t{chart.colour});
  if (chart.height_px > 0) {
    append_key(out, "height");
    append_number(out, std::int64_t{chart.height_px});
  }
  out += '}';
}

void append_path(std::string& out, const Report::Path& path) {
  using Point = Report::Path::Point;
  out += '{';
  append_member(out, "name", path.name);
  append_key(out, "t");
  append_array(out, path.points, [&](const Point& p) { append_seconds(out, p.t); });
  append_key(out, "R");
  append_array(out, path.points, [&](const Point& p) { append_value(out, p.r); });
  append_key(out, "T");
  append_array(out, path.points, [&](const Point& p) { append_value(out, p.t_along); });
  append_key(out, "N");
  append_array(out, path.points, [&](const Point& p) { append_value(out, p.n); });
  out += '}';
}

void append_link(std::string& out, const Report::Link& link) {
  using Message = Report::MessageGroup::Message;
  out += '{';
  append_member(out, "name", link.name);
  append_key(out, "groups");
  append_array(out, link.groups, [&](const Report::MessageGroup& group) {
    out += '{';
    append_member(out, "kind", group.kind);
    append_key(out, "count");
    append_number(out, std::uint64_t{group.count});
    append_key(out, "sent");
    append_times(out, group.messages, [](const Message& m) { return m.sent; });
    append_key(out, "took");
    append_array(out, group.messages, [&](const Message& m) {
      if (m.took) {
        append_ms(out, *m.took);
      } else {
        out += "null";
      }
    });
    out += '}';
  });
  out += '}';
}

void append_lane(std::string& out, const Report::Lane& lane) {
  out += '{';
  append_member(out, "name", lane.name);
  append_key(out, "states");
  append_array(out, lane.states, [&](const auto& state) {
    out += '[';
    append_seconds(out, state.first);
    out += ',';
    append_json_text(out, state.second);
    out += ']';
  });
  out += '}';
}

void append_fault(std::string& out, const Report::Fault& fault) {
  out += '{';
  append_member(out, "where", fault.where);
  append_member(out, "what", fault.what);
  append_key(out, "from");
  append_seconds(out, fault.from);
  if (fault.until) {
    append_key(out, "until");
    append_seconds(out, *fault.until);
  }
  out += '}';
}

void append_arena(std::string& out, const Report::Arena& arena) {
  out += '{';
  append_member(out, "name", arena.name);
  append_member(out, "caption", arena.caption);
  append_key(out, "rows");
  append_texts(out, arena.rows);
  out += '}';
}

void append_film(std::string& out, const Report::Film& film) {
  out += '{';
  append_member(out, "name", film.name);
  append_key(out, "pictures");
  append_array(out, film.pictures, [&out](const Report::Film::Picture& picture) {
    out += '{';
    append_key(out, "at");
    append_seconds(out, picture.at);
    append_member(out, "caption", picture.caption);
    append_member(out, "png", picture.png_base64);
    out += '}';
  });
  out += '}';
}

void append_event(std::string& out, const Report::Event& event) {
  out += '[';
  append_seconds(out, event.at);
  out += ',';
  append_json_text(out, event.where);
  out += ',';
  append_json_text(out, event.what);
  out += ']';
}

// A line of its own, so that a comparison can pass it over.
void append_rows(std::string& out, const char* key,
                 const std::vector<std::pair<std::string, std::string>>& rows) {
  out += '\n';
  append_key(out, key);
  append_array(out, rows, [&](const auto& row) { append_texts(out, {row.first, row.second}); });
}

void append_table(std::string& out, const char* key, const Report::Table& table) {
  if (table.rows.empty()) return;
  append_key(out, key);
  out += '{';
  append_key(out, "columns");
  append_texts(out, table.columns);
  append_key(out, "rows");
  append_array(out, table.rows, [&](const auto& row) { append_texts(out, row); });
  out += '}';
}

template <class Items, class Keep, class Append>
void append_list(std::string& out, const char* key, const Items& items, Keep keep, Append append) {
  append_key(out, key);
  out += '[';
  bool first = true;
  for (const auto& item : items) {
    if (!keep(item)) continue;
    out += first ? "\n" : ",\n";
    first = false;
    append(out, item);
  }
  out += ']';
}

std::string to_json(const Report& report) {
  const auto all = [](const auto&) { return true; };
  std::string out = "{";
  append_member(out, "title", report.title);
  append_member(out, "result", report.result);
  append_key(out, "length");
  append_seconds(out, report.length);
  append_rows(out, "header", report.header);
  append_rows(out, "host", report.host);
  out += '\n';
  append_table(out, "host_table", report.host_table);
  out += '\n';
  append_table(out, "table", report.table);
  append_list(out, "charts", report.time_charts, has_data, append_chart);
  append_member(out, "origin", report.origin);
  append_list(
      out, "paths", report.paths, [](const Report::Path& path) { return !path.points.empty(); },
      append_path);
  append_list(
      out, "links", report.links, [](const Report::Link& link) { return !link.groups.empty(); },
      append_link);
  append_list(out, "lanes", report.lanes, all, append_lane);
  append_list(out, "faults", report.faults, all, append_fault);
  append_list(out, "arenas", report.arenas, all, append_arena);
  append_list(
      out, "films", report.films, [](const Report::Film& film) { return !film.pictures.empty(); },
      append_film);
  append_list(out, "events", report.events, all, append_event);
  return out + "}";
}

}  // namespace

std::string filled_in(std::string_view page,
                      const std::vector<std::pair<std::string_view, std::string_view>>& texts) {
  std::string out;
  for (std::size_t at = 0;;) {
    const std::size_t begin = page.find("{{", at), end = page.find("}}", begin);
    out += page.substr(at, begin - at);
    if (begin == std::string_view::npos) return out;
    const std::string_view name = page.substr(begin + 2, end - begin - 2);
    const auto found = std::find_if(texts.begin(), texts.end(),
                                    [name](const auto& text) { return text.first == name; });
    if (found == texts.end()) throw std::logic_error("filled_in: no text " + std::string(name));
    out += found->second;
    at = end + 2;
  }
}

std::string to_html(const Report& report) {
  return filled_in(
      report_html(),
      {{"style", report_style()}, {"data", to_json(report)}, {"script", report_script()}});
}

}  // namespace orrery
