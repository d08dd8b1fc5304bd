#include <orrery/harness/kernel/time.hpp>
#include <orrery/harness/record/folder_comparison.hpp>

#include <algorithm>
#include <array>
#include <charconv>
#include <fstream>
#include <iterator>
#include <limits>
#include <set>
#include <stdexcept>
#include <string_view>

namespace orrery {
namespace {

namespace fs = std::filesystem;

constexpr std::array<std::string_view, 3> kHostTimes = {"\"wall_s\"", "\"flight_wall_s\"",
                                                        "\"x_real_time\""};

std::set<std::string> files_below(const fs::path& folder) {
  std::error_code error;
  if (!fs::is_directory(folder, error)) {
    throw std::runtime_error(folder.string() + " is not a folder that can be read");
  }
  std::set<std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    const fs::path name = entry.path().filename();
    const bool ignored = name == "manifest.json" || name == "index.html" || name == ".index.lock";
    if (entry.is_regular_file() && !ignored) {
      files.insert(entry.path().lexically_relative(folder).generic_string());
    }
  }
  return files;
}

std::string content_of(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw std::runtime_error(path.string() + " cannot be read");
  return std::string(std::istreambuf_iterator<char>(file), {});
}

std::vector<std::string_view> split(std::string_view text, char separator) {
  std::vector<std::string_view> parts;
  for (std::size_t begin = 0;;) {
    const std::size_t end = text.find(separator, begin);
    parts.push_back(text.substr(begin, end - begin));
    if (end == std::string_view::npos) return parts;
    begin = end + 1;
  }
}

// The n-th line, from 0, or nothing past the end.
std::optional<std::string_view> line(const std::vector<std::string_view>& lines, std::size_t n) {
  if (n >= lines.size() || (n + 1 == lines.size() && lines[n].empty())) return {};
  return lines[n];
}

std::string shown(const std::optional<std::string_view>& text) {
  constexpr std::size_t kMost = 100;
  if (!text) return "the end of the file";
  if (text->size() <= kMost) return '"' + std::string(*text) + '"';
  return '"' + std::string(text->substr(0, kMost)) + "...\"";
}

bool is_host_time(std::string_view summary_line) {
  return std::any_of(kHostTimes.begin(), kHostTimes.end(), [summary_line](std::string_view key) {
    return summary_line.find(key) != std::string_view::npos;
  });
}

// The report's line on speed and command line.
bool is_of_host(std::string_view report_line) {
  return report_line.starts_with(",\"host\":") || report_line.starts_with(",\"host_table\":");
}

bool is_text(std::string_view content) {
  return content.find('\0') == std::string_view::npos;
}

std::optional<std::int64_t> as_time(std::string_view field) {
  std::int64_t t = 0;
  const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), t);
  if (error != std::errc() || end != field.data() + field.size()) return {};
  return t;
}

FileDifference in_bytes(const std::string& file, std::string_view a, std::string_view b) {
  const auto parts = std::mismatch(a.begin(), a.end(), b.begin(), b.end());
  const auto at = parts.first - a.begin();
  return {file,
          {},
          "byte " + std::to_string(at) + " differs (" + std::to_string(a.size()) + " and " +
              std::to_string(b.size()) + " bytes)"};
}

std::optional<FileDifference> in_lines(const std::string& file, std::string_view a,
                                       std::string_view b) {
  const bool is_summary = fs::path(file).filename() == "summary.json";
  const bool is_report = fs::path(file).filename() == "report.html";
  const std::vector<std::string_view> x = split(a, '\n'), y = split(b, '\n');
  for (std::size_t n = 0; n < std::max(x.size(), y.size()); ++n) {
    const auto from_a = line(x, n), from_b = line(y, n);
    if (from_a == from_b) continue;
    if (is_summary && from_a && from_b && is_host_time(*from_a) && is_host_time(*from_b)) continue;
    if (is_report && from_a && from_b && is_of_host(*from_a) && is_of_host(*from_b)) continue;
    return FileDifference{
        file, {}, "line " + std::to_string(n + 1) + ": " + shown(from_a) + " and " + shown(from_b)};
  }
  return {};
}

// What differs between two rows, with the names of the columns.
std::string in_row(const std::vector<std::string_view>& columns, std::string_view a,
                   std::string_view b) {
  const std::vector<std::string_view> x = split(a, ','), y = split(b, ',');
  for (std::size_t n = 0; n < std::min(x.size(), y.size()); ++n) {
    if (x[n] == y[n]) continue;
    const std::string name = n < columns.size() ? std::string(columns[n]) : "a further column";
    return name + " is " + shown(x[n]) + " and " + shown(y[n]);
  }
  return std::to_string(x.size()) + " and " + std::to_string(y.size()) + " fields";
}

std::optional<FileDifference> in_table(const std::string& file, std::string_view a,
                                       std::string_view b) {
  const std::vector<std::string_view> x = split(a, '\n'), y = split(b, '\n');
  if (x.front() != y.front()) {
    return FileDifference{
        file, {}, "the columns are " + shown(x.front()) + " and " + shown(y.front())};
  }
  const std::vector<std::string_view> columns = split(x.front(), ',');
  const auto time_of = [&columns](const std::optional<std::string_view>& row) {
    return row && columns.front().ends_with("GPS_ns") ? as_time(split(*row, ',').front())
                                                      : std::nullopt;
  };
  const std::optional<std::int64_t> start = time_of(line(x, 1));
  for (std::size_t n = 1; n < std::max(x.size(), y.size()); ++n) {
    const auto from_a = line(x, n), from_b = line(y, n);
    if (from_a == from_b) continue;
    std::optional<std::int64_t> t = time_of(from_a), other = time_of(from_b);
    if (!t || (other && *other < *t)) t = other;
    std::string text = from_a && from_b ? in_row(columns, *from_a, *from_b)
                                        : shown(from_a) + " and " + shown(from_b);
    text += " in row " + std::to_string(n);
    if (t && start) text += ", " + to_string(Duration(*t - *start)) + " after the first";
    return FileDifference{file, t, text};
  }
  return {};
}

std::optional<FileDifference> compare_file(const fs::path& a, const fs::path& b,
                                           const std::string& file) {
  const std::string x = content_of(a / file), y = content_of(b / file);
  if (x == y) return {};
  if (!is_text(x) || !is_text(y)) return in_bytes(file, x, y);
  const bool is_table = fs::path(file).extension() == ".csv" && !x.empty() && !y.empty();
  return is_table ? in_table(file, x, y) : in_lines(file, x, y);
}

}  // namespace

std::vector<FileDifference> compare_folders(const fs::path& a, const fs::path& b) {
  const std::set<std::string> in_a = files_below(a), in_b = files_below(b);
  std::set<std::string> all = in_a;
  all.insert(in_b.begin(), in_b.end());
  std::vector<FileDifference> differences;
  for (const std::string& file : all) {
    if (in_a.count(file) == 0 || in_b.count(file) == 0) {
      const fs::path& owner = in_a.count(file) != 0 ? a : b;
      differences.push_back({file, {}, "is only in " + owner.string()});
    } else if (auto difference = compare_file(a, b, file)) {
      differences.push_back(*std::move(difference));
    }
  }
  std::stable_sort(differences.begin(), differences.end(),
                   [](const FileDifference& x, const FileDifference& y) {
                     constexpr auto kNever = std::numeric_limits<std::int64_t>::max();
                     return x.t_GPS_ns.value_or(kNever) < y.t_GPS_ns.value_or(kNever);
                   });
  return differences;
}

}  // namespace orrery
