#include <orrery/harness/campaign/campaign_report.hpp>
#include <orrery/harness/campaign/campaign_report_assets.hpp>
#include <orrery/harness/campaign/campaign_runner.hpp>
#include <orrery/harness/campaign/campaign_statistics.hpp>
#include <orrery/harness/campaign/pass_rate.hpp>
#include <orrery/harness/kernel/text.hpp>
#include <orrery/harness/record/json_text.hpp>
#include <orrery/harness/record/report_assets.hpp>

#include <algorithm>
#include <cmath>
#include <functional>

namespace orrery {
namespace {

constexpr double kConfidence = 0.95;
constexpr std::size_t kFewestScatters = 4, kMostScatters = 24, kMostRows = 10, kMostRunsNamed = 12;
constexpr double kPercents[] = {5, 25, 50, 75, 90, 95, 99, 100};

// ---- JSON, small and in a fixed order

std::string in_quotes(std::string_view text) {
  std::string out;
  append_json_text(out, text);
  return out;
}

// Six digits: what a screen shows.
std::string number(double value) {
  if (!std::isfinite(value)) return "null";
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", value);
  return text;
}

template <class Range, class Text>
std::string array_of(const Range& range, const Text& text) {
  std::string out = "[";
  for (const auto& one : range) out += (out.size() > 1 ? "," : "") + text(one);
  return out + "]";
}

std::string numbers(const std::vector<double>& values) {
  return array_of(values, number);
}

std::string metric_json(const Column& metric) {
  const std::vector<double> sorted = sorted_values(metric.values);
  double sum = 0, squares = 0;
  for (const double x : sorted) sum += x;
  const double n = static_cast<double>(sorted.size()), mean = sum / n;
  for (const double x : sorted) squares += (x - mean) * (x - mean);
  const Histogram h = histogram_of(metric.values);
  std::string quantiles;
  for (const double percent : kPercents) {
    if (sorted.empty()) break;
    quantiles += (quantiles.empty() ? "[" : ",[") + number(percent) + "," +
                 number(percentile_of(sorted, percent)) + "]";
  }
  return "{\"name\":" + in_quotes(metric.name) + ",\"n\":" + std::to_string(sorted.size()) +
         ",\"without\":" + std::to_string(metric.values.size() - sorted.size()) +
         ",\"mean\":" + number(mean) + ",\"sd\":" + number(std::sqrt(squares / (n - 1))) +
         ",\"quantiles\":[" + quantiles + "],\"low\":" + number(h.low) +
         ",\"high\":" + number(h.high) +
         ",\"counts\":" + array_of(h.counts, [](std::uint32_t c) { return std::to_string(c); }) +
         ",\"values\":" + numbers(metric.values) + "}";
}

std::string dispersion_json(const Column& dispersion) {
  return "{\"name\":" + in_quotes(dispersion.name) +
         ",\"distribution\":" + in_quotes(dispersion.distribution) +
         ",\"values\":" + numbers(dispersion.values) + "}";
}

// Rank correlations that so many runs show by chance once in 1000 at most are not worth a picture.
double least_correlation(std::size_t runs) {
  return runs < 4 ? 1 : std::min(1.0, 3.29 / std::sqrt(static_cast<double>(runs - 1)));
}

std::string correlations_json(const CampaignTable& table) {
  std::vector<Correlation> all = correlations_of(table);
  const std::size_t metrics = table.metrics.size();
  std::string pictures = "[", importance = "[";
  std::size_t shown = 0;
  for (const Correlation& c : all) {
    const std::string entry = "[" + std::to_string(c.metric) + "," + std::to_string(c.dispersion) +
                              "," + number(c.rho) + "]";
    importance += (importance.size() > 1 ? "," : "") + entry;
    const bool by_chance = std::fabs(c.rho) < least_correlation(table.runs.size());
    if (c.metric == metrics || shown >= (by_chance ? kFewestScatters : kMostScatters)) continue;
    ++shown;
    pictures += (pictures.size() > 1 ? "," : "") + entry;
  }
  return ",\"scatters\":" + pictures + "],\"correlations\":" + importance +
         "],\"least\":" + number(least_correlation(table.runs.size()));
}

std::string groups_json(const CampaignTable& table, const CampaignManifest& manifest) {
  return array_of(failure_groups_of(table), [&manifest](const FailureGroup& g) {
    std::string runs;
    for (std::size_t i = 0; i < std::min(g.runs.size(), kMostRunsNamed); ++i) {
      runs += (i > 0 ? ", " : "") + std::to_string(g.runs[i]);
    }
    if (g.runs.size() > kMostRunsNamed) runs += " ...";
    return "{\"outcome\":" + in_quotes(g.outcome) + ",\"site\":" + in_quotes(g.site) +
           ",\"text\":" + in_quotes(g.text) + ",\"count\":" + std::to_string(g.runs.size()) +
           ",\"runs\":" + in_quotes(runs) +
           ",\"replay\":" + in_quotes(replay_command_of(command_of(manifest, g.runs.front()))) +
           "}";
  });
}

// The runs with the largest values, largest first.
std::string worst_json(const CampaignTable& table, const CampaignManifest& manifest,
                       const std::function<double(std::size_t)>& value) {
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < table.runs.size(); ++i) {
    if (std::isfinite(value(i))) order.push_back(i);
  }
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return value(a) > value(b); });
  order.resize(std::min(order.size(), kMostRows));
  return array_of(order, [&](std::size_t i) {
    const RunRecord& r = *table.runs[i];
    return "[" + std::to_string(r.run) + "," + std::to_string(r.seed) + "," + number(value(i)) +
           "," + in_quotes(to_string(r.outcome)) + "," +
           in_quotes(replay_command_of(command_of(manifest, r.run))) + "]";
  });
}

