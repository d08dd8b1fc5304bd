#include <orrery/harness/campaign/campaign.hpp>
#include <orrery/harness/campaign/campaign_manifest.hpp>
#include <orrery/harness/campaign/pass_rate.hpp>
#include <orrery/harness/campaign/run_pool.hpp>
#include <orrery/harness/campaign/run_store.hpp>
#include <orrery/harness/gtest/flags.hpp>
#include <orrery/harness/gtest/listener.hpp>
#include <orrery/harness/gtest/run_context.hpp>
#include <orrery/harness/kernel/text.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <optional>
#include <ostream>
#include <set>
#include <stdexcept>
#include <thread>

namespace orrery {
namespace {

constexpr std::size_t kMostShown = 3;

/// Of the test that runs; a second campaign in it could not be told from the first.
bool& flown_in_this_test() {
  static bool flown = false;
  static const bool resets = [] {
    at_test_end([](const testing::TestInfo&) { flown = false; });
    return true;
  }();
  (void)resets;
  return flown;
}

std::string name_of(const testing::TestInfo& test) {
  return std::string(test.test_suite_name()) + "." + test.name();
}

// Of one run's own accord; or what decides how many fly, which is this program's part.
bool is_passed_on(const std::string& flag) {
  constexpr std::array kOurs = {
      "seed",   "run",     "runs", "jobs", "campaign", "progress", "verify_determinism",
      "shrink", "break_at"};
  const std::string name = flag.substr(0, flag.find('='));
  return std::none_of(kOurs.begin(), kOurs.end(), [&name](const char* ours) {
    return name == "--orrery_" + std::string(ours);
  });
}

RunCommand command_of(const testing::TestInfo& test, std::uint32_t run) {
  RunCommand command{.program = "/proc/self/exe",
                     .test = name_of(test),
                     .base_seed = flags().seed,
                     .run = run,
                     .flags = {},
                     .name = program_name()};
  for (const std::string& flag : given_flags()) {
    if (is_passed_on(flag)) command.flags.push_back(flag);
  }
  return command;
}

[[noreturn]] void end_body() {  // GoogleTest takes it for a failure that has been reported
  throw testing::AssertionException(
      testing::TestPartResult(testing::TestPartResult::kSuccess, nullptr, -1, ""));
}

[[noreturn]] void fly_alone(std::uint32_t index, const Runs& runs,
                            const std::function<void(RunId)>& one_run) {
  const RunId run{flags().seed + index, index};
  internal::note_campaign_run(run.index, run.seed, static_cast<std::uint32_t>(runs.n));
  one_run(run);
  if (!internal::leaves_run_record()) {
    std::printf("[ orrery   ] run %u, seed %llu, flown alone: what follows is about all runs\n",
                run.index, static_cast<unsigned long long>(run.seed));
  }
  end_body();
}

// Results for who looks at them later; null: not asked for.
std::unique_ptr<RunStore> store_of(const testing::TestInfo& test, const Runs& runs) {
  if (flags().out.empty()) return nullptr;
  std::string folder = name_of(test);
  std::replace(folder.begin(), folder.end(), '/', '-');
  const std::filesystem::path file = std::filesystem::path(flags().out) / folder / "runs.jsonl";
  std::filesystem::create_directories(file.parent_path());
  std::filesystem::remove(file);
  const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe");
  write_manifest({.test = name_of(test),
                  .base_seed = flags().seed,
                  .runs = static_cast<std::uint32_t>(runs.n),
                  .program = program.string(),
                  .flags = command_of(test, 0).flags,
                  .files = {},
                  .program_sha256 = sha256_of("/proc/self/exe")},
                 file.parent_path());
  return std::make_unique<RunStore>(file);
}

int jobs() {
  return flags().jobs.value_or(std::max(1, static_cast<int>(std::thread::hardware_concurrency())));
}

struct FlownRuns {
  MergedRuns merged = {};
  std::uint32_t n = 0;  // that should be there
};

FlownRuns flown_elsewhere(const testing::TestInfo& test) {
  internal::note_runs_elsewhere();
  const std::string& folder = flags().campaign;
  const std::optional<CampaignManifest> manifest = read_manifest(folder);
  if (!manifest || manifest->test != name_of(test)) {
    throw std::runtime_error("--orrery_campaign=" + folder + ": results of " +
                             (manifest ? manifest->test : "nothing") + ", not of " + name_of(test));
  }
  FlownRuns flown{read_runs(folder), manifest->runs};
  for (const Contradiction& one : flown.merged.contradictions) {
    ADD_FAILURE() << "run " << one.run << " (seed " << one.seed
                  << ") gave two results: " << one.what;
  }
  return flown;
}

FlownRuns fly(const testing::TestInfo& test, const Runs& runs) {
  internal::note_runs_elsewhere();
  FlownRuns flown;
  flown.n = static_cast<std::uint32_t>(runs.n);
  const auto store = store_of(test, runs);
  RunPool pool(jobs(), {.time = runs.time_limit, .memory_bytes = runs.memory_limit_bytes});
  std::uint32_t next = 0;
  while (next < flown.n || !pool.is_idle()) {
    while (next < flown.n && pool.has_room()) pool.start(command_of(test, next++));
    for (RunRecord& record : pool.finished(1s)) {
      if (record.outcome == RunOutcome::kPassed && record.runs == 0) {
        record.outcome = RunOutcome::kError;
        record.failure_site = "its body did not reach fly_campaign()";
      }
      if (store) store->append(record);
      flown.merged.add(record);
    }
  }
  return flown;
}

std::vector<RunRecord> in_order(const MergedRuns& merged) {
  std::vector<RunRecord> all;
  for (const auto& [index, record] : merged.runs) all.push_back(record);
  return all;
}

std::string named(const RunRecord& run) {
  return "run " + std::to_string(run.run) + " (seed " + std::to_string(run.seed) + ")";
}

// How many of them, and what the first ones are.
void fail_without_result(const MergedRuns& merged, std::uint32_t n) {
  std::string shown;
  std::size_t missing = 0;
  const auto add = [&](const std::string& line) {
    if (++missing <= kMostShown) shown += "\n  " + line;
  };
  for (std::uint32_t i = 0; i < n; ++i) {
    const auto found = merged.runs.find(i);
    if (found == merged.runs.end()) {
      add("run " + std::to_string(i) + ": was not flown");
    } else if (!is_result(found->second.outcome)) {
      const RunRecord& r = found->second;
      add(named(r) + ": " + to_string(r.outcome) + ", " + r.failure_site + "; " + r.failure_text);
    }
  }
  if (missing == 0) return;
  ADD_FAILURE() << missing << " of " << n << " runs of this campaign are without a result" << shown
                << (missing > kMostShown ? "\n  ..." : "");
}

void print_failures(const Campaign& campaign, const testing::TestInfo& test) {
  std::size_t shown = 0;
  std::set<std::string> sites;
  for (const RunRecord& run : campaign.runs()) {
    if (run.outcome == RunOutcome::kPassed || !is_result(run.outcome)) continue;
    if (!sites.insert(run.failure_site).second || ++shown > kMostShown) continue;
    std::printf("[ orrery   ] %s %s: %s\n  replay: %s\n", named(run).c_str(),
                to_string(run.outcome), run.failure_site.c_str(),
                replay_command_of(command_of(test, run.run)).c_str());
  }
  const PassCount passed = campaign.passed();
  std::printf("[ orrery   ] %llu of %llu runs passed\n",
              static_cast<unsigned long long>(passed.passed),
              static_cast<unsigned long long>(passed.runs));
  std::fflush(stdout);
}

class PassRate final : public testing::MatcherInterface<const PassCount&> {
 public:
  PassRate(double rate, double confidence) : rate_(rate), confidence_(confidence) {
    if (!(rate > 0 && rate < 1)) {
      throw std::invalid_argument("PassRateAtLeast: rate = " + to_text(rate) +
                                  "; accepted: in (0, 1), as 0.97");
    }
    (void)pass_rate_lower_bound(0, 1, confidence);  // says what is wrong with it
  }
  bool MatchAndExplain(const PassCount& count, testing::MatchResultListener* out) const override {
    if (count.runs == 0) {
      *out << "there are no runs";
      return false;
    }
    const double bound = pass_rate_lower_bound(count.passed, count.runs, confidence_);
    *out << "which shows a rate of " << bound << " or more";
    if (bound >= rate_) return true;
    *out << "; as many runs without a failure would show "
         << pass_rate_lower_bound(count.runs, count.runs, confidence_);
    return false;
  }
  void DescribeTo(std::ostream* out) const override {
    *out << "shows a pass rate of at least " << rate_ << " with a confidence of " << confidence_;
  }
  void DescribeNegationTo(std::ostream* out) const override {
    *out << "does not show a pass rate of " << rate_ << " with a confidence of " << confidence_;
  }

