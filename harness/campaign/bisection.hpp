/// Where a failing run begins to fail.
#pragma once

#include <orrery/harness/campaign/campaign_options.hpp>

#include <functional>

namespace orrery {

struct Threshold {
  double passes = 0, fails = 0;  // the nearest values that were seen to
  int runs = 0;
};

/// Halves between a value that passes and one that fails until they are `tolerance` apart, or no
/// double lies between them. Where the outcome goes to and fro it is one of the thresholds.
Threshold bisect(double passes, double fails, double tolerance,
                 const std::function<bool(double)>& still_fails);

/// Flies the run of the options again and again with another value of one dispersion, from its own
/// towards the median of all runs. @return an exit code.
int bisect_campaign(const CampaignOptions& options);

}  // namespace orrery
