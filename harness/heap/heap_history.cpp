#include <orrery/harness/heap/heap_history.hpp>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace orrery {
namespace {

std::uint32_t narrow(std::uint64_t bytes) {
  return static_cast<std::uint32_t>(std::min<std::uint64_t>(bytes, UINT32_MAX));
}

struct Line {
  double slope = 0, sigma = 0;
};

// Least squares on (t - mean t): centred, so that no digits are lost to the size of the values.
Line fit(const std::vector<double>& t, const std::vector<double>& y) {
  const double n = static_cast<double>(t.size());
  double t_mean = 0, y_mean = 0;
  for (std::size_t i = 0; i < t.size(); ++i) {
    t_mean += t[i] / n;
    y_mean += y[i] / n;
  }
  double s_tt = 0, s_ty = 0;
  for (std::size_t i = 0; i < t.size(); ++i) {
    s_tt += (t[i] - t_mean) * (t[i] - t_mean);
    s_ty += (t[i] - t_mean) * (y[i] - y_mean);
  }
  Line line;
  line.slope = s_ty / s_tt;
  double residuals = 0;
  for (std::size_t i = 0; i < t.size(); ++i) {
    const double residual = y[i] - y_mean - line.slope * (t[i] - t_mean);
    residuals += residual * residual;
  }
  line.sigma = std::sqrt(residuals / (n - 2) / s_tt);
  return line;
}

}  // namespace

HeapHistory::Row HeapHistory::row_of(const HeapSample& sample) {
  return {.t = sample.t,
          .allocations = sample.allocations,
          .resting_bytes = narrow(sample.resting_bytes),
          .transient_peak_bytes = narrow(sample.transient_peak_bytes),
          .heap_bytes = narrow(sample.heap_bytes),
          .largest_free_bytes = narrow(sample.largest_free_bytes),
          .free_list_length = narrow(sample.free_list_length)};
}

HeapSample HeapHistory::sample(std::size_t i) const {
  const Row& row = rows_.at(i);
  return {.t = row.t,
          .resting_bytes = row.resting_bytes,
          .transient_peak_bytes = row.transient_peak_bytes,
          .heap_bytes = row.heap_bytes,
          .largest_free_bytes = row.largest_free_bytes,
          .free_list_length = row.free_list_length,
          .allocations = row.allocations};
}

std::vector<HeapSample> HeapHistory::samples() const {
  std::vector<HeapSample> all;
  all.reserve(rows_.size());
  for (std::size_t i = 0; i < rows_.size(); ++i) all.push_back(sample(i));
  return all;
}

// `later` follows `earlier`: one for both.
HeapHistory::Row HeapHistory::merged(const Row& earlier, const Row& later) {
  Row both = later;
  both.transient_peak_bytes = std::max(earlier.transient_peak_bytes, later.transient_peak_bytes);
  both.allocations += earlier.allocations;
  return both;
}

void HeapHistory::add(const HeapSample& call) {
  ++calls_;
  if (calls_in_last_ > 0 && calls_in_last_ < calls_per_sample_) {
    rows_.back() = merged(rows_.back(), row_of(call));
    ++calls_in_last_;
    return;
  }
  if (rows_.size() == kMost) {
    for (std::size_t i = 0; i < kMost / 2; ++i) rows_[i] = merged(rows_[2 * i], rows_[2 * i + 1]);
    rows_.resize(kMost / 2);
    calls_per_sample_ *= 2;
  }
  rows_.push_back(row_of(call));
  calls_in_last_ = 1;
}

HeapTrend heap_trend(const HeapHistory& history, Duration from, Duration until) {
  constexpr double kDay_s = 86'400;
  std::vector<double> t_day, resting, heap;
  HeapTrend trend;
  SimTime first, last;
  for (const HeapSample& sample : history.samples()) {
    const Duration elapsed = sample.t - history.start();
    if (elapsed < from || elapsed >= until) continue;
    if (t_day.empty()) first = sample.t;
    last = sample.t;
    t_day.push_back(to_seconds(elapsed) / kDay_s);
    resting.push_back(static_cast<double>(sample.resting_bytes));
    heap.push_back(static_cast<double>(sample.heap_bytes));
  }
  if (t_day.size() < 3 || first == last) {
    throw std::invalid_argument("heap_trend: " + std::to_string(t_day.size()) +
                                " samples in the window; expected 3 or more, not all at once");
  }
  const Line line = fit(t_day, resting);
  trend.samples = t_day.size();
  trend.span = last - first;
  trend.resting_bytes_per_day = line.slope;
  trend.resting_sigma_bytes_per_day = line.sigma;
  trend.heap_bytes_per_day = fit(t_day, heap).slope;
  return trend;
}

}  // namespace orrery
