/// The results of a campaign as an SQLite database.
#pragma once

#include <orrery/harness/campaign/campaign_manifest.hpp>
#include <orrery/harness/campaign/run_store.hpp>

#include <filesystem>

namespace orrery {

/// Replaces the file. Tables: campaign(name, value); runs(run, seed, outcome, exit, signal,
/// fingerprint, simulated_s, events, wall_s, cpu_s, peak_kB, site, failure, replay); metrics(run,
/// name, value); dispersions(run, name, value); distributions(name, distribution);
/// contradictions(run, what). Metrics that are not a number are NULL.
/// @throws std::runtime_error  what SQLite says.
void write_database(const CampaignManifest& manifest, const MergedRuns& merged,
                    const std::filesystem::path& file);

}  // namespace orrery
