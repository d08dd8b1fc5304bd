/// The command line of orrery-campaign.
#pragma once

#include <orrery/harness/campaign/run_pool.hpp>
#include <orrery/harness/kernel/simulator_only.hpp>
#include <orrery/harness/kernel/time.hpp>

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace orrery {

struct CampaignOptions {
  std::string command;     // run, accept, merge, report, submit, bisect
  std::string program;     // absolute
  std::string filter;      // "Suite.Test"
  std::uint32_t runs = 0;  // 0: as many as the test says
  int jobs = 1;
  std::uint64_t seed = 1;
  std::filesystem::path out = "campaign";
  std::vector<std::filesystem::path> folders = {};  // of merge, report, accept, bisect
  std::uint32_t shard = 1, shards = 1;              // from 1
  RunLimits limits = {};
  bool resume = false, retry_failed = false, until_failure = false, quiet = false;
  std::vector<std::string> data = {};   // files that the runs read
  std::vector<std::string> flags = {};  // --orrery_* that every run is given
  std::filesystem::path html = {}, csv = {}, database = {};
  std::uint32_t pilot = 0;  // fly only so many, to measure them; 0: all
  // submit
  bool slurm = false, dry_run = false;
  Duration chunk = 60s;
  int processors = 1;  // of a task
  std::string partition = {};
  // bisect
  std::uint32_t run = 0;
  std::string parameter = {};
  double tolerance = 0;  // 0: a thousandth of the interval
};

/// @throws std::invalid_argument  with the line to print, before exit code 2.
CampaignOptions parse_campaign_options(const std::vector<std::string>& arguments);
std::string campaign_usage();

}  // namespace orrery
