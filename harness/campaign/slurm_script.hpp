/// orrery-campaign submit --slurm: the campaign as a job array.
#pragma once

#include <orrery/harness/campaign/campaign_options.hpp>

#include <cstdint>
#include <string>

namespace orrery {

/// Tasks of about `options.chunk` each on `options.processors`, 1 to 10000 of them and no more than
/// there are runs. @param run_s  Host time of one run [s].
std::uint32_t slurm_tasks(const CampaignOptions& options, std::uint32_t runs, double run_s);

/// The script of the array. A task that Slurm requeues after a node has failed flies what is
/// missing of its shard: results are appended and resumed, the log is not truncated.
/// @param runner  Path of orrery-campaign, on all nodes. @param options  runs, out absolute.
std::string slurm_script(const CampaignOptions& options, const std::string& runner,
                         std::uint32_t tasks);

/// Flies three runs here to measure them, writes OUT/campaign.slurm and, unless it is a dry run,
/// submits it, and a job that judges and reports when all tasks have ended. @return an exit code.
int submit_to_slurm(const CampaignOptions& options);

}  // namespace orrery
