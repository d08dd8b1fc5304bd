#include <orrery/harness/campaign/bisection.hpp>
#include <orrery/harness/campaign/campaign_runner.hpp>
#include <orrery/harness/campaign/campaign_statistics.hpp>
#include <orrery/harness/kernel/text.hpp>

#include <cmath>
#include <cstdio>

namespace orrery {
namespace {

const Column& column_of(const CampaignTable& table, const std::string& name) {
  std::string known;
  for (const Column& column : table.dispersions) {
    if (column.name == name) return column;
    known += (known.empty() ? "" : ", ") + column.name;
  }
  throw Refused("no dispersion '" + name + "'; there are " + (known.empty() ? "none" : known));
}

// The outcome with that value in place of the one drawn. @throws Refused  without a result.
RunRecord flown_with(const CampaignOptions& options, const CampaignManifest& manifest,
                     double value) {
  RunCommand command = command_of(manifest, options.run);
  command.flags.push_back("--orrery_set=" + options.parameter + "=" + to_text(value));
  RunPool pool(1, options.limits);
  pool.start(command);
  RunRecord record;
  while (!pool.is_idle()) {
    for (RunRecord& one : pool.finished(1s)) record = one;
  }
  if (!is_result(record.outcome)) {
    throw Refused("run " + std::to_string(options.run) + " with " + options.parameter + " = " +
                  to_text(value) + ": " + to_string(record.outcome) + ", " + record.failure_site);
  }
  std::printf("  %s = %-22s %s%s%s\n", options.parameter.c_str(), to_text(value).c_str(),
              to_string(record.outcome), record.failure_site.empty() ? "" : ": ",
              record.failure_site.c_str());
  std::fflush(stdout);
  return record;
}

}  // namespace

Threshold bisect(double passes, double fails, double tolerance,
                 const std::function<bool(double)>& still_fails) {
  Threshold t{passes, fails, 0};
  while (std::fabs(t.fails - t.passes) > tolerance) {
    const double middle = t.passes + (t.fails - t.passes) / 2;
    if (middle == t.passes || middle == t.fails) break;
    ++t.runs;
    (still_fails(middle) ? t.fails : t.passes) = middle;
  }
  return t;
}

int bisect_campaign(const CampaignOptions& options) {
  const std::filesystem::path& folder = options.folders.front();
  const CampaignManifest manifest = manifest_of(folder);
  const MergedRuns merged = read_runs(folder);
  const CampaignTable table = table_of(merged);
  const Column& column = column_of(table, options.parameter);
  const auto found = merged.runs.find(options.run);
  if (found == merged.runs.end() || found->second.outcome == RunOutcome::kPassed) {
    throw Refused("run " + std::to_string(options.run) + " is not one that failed");
  }
  double own = std::nan("");
  for (const DrawnDispersion& d : found->second.dispersions) {
    if (d.name == options.parameter) own = d.value;
  }
  const double median = percentile_of(sorted_values(column.values), 50);
  const auto still_fails = [&](double value) {
    return flown_with(options, manifest, value).outcome != RunOutcome::kPassed;
  };
  if (!still_fails(own)) throw Refused("it passes now; the results contradict each other");
  if (still_fails(median)) {
    std::printf("it fails with the median, too: %s is not what decides\n",
                options.parameter.c_str());
    return kExitFailed;
  }
  const double tolerance =
      options.tolerance > 0 ? options.tolerance : std::fabs(own - median) / 1000;
  const Threshold t = bisect(median, own, tolerance, still_fails);
  std::printf("%s: passes at %s, fails at %s (%d runs)\n", options.parameter.c_str(),
              to_text(t.passes).c_str(), to_text(t.fails).c_str(), t.runs + 2);
  return kExitPassed;
}

}  // namespace orrery
