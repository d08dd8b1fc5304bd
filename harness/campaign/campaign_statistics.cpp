#include <orrery/harness/campaign/campaign_statistics.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <utility>

namespace orrery {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

/// Columns by name, in the order in which runs first have them.
class Columns {
 public:
  Columns(std::vector<Column>& columns, std::size_t rows) : columns_(columns), rows_(rows) {}
  Column& named(const std::string& name) {
    const auto [found, is_new] = index_.try_emplace(name, columns_.size());
    if (is_new) columns_.push_back({name, std::vector<double>(rows_, kNone)});
    return columns_[found->second];
  }

 private:
  std::vector<Column>& columns_;
  std::size_t rows_;
  std::map<std::string, std::size_t> index_;
};

// Ranks from 1; equal values share the mean of theirs.
std::vector<double> ranks_of(const std::vector<double>& values) {
  std::vector<std::size_t> order(values.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&values](std::size_t i, std::size_t j) { return values[i] < values[j]; });
  std::vector<double> ranks(values.size());
  for (std::size_t begin = 0, end = 0; begin < order.size(); begin = end) {
    while (end < order.size() && values[order[end]] == values[order[begin]]) ++end;
    const double mean = (static_cast<double>(begin) + static_cast<double>(end) + 1) / 2;
    for (std::size_t i = begin; i < end; ++i) ranks[order[i]] = mean;
  }
  return ranks;
}

// Pearson's correlation of numbers with the mean of 1 ... n.
double correlation_of_ranks(const std::vector<double>& a, const std::vector<double>& b) {
  const double mean = (static_cast<double>(a.size()) + 1) / 2;
  double ab = 0, aa = 0, bb = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    ab += (a[i] - mean) * (b[i] - mean);
    aa += (a[i] - mean) * (a[i] - mean);
    bb += (b[i] - mean) * (b[i] - mean);
  }
  return aa > 0 && bb > 0 ? ab / std::sqrt(aa * bb) : 0;
}

bool is_complete(const std::vector<double>& values) {
  return std::all_of(values.begin(), values.end(), [](double x) { return std::isfinite(x); });
}

}  // namespace

CampaignTable table_of(const MergedRuns& merged) {
  CampaignTable table;
  Columns metrics(table.metrics, merged.runs.size());
  Columns dispersions(table.dispersions, merged.runs.size());
  for (const auto& [index, record] : merged.runs) {
    const std::size_t row = table.runs.size();
    table.runs.push_back(&record);
    for (const auto& [name, value] : record.metrics) metrics.named(name).values[row] = value;
    for (const DrawnDispersion& d : record.dispersions) {
      Column& column = dispersions.named(d.name);
      column.values[row] = d.value;
      column.distribution = d.distribution;
    }
  }
  return table;
}

std::vector<double> sorted_values(const std::vector<double>& values) {
  std::vector<double> sorted;
  for (const double x : values) {
    if (std::isfinite(x)) sorted.push_back(x);
  }
  std::sort(sorted.begin(), sorted.end());
  return sorted;
}

double percentile_of(const std::vector<double>& sorted, double percent) {
  const double rank = std::ceil(percent * static_cast<double>(sorted.size()) / 100 - 1e-9);
  return sorted[static_cast<std::size_t>(std::max(rank, 1.0)) - 1];
}

Histogram histogram_of(const std::vector<double>& values) {
  const std::vector<double> sorted = sorted_values(values);
  if (sorted.empty()) return {};
  Histogram h{sorted.front(), sorted.back(), {}};
  if (h.low == h.high) {
    h.counts = {static_cast<std::uint32_t>(sorted.size())};
    return h;
  }
  const double iqr = percentile_of(sorted, 75) - percentile_of(sorted, 25);
  const double width = 2 * iqr / std::cbrt(static_cast<double>(sorted.size()));
  const double wanted = width > 0 ? std::ceil((h.high - h.low) / width) : 60;
  h.counts.resize(static_cast<std::size_t>(std::clamp(wanted, 5.0, 60.0)));
  const double scale = static_cast<double>(h.counts.size()) / (h.high - h.low);
  for (const double x : sorted) {
    const auto bin = static_cast<std::size_t>((x - h.low) * scale);
    ++h.counts[std::min(bin, h.counts.size() - 1)];
  }
  return h;
}

double rank_correlation(const std::vector<double>& a, const std::vector<double>& b) {
  std::vector<double> x, y;
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (!std::isfinite(a[i]) || !std::isfinite(b[i])) continue;
    x.push_back(a[i]);
    y.push_back(b[i]);
  }
  return x.size() < 3 ? 0 : correlation_of_ranks(ranks_of(x), ranks_of(y));
}

std::vector<Correlation> correlations_of(const CampaignTable& table) {
  std::vector<Column> metrics = table.metrics;
  Column failed{"failed", {}};
  for (const RunRecord* run : table.runs) {
    failed.values.push_back(is_result(run->outcome) ? run->outcome != RunOutcome::kPassed : kNone);
  }
  metrics.push_back(std::move(failed));
  // Columns without gaps, the usual ones, are ranked once.
  const auto ranked = [](const std::vector<Column>& columns) {
    std::vector<std::vector<double>> ranks;
    for (const Column& c : columns) {
      ranks.push_back(is_complete(c.values) ? ranks_of(c.values) : std::vector<double>());
    }
    return ranks;
  };
  const auto metric_ranks = ranked(metrics), dispersion_ranks = ranked(table.dispersions);
  std::vector<Correlation> all;
  for (std::size_t m = 0; m < metrics.size(); ++m) {
    for (std::size_t d = 0; d < table.dispersions.size(); ++d) {
      const bool complete = !metric_ranks[m].empty() && !dispersion_ranks[d].empty();
      const double rho = table.runs.size() < 3 ? 0
                         : complete
                             ? correlation_of_ranks(metric_ranks[m], dispersion_ranks[d])
                             : rank_correlation(metrics[m].values, table.dispersions[d].values);
      all.push_back({m, d, rho});
    }
  }
  std::stable_sort(all.begin(), all.end(), [](const Correlation& a, const Correlation& b) {
    return std::fabs(a.rho) > std::fabs(b.rho);
  });
  return all;
}

std::vector<FailureGroup> failure_groups_of(const CampaignTable& table) {
  std::map<std::pair<std::string, std::string>, FailureGroup> groups;
  for (const RunRecord* run : table.runs) {
    if (run->outcome == RunOutcome::kPassed) continue;
    FailureGroup& group = groups[{to_string(run->outcome), run->failure_site}];
    if (group.runs.empty()) {
      group.outcome = to_string(run->outcome);
      group.site = run->failure_site;
      group.text = run->failure_text;
    }
    group.runs.push_back(run->run);
  }
  std::vector<FailureGroup> all;
  for (auto& [key, group] : groups) all.push_back(std::move(group));
  std::stable_sort(all.begin(), all.end(), [](const FailureGroup& a, const FailureGroup& b) {
    return a.runs.size() > b.runs.size();
  });
  return all;
}

}  // namespace orrery
