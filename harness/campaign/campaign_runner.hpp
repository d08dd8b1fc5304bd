/// orrery-campaign run and accept.
#pragma once

#include <orrery/harness/campaign/campaign_manifest.hpp>
#include <orrery/harness/campaign/campaign_options.hpp>
#include <orrery/harness/campaign/run_pool.hpp>
#include <orrery/harness/campaign/run_store.hpp>

#include <stdexcept>
#include <string>

namespace orrery {

/// Exit codes of orrery-campaign.
enum ExitCode { kExitPassed = 0, kExitFailed = 1, kExitRefused = 2, kExitContradiction = 3 };

/// Whatever makes a campaign impossible as asked; main() prints it and returns 2.
class Refused : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Flies, keeps, judges. @return an exit code.
int run_campaign(const CampaignOptions& options);
/// The test itself judges the results of a folder. @return an exit code.
int accept_campaign(const std::filesystem::path& folder);

/// The command that flies a run of a folder's campaign.
RunCommand command_of(const CampaignManifest& manifest, std::uint32_t run);
/// A folder's manifest. @throws Refused  it has none.
CampaignManifest manifest_of(const std::filesystem::path& folder);

}  // namespace orrery