 private:
  double rate_, confidence_;
};

class MetricPercentile final : public testing::MatcherInterface<const CampaignMetric&> {
 public:
  MetricPercentile(double percent, double limit) : percent_(percent), limit_(limit) {}

  bool MatchAndExplain(const CampaignMetric& metric,
                       testing::MatchResultListener* out) const override {
    const CampaignMetric::Value* at = metric.at_percentile(percent_);
    if (at == nullptr) {
      *out << "at that percentile is a run without a value (" << metric.runs_without()
           << " of them)";
      return false;
    }
    *out << "at that percentile of " << metric.values().size() + metric.runs_without()
         << " runs it is " << to_text(at->value) << ", in run " << at->run.index << " (seed "
         << at->run.seed << ")";
    return at->value < limit_;
  }
  void DescribeTo(std::ostream* out) const override {
    *out << "is below " << limit_ << " in " << percent_ << " % of the runs";
  }
  void DescribeNegationTo(std::ostream* out) const override {
    *out << "is not below " << limit_ << " in " << percent_ << " % of the runs";
  }

 private:
  double percent_, limit_;
};

}  // namespace

void PrintTo(const PassCount& count, std::ostream* os) {
  *os << count.passed << " of " << count.runs << " passed";
}

CampaignMetric::CampaignMetric(std::string name, std::vector<Value> values, std::size_t without)
    : name_(std::move(name)), values_(std::move(values)), sorted_(values_), without_(without) {
  std::stable_sort(sorted_.begin(), sorted_.end(),
                   [](const Value& a, const Value& b) { return a.value < b.value; });
}

double CampaignMetric::mean() const {
  double sum = 0;
  for (const Value& one : values_) sum += one.value;
  return sum / static_cast<double>(values_.size());
}

double CampaignMetric::standard_deviation() const {
  if (values_.size() < 2) {
    throw std::logic_error("CampaignMetric::standard_deviation: '" + name_ + "' has " +
                           std::to_string(values_.size()) + " values; expected at least 2");
  }
  const double middle = mean();
  double sum = 0;
  for (const Value& one : values_) sum += (one.value - middle) * (one.value - middle);
  return std::sqrt(sum / static_cast<double>(values_.size() - 1));
}

const CampaignMetric::Value* CampaignMetric::at_percentile(double percent) const {
  if (!(percent > 0 && percent <= 100)) {
    throw std::invalid_argument("CampaignMetric: " + to_text(percent) +
                                " %; accepted: above 0, at most 100");
  }
  const double all = static_cast<double>(sorted_.size() + without_);
  const auto rank = static_cast<std::size_t>(std::max(std::ceil(percent * all / 100 - 1e-9), 1.0));
  return rank <= sorted_.size() ? &sorted_[rank - 1] : nullptr;
}

double CampaignMetric::percentile(double percent) const {
  const Value* at = at_percentile(percent);
  return at != nullptr ? at->value : std::numeric_limits<double>::infinity();
}

void PrintTo(const CampaignMetric& metric, std::ostream* os) {
  *os << metric.name() << " of " << metric.values().size() << " runs";
  if (metric.runs_without() > 0) *os << " (and " << metric.runs_without() << " without)";
  if (metric.values().empty()) return;
  *os << ", median " << metric.percentile(50) << ", largest " << metric.percentile(100);
}

PassCount Campaign::passed() const {
  PassCount count{.passed = 0, .runs = runs_.size()};
  for (const RunRecord& run : runs_) count.passed += run.outcome == RunOutcome::kPassed;
  return count;
}

CampaignMetric Campaign::metric(std::string_view name) const {
  std::vector<CampaignMetric::Value> values;
  std::set<std::string> known;
  for (const RunRecord& run : runs_) {
    for (const auto& [one, value] : run.metrics) {
      known.insert(one);
      if (one == name && std::isfinite(value)) values.push_back({{run.seed, run.run}, value});
    }
  }
  if (known.find(std::string(name)) == known.end()) {
    std::string list;
    for (const std::string& one : known) list += (list.empty() ? "" : ", ") + one;
    throw std::invalid_argument("Campaign: no run recorded a metric '" + std::string(name) +
                                "'; there are " + (list.empty() ? "none" : list));
  }
  const std::size_t without = runs_.size() - values.size();
  return {std::string(name), std::move(values), without};
}

Campaign fly_campaign(const Runs& runs, const std::function<void(RunId)>& one_run) {
  const testing::TestInfo* test = testing::UnitTest::GetInstance()->current_test_info();
  if (test == nullptr) throw std::logic_error("fly_campaign: is for the body of a test");
  if (runs.n < 1) {
    throw std::invalid_argument("fly_campaign: Runs{" + std::to_string(runs.n) +
                                "}; accepted: from 1");
  }
  if (std::exchange(flown_in_this_test(), true)) {
    throw std::logic_error("fly_campaign: a second campaign in " + name_of(*test) +
                           "; accepted: one per test");
  }
  if (flags().run) fly_alone(*flags().run, runs, one_run);
  const FlownRuns flown = flags().campaign.empty() ? fly(*test, runs) : flown_elsewhere(*test);
  fail_without_result(flown.merged, flown.n);
  const Campaign campaign(in_order(flown.merged));
  print_failures(campaign, *test);
  return campaign;
}

testing::Matcher<const PassCount&> PassRateAtLeast(double rate, double confidence) {
  return testing::Matcher<const PassCount&>(new PassRate(rate, confidence));
}

PercentileBelow::operator testing::Matcher<const CampaignMetric&>() const {
  if (!window_.text().empty()) {
    throw std::invalid_argument("PercentileBelow: a window, for a metric of a campaign");
  }
  return testing::Matcher<const CampaignMetric&>(new MetricPercentile(percent_, limit_));
}

}  // namespace orrery
