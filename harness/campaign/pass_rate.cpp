#include <orrery/harness/campaign/pass_rate.hpp>
#include <orrery/harness/kernel/text.hpp>

#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

namespace orrery {
namespace {

// Continued fraction of I_x(a, b), by Lentz's method in Thompson and Barnett's form.
double beta_fraction(double a, double b, double x) {
  constexpr double kTiny = 1e-300;
  constexpr int kMostTerms = 100000;
  const auto away_from_zero = [](double y) { return std::fabs(y) < kTiny ? kTiny : y; };
  double c = 1, d = 1 / away_from_zero(1 - (a + b) * x / (a + 1)), f = d;
  for (int m = 1; m < kMostTerms; ++m) {
    const double even = m * (b - m) * x / ((a + 2 * m - 1) * (a + 2 * m));
    d = 1 / away_from_zero(1 + even * d);
    c = away_from_zero(1 + even / c);
    f *= c * d;
    const double odd = -(a + m) * (a + b + m) * x / ((a + 2 * m) * (a + 2 * m + 1));
    d = 1 / away_from_zero(1 + odd * d);
    c = away_from_zero(1 + odd / c);
    f *= c * d;
    if (std::fabs(c * d - 1) < 4 * std::numeric_limits<double>::epsilon()) break;
  }
  return f;
}

double incomplete_beta(double a, double b, double x) {
  if (x <= 0) return 0;
  if (x >= 1) return 1;
  const double front = std::exp(std::lgamma(a + b) - std::lgamma(a) - std::lgamma(b) +
                                a * std::log(x) + b * std::log1p(-x));
  if (x < (a + 1) / (a + b + 2)) return front * beta_fraction(a, b, x) / a;
  return 1 - front * beta_fraction(b, a, 1 - x) / b;  // where the fraction converges fast
}

// The rate at which `passed` or more of `runs` have probability `tail`.
double rate_with_upper_tail(std::uint64_t passed, std::uint64_t runs, double tail) {
  if (passed == 0) return 0;
  const double a = static_cast<double>(passed), b = static_cast<double>(runs - passed) + 1;
  double low = 0, high = 1;
  for (int i = 0; i < 60; ++i) {
    const double middle = (low + high) / 2;
    (incomplete_beta(a, b, middle) < tail ? low : high) = middle;
  }
  return low;
}

void check(std::uint64_t passed, std::uint64_t runs, double confidence) {
  if (runs < 1 || passed > runs) {
    throw std::invalid_argument("pass rate of " + std::to_string(passed) + " of " +
                                std::to_string(runs) + " runs; expected 0 to all of at least 1");
  }
  if (!(confidence > 0 && confidence < 1)) {
    throw std::invalid_argument("pass rate: confidence = " + to_text(confidence) +
                                "; accepted: in (0, 1), as 0.95");
  }
}

}  // namespace

double pass_rate_lower_bound(std::uint64_t passed, std::uint64_t runs, double confidence) {
  check(passed, runs, confidence);
  return rate_with_upper_tail(passed, runs, 1 - confidence);
}

PassRateInterval pass_rate_interval(std::uint64_t passed, std::uint64_t runs, double confidence) {
  check(passed, runs, confidence);
  const double tail = (1 - confidence) / 2;
  return {rate_with_upper_tail(passed, runs, tail),
          1 - rate_with_upper_tail(runs - passed, runs, tail)};
}

}  // namespace orrery
