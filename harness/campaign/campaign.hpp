/// Campaigns: one test over many runs, judged as a whole.
///
///   TEST(TransferCampaign, DeltaVBudgetHolds) {
///     const Campaign campaign = fly_campaign(Runs{100}, [](RunId run) {
///       FormationWorld world({.flight = {.library = "formation_gnc"}, .run = run});
///       world.spacecraft("deputy").disperse("mass_kg", Normal{11.0, 0.11});
///       world.run_for(20h);
///       world.record_metric("delta_v_mps", world.delta_v_mps("deputy"));
///     });
///     EXPECT_THAT(campaign.metric("delta_v_mps"), PercentileBelow(95, 0.40));
///     EXPECT_THAT(campaign.passed(), PassRateAtLeast(0.97, /*confidence=*/0.95));
///   }
#pragma once

#include <orrery/harness/gtest/channel_matchers.hpp>
#include <orrery/harness/gtest/run_record.hpp>
#include <orrery/harness/kernel/run_id.hpp>
#include <orrery/harness/kernel/time.hpp>

#include <gmock/gmock.h>

#include <cstdint>
#include <functional>
#include <iosfwd>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace orrery {

struct Runs {
  int n = 1;                             // from 1
  Duration time_limit = 10min;           // of each run on the host; above 0
  std::uint64_t memory_limit_bytes = 0;  // likewise, resident (run_pool.hpp); 0: none
};

/// How many of the runs passed. Prints as "97 of 100 passed".
struct PassCount {
  std::uint64_t passed = 0, runs = 0;
  double rate() const { return static_cast<double>(passed) / static_cast<double>(runs); }
};
void PrintTo(const PassCount& count, std::ostream* os);

/// One metric over all runs of a campaign. A run that did not record it, or not a number, has no
/// value: it counts as worse than any limit.
class CampaignMetric {
 public:
  struct Value {
    RunId run;
    double value = 0;
  };
  CampaignMetric(std::string name, std::vector<Value> values, std::size_t without);

  const std::string& name() const { return name_; }
  /// Of the runs that have one, in their order.
  const std::vector<Value>& values() const { return values_; }
  std::size_t runs_without() const { return without_; }
  double mean() const;
  /// Of the sample, divided by n - 1. @throws std::logic_error  fewer than two values.
  double standard_deviation() const;
  /// The smallest value that at least `percent` % of all runs do not exceed (nearest rank);
  /// infinite if that is a run without a value.
  /// @throws std::invalid_argument  percent outside (0, 100].
  double percentile(double percent) const;
  /// The run with the value of that rank; null if it has none.
  const Value* at_percentile(double percent) const;

 private:
  std::string name_;
  std::vector<Value> values_, sorted_;
  std::size_t without_;
};
void PrintTo(const CampaignMetric& metric, std::ostream* os);

/// The merged results, in the order of the runs, whatever the order of their ends and wherever they
/// were flown.
class Campaign {
 public:
  explicit Campaign(std::vector<RunRecord> runs) : runs_(std::move(runs)) {}

  const std::vector<RunRecord>& runs() const { return runs_; }
  PassCount passed() const;
  /// @throws std::invalid_argument  no run recorded it; lists those that were recorded.
  CampaignMetric metric(std::string_view name) const;

 private:
  std::vector<RunRecord> runs_;
};

/// Flies `one_run` as often as `runs` says, each time in a child process of its own, with seeds
/// base, base + 1 ...: the run of index i is a function of program, test, base seed and i, however
/// many run at a time (--orrery_jobs; one per processor otherwise). What fails or crashes in a run
/// is a datum of the campaign. A run without a result (it was killed, hung, ran nothing) fails this
/// test; so does, of course, an expectation on the campaign.
///
/// --orrery_run=I flies run I here, in this process, and ends the test there: what follows
/// fly_campaign() is about all runs. Children do the same.
/// --orrery_campaign=DIR flies nothing: what follows judges the results in DIR, which
/// orrery-campaign has left.
/// --orrery_out=DIR keeps them in DIR/<Suite>.<Test>/runs.jsonl, where orrery-campaign finds them.
///
/// Once per test, in its body. @throws std::invalid_argument  an option outside its range.
/// std::logic_error  outside of a test, or for the second time in it. std::runtime_error  a child
/// cannot be started, results cannot be read.
Campaign fly_campaign(const Runs& runs, const std::function<void(RunId)>& one_run);

/// With this confidence (in (0, 1)) the probability to pass is at least `rate`: the lower bound of
/// Clopper and Pearson's one-sided interval is (pass_rate.hpp). 100 of 100 show 0.9704 with 95 %.
testing::Matcher<const PassCount&> PassRateAtLeast(double rate, double confidence);

}  // namespace orrery
