// The tool orrery-campaign (harness/campaign/README.md).
#include <orrery/harness/campaign/bisection.hpp>
#include <orrery/harness/campaign/campaign_database.hpp>
#include <orrery/harness/campaign/campaign_options.hpp>
#include <orrery/harness/campaign/campaign_report.hpp>
#include <orrery/harness/campaign/campaign_runner.hpp>
#include <orrery/harness/campaign/slurm_script.hpp>
#include <orrery/harness/gtest/host_conditions.hpp>

#include <cstdio>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

using namespace orrery;

void write_file(const std::filesystem::path& file, const std::string& text) {
  std::ofstream out(file, std::ios::binary);
  out << text;
  out.close();
  if (!out) throw Refused(file.string() + ": cannot be written");
  std::printf("%s\n", file.c_str());
}

int result_of(const MergedRuns& merged) {
  for (const Contradiction& one : merged.contradictions) {
    std::printf("DEFECT: run %u gave another result: %s\n", one.run, one.what.c_str());
  }
  return merged.contradictions.empty() ? kExitPassed : kExitContradiction;
}

// Several folders of one campaign become one that is like them.
void join(const std::vector<std::filesystem::path>& folders) {
  const std::filesystem::path& into = folders.front();
  CampaignManifest manifest = manifest_of(folders[1]);
  std::vector<RunRecord> records;
  for (std::size_t i = 1; i < folders.size(); ++i) {
    CampaignManifest part = manifest_of(folders[i]);
    part.program = manifest.program;  // where it lies does not matter, what it is does
    const std::string difference = part.difference_from(manifest);
    if (!difference.empty()) {
      throw Refused(folders[i].string() + " is of another campaign than " + folders[1].string() +
                    ": " + difference);
    }
    manifest.runs = std::max(manifest.runs, part.runs);
    for (RunRecord& record : all_records(folders[i])) records.push_back(std::move(record));
  }
  std::filesystem::create_directories(into);
  std::filesystem::remove(into / "runs.jsonl");
  RunStore store(into / "runs.jsonl");
  for (const RunRecord& record : records) store.append(record);
  write_manifest(manifest, into);
}

int merge(const CampaignOptions& options) {
  if (options.folders.size() > 1) join(options.folders);
  const std::filesystem::path& folder = options.folders.front();
  const MergedRuns merged = read_runs(folder);
  const auto file = options.database.empty() ? folder / "campaign.sqlite" : options.database;
  write_database(manifest_of(folder), merged, file);
  std::printf("%s: %zu runs\n", file.c_str(), merged.runs.size());
  return result_of(merged);
}

int report(const CampaignOptions& options) {
  const std::filesystem::path& folder = options.folders.front();
  const CampaignManifest manifest = manifest_of(folder);
  const MergedRuns merged = read_runs(folder);
  write_database(manifest, merged,
                 options.database.empty() ? folder / "campaign.sqlite" : options.database);
  write_file(options.html.empty() ? folder / "report.html" : options.html,
             campaign_page(manifest, merged));
  if (!options.csv.empty()) write_file(options.csv, campaign_csv(merged));
  return result_of(merged);
}

int run(const CampaignOptions& options) {
  if (options.command == "run") return run_campaign(options);
  if (options.command == "accept") return accept_campaign(options.folders.front());
  if (options.command == "merge") return merge(options);
  if (options.command == "report") return report(options);
  if (options.command == "submit") return submit_to_slurm(options);
  return bisect_campaign(options);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fputs(orrery::campaign_usage().c_str(), stderr);
    return orrery::kExitRefused;
  }
  const std::vector<std::string> arguments(argv + 1, argv + argc);
  if (arguments[0] == "-h" || arguments[0] == "--help") {
    std::fputs(orrery::campaign_usage().c_str(), stdout);
    return 0;
  }
  orrery::internal::fix_host_conditions(argv);  // once, for all runs
  try {
    return run(orrery::parse_campaign_options(arguments));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "orrery-campaign: %s\n", error.what());
    return orrery::kExitRefused;
  }
}
