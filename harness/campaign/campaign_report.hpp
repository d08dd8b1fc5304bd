/// The results of a campaign as one self-contained page, and as a table.
#pragma once

#include <orrery/harness/campaign/campaign_manifest.hpp>
#include <orrery/harness/campaign/run_store.hpp>

#include <string>

namespace orrery {

/// Pass rate with its interval, histogram and quantiles of each metric, metrics over dispersions
/// with the strongest correlations first, failures by site with a command that replays one, slowest
/// and worst runs. Needs no network and nothing beside it.
std::string campaign_page(const CampaignManifest& manifest, const MergedRuns& merged);

/// A line per run: run, seed, outcome, metrics, dispersions, times, failure site. RFC 4180.
std::string campaign_csv(const MergedRuns& merged);

}  // namespace orrery
