#include <orrery/harness/heap/heap_history.hpp>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace orrery {
namespace {

// `later` follows `earlier`: one sample for both.
HeapSample merged(const HeapSample& earlier, const HeapSample& later) {
  HeapSample both = later;
  both.transient_peak_bytes = std::max(earlier.transient_peak_bytes, later.transient_peak_bytes);
  both.allocations += earlier.allocations;
  return both;
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

void HeapHistory::add(const HeapSample& call) {
  ++calls_;
  if (calls_in_last_ > 0 && calls_in_last_ < calls_per_sample_) {
    samples_.back() = merged(samples_.back(), call);
    ++calls_in_last_;
    return;
  }
  if (samples_.size() == kMost) {
    for (std::size_t i = 0; i < kMost / 2; ++i) {
      samples_[i] = merged(samples_[2 * i], samples_[2 * i + 1]);
    }
    samples_.resize(kMost / 2);
    calls_per_sample_ *= 2;
  }
  samples_.push_back(call);
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
