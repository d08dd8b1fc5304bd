/// What so many passed runs of so many say about the probability to pass.
#pragma once

#include <orrery/harness/kernel/simulator_only.hpp>

#include <cstdint>

namespace orrery {

/// Exact, not approximate: the probability that it misleads is at most 1 - confidence, whatever the
/// rate and however few the runs.
///
/// Method      Clopper & Pearson, The use of confidence or fiducial limits illustrated in the case
///             of the binomial, Biometrika 26 (1934): the rate p at which `passed` or more of
///             `runs` pass with probability 1 - confidence. The binomial's tail is the incomplete
///             beta function, by its continued fraction (DLMF 8.17.22).
/// Errors      1e-9 in p. Checked against Wilks's sample sizes and published intervals in
///             test_suites/unit/harness/campaign/pass_rate_test.cpp.

/// The lower bound of a one-sided interval: the rate is at least that, with this confidence.
/// @throws std::invalid_argument  runs < 1, passed > runs, confidence outside (0, 1).
double pass_rate_lower_bound(std::uint64_t passed, std::uint64_t runs, double confidence);

struct PassRateInterval {
  double low = 0, high = 1;
};
/// The two-sided interval, with (1 - confidence) / 2 on each side. @throws as above.
PassRateInterval pass_rate_interval(std::uint64_t passed, std::uint64_t runs, double confidence);

}  // namespace orrery
