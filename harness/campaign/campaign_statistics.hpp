/// What a report says of many runs: columns of numbers, their quantiles, histograms, correlations.
#pragma once

#include <orrery/harness/campaign/run_store.hpp>

#include <cstdint>
#include <string>
#include <vector>

namespace orrery {

/// One number per run, in the order of the runs; not a number where a run has none.
struct Column {
  std::string name;
  std::vector<double> values;
  std::string distribution = {};  // of a dispersion
};

/// All results of a campaign as columns.
struct CampaignTable {
  std::vector<const RunRecord*> runs;
  std::vector<Column> metrics, dispersions;
};
CampaignTable table_of(const MergedRuns& merged);

struct Histogram {
  double low = 0, high = 0;
  std::vector<std::uint32_t> counts;
};
/// Bins of equal width, 2 IQR n^(-1/3) as Freedman and Diaconis (1981) choose it, 5 to 60 of them;
/// one where all values are the same. Of the finite values.
Histogram histogram_of(const std::vector<double>& values);

/// Ascending, the finite ones.
std::vector<double> sorted_values(const std::vector<double>& values);
/// Nearest rank, as PercentileBelow judges. @param sorted  Not empty. @param percent  (0, 100].
double percentile_of(const std::vector<double>& sorted, double percent);

/// Spearman's rank correlation over the runs that have both; ties share their mean rank. 0 where
/// one of them does not vary, or fewer than three runs have both.
double rank_correlation(const std::vector<double>& a, const std::vector<double>& b);

struct Correlation {
  std::size_t metric = 0, dispersion = 0;  // indices; metric == metrics.size(): having failed
  double rho = 0;
};
/// Strongest first; equal ones in the order of the columns.
std::vector<Correlation> correlations_of(const CampaignTable& table);

/// Runs that did not pass, by outcome and first failing assertion or crash site; most first.
struct FailureGroup {
  std::string outcome, site, text;
  std::vector<std::uint32_t> runs;
};
std::vector<FailureGroup> failure_groups_of(const CampaignTable& table);

}  // namespace orrery
