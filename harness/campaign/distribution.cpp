#include <orrery/harness/campaign/distribution.hpp>
#include <orrery/harness/kernel/text.hpp>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>

namespace orrery {
namespace {

constexpr double kMostSigmas = 8;  // beyond, what is left of the normal has no digits

std::string list(const std::vector<double>& values) {
  std::string text;
  for (const double value : values) text += (text.empty() ? "" : ", ") + to_text(value);
  return text;
}

std::string text_of(const Normal& d) {
  return "Normal(" + list({d.mean, d.sigma}) + ")";
}
std::string text_of(const Uniform& d) {
  return "Uniform(" + list({d.low, d.high}) + ")";
}
std::string text_of(const LogNormal& d) {
  return "LogNormal(" + list({d.median, d.sigma}) + ")";
}
std::string text_of(const TruncatedNormal& d) {
  return "TruncatedNormal(" + list({d.mean, d.sigma, d.low, d.high}) + ")";
}
std::string text_of(const Discrete& d) {
  return "Discrete(" + list(d.values) + (d.weights.empty() ? "" : "; weights " + list(d.weights)) +
         ")";
}

template <class D>
void require(bool good, const D& distribution, const char* accepted) {
  if (!good) throw std::invalid_argument(text_of(distribution) + ": expected " + accepted);
}

// Of the standard normal. erfc keeps the digits of the lower tail.
double normal_cdf(double x) {
  return std::erfc(-x / std::sqrt(2.0)) / 2;
}

double value_at(const Normal& d, double p) {
  return d.mean + d.sigma * normal_quantile(p);
}
double value_at(const Uniform& d, double p) {
  return d.low + p * (d.high - d.low);
}
double value_at(const LogNormal& d, double p) {
  return d.median * std::exp(d.sigma * normal_quantile(p));
}
double value_at(const TruncatedNormal& d, double p) {
  // In the tail that has the digits: above the mean everything is mirrored.
  const bool mirrored = d.low + d.high > 2 * d.mean;
  const double a = (mirrored ? d.mean - d.high : d.low - d.mean) / d.sigma;
  const double b = (mirrored ? d.mean - d.low : d.high - d.mean) / d.sigma;
  const double low = normal_cdf(a), high = normal_cdf(b);
  const double x = normal_quantile(low + (mirrored ? 1 - p : p) * (high - low));
  return std::clamp(d.mean + (mirrored ? -x : x) * d.sigma, d.low, d.high);
}
double value_at(const Discrete& d, double p) {
  if (d.weights.empty()) {
    const double place = p * static_cast<double>(d.values.size());
    return d.values[std::min(static_cast<std::size_t>(place), d.values.size() - 1)];
  }
  double left = p * std::accumulate(d.weights.begin(), d.weights.end(), 0.0);
  std::size_t last = 0;
  for (std::size_t i = 0; i < d.values.size(); ++i) {
    if (d.weights[i] == 0) continue;
    last = i;
    left -= d.weights[i];
    if (left < 0) break;
  }
  return d.values[last];
}

bool are_weights(const std::vector<double>& weights) {
  return std::all_of(weights.begin(), weights.end(),
                     [](double w) { return w >= 0 && std::isfinite(w); }) &&
         std::any_of(weights.begin(), weights.end(), [](double w) { return w > 0; });
}

}  // namespace

Distribution::Distribution(const Normal& d) : any_(d) {
  require(std::isfinite(d.mean) && std::isfinite(d.sigma) && d.sigma >= 0, d,
          "a finite mean and sigma >= 0");
}

Distribution::Distribution(const Uniform& d) : any_(d) {
  require(std::isfinite(d.low) && std::isfinite(d.high) && d.low <= d.high, d,
          "finite low <= high");
}

Distribution::Distribution(const LogNormal& d) : any_(d) {
  require(std::isfinite(d.median) && d.median > 0 && std::isfinite(d.sigma) && d.sigma >= 0, d,
          "a median above 0 and sigma >= 0");
}

Distribution::Distribution(const TruncatedNormal& d) : any_(d) {
  const bool finite = std::isfinite(d.mean) && std::isfinite(d.sigma) && std::isfinite(d.low) &&
                      std::isfinite(d.high);
  require(finite && d.sigma > 0 && d.low < d.high, d, "sigma > 0 and low < high, finite");
  require(d.low - d.mean <= kMostSigmas * d.sigma && d.mean - d.high <= kMostSigmas * d.sigma, d,
          "an interval that begins within 8 sigma of the mean");
}

Distribution::Distribution(const Discrete& d) : any_(d) {
  const bool finite = std::all_of(d.values.begin(), d.values.end(),
                                  [](double value) { return std::isfinite(value); });
  require(!d.values.empty() && finite, d, "at least one value, all finite");
  require(d.weights.empty() || (d.weights.size() == d.values.size() && are_weights(d.weights)), d,
          "no weights, or one per value, >= 0 and not all 0");
}

double Distribution::at(double p) const {
  if (!(p > 0 && p < 1)) {
    throw std::invalid_argument("Distribution::at: p = " + to_text(p) + "; accepted: in (0, 1)");
  }
  return std::visit([p](const auto& d) { return value_at(d, p); }, any_);
}

std::string Distribution::to_string() const {
  return std::visit([](const auto& d) { return text_of(d); }, any_);
}

}  // namespace orrery