std::string data_json(const CampaignManifest& manifest, const MergedRuns& merged) {
  const CampaignTable table = table_of(merged);
  std::uint64_t passed = 0, counts[kRunOutcomes] = {};
  for (const RunRecord* run : table.runs) ++counts[static_cast<std::size_t>(run->outcome)];
  passed = counts[0];
  const std::uint64_t n = std::max<std::uint64_t>(manifest.runs, table.runs.size());
  const PassRateInterval interval =
      n > 0 ? pass_rate_interval(passed, n, kConfidence) : PassRateInterval{};
  std::string outcomes;
  for (std::size_t i = 0; i < kRunOutcomes; ++i) {
    outcomes += (i > 0 ? ",[" : "[") + in_quotes(to_string(static_cast<RunOutcome>(i))) + "," +
                std::to_string(counts[i]) + "]";
  }
  std::string worst = "[";
  for (const Column& metric : table.metrics) {
    worst += (worst.size() > 1 ? "," : "") +
             worst_json(table, manifest, [&](std::size_t i) { return metric.values[i]; });
  }
  return "{\"test\":" + in_quotes(manifest.test) + ",\"program\":" + in_quotes(manifest.program) +
         ",\"sha256\":" + in_quotes(manifest.program_sha256) +
         ",\"seed\":" + std::to_string(manifest.base_seed) + ",\"n\":" + std::to_string(n) +
         ",\"missing\":" + std::to_string(n - table.runs.size()) +
         ",\"passed\":" + std::to_string(passed) + ",\"low\":" + number(interval.low) +
         ",\"high\":" + number(interval.high) + ",\"outcomes\":[" + outcomes +
         "],\"contradictions\":" +
         array_of(merged.contradictions,
                  [](const Contradiction& c) {
                    return in_quotes("run " + std::to_string(c.run) + ": " + c.what);
                  }) +
         ",\"runs\":" +
         array_of(table.runs, [](const RunRecord* r) { return std::to_string(r->run); }) +
         ",\"failed\":" +
         array_of(table.runs,
                  [](const RunRecord* r) {
                    return std::string(r->outcome == RunOutcome::kPassed ? "0" : "1");
                  }) +
         ",\"metrics\":" + array_of(table.metrics, metric_json) +
         ",\"dispersions\":" + array_of(table.dispersions, dispersion_json) +
         correlations_json(table) + ",\"groups\":" + groups_json(table, manifest) +
         ",\"slowest\":" +
         worst_json(table, manifest, [&](std::size_t i) { return table.runs[i]->wall_s; }) +
         ",\"worst\":" + worst + "]}";
}

std::string csv_field(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string out = "\"";
  for (const char c : text) out += c == '"' ? std::string("\"\"") : std::string(1, c);
  return out + "\"";
}

std::string csv_number(double value) {
  return std::isfinite(value) ? to_text(value) : "";
}

}  // namespace

std::string campaign_page(const CampaignManifest& manifest, const MergedRuns& merged) {
  return filled_in(campaign_html(), {{"style", report_style()},
                                     {"script", campaign_script()},
                                     {"data", data_json(manifest, merged)}});
}

std::string campaign_csv(const MergedRuns& merged) {
  const CampaignTable table = table_of(merged);
  std::string text = "run,seed,outcome";
  for (const Column& c : table.metrics) text += "," + csv_field(c.name);
  for (const Column& c : table.dispersions) text += "," + csv_field(c.name);
  text += ",simulated_s,events,fingerprint,wall_s,cpu_s,peak_kB,site\n";
  for (std::size_t i = 0; i < table.runs.size(); ++i) {
    const RunRecord& r = *table.runs[i];
    text += std::to_string(r.run) + "," + std::to_string(r.seed) + "," + to_string(r.outcome);
    for (const Column& c : table.metrics) text += "," + csv_number(c.values[i]);
    for (const Column& c : table.dispersions) text += "," + csv_number(c.values[i]);
    text += "," + to_text(r.simulated_s) + "," + std::to_string(r.events) + "," + r.fingerprint +
            "," + to_text(r.wall_s) + "," + to_text(r.cpu_s) + "," + std::to_string(r.peak_kB) +
            "," + csv_field(r.failure_site) + "\n";
  }
  return text;
}

}  // namespace orrery
