// The tool orrery-campaign (harness/campaign/README.md).
#include <orrery/harness/campaign/campaign_options.hpp>
#include <orrery/harness/campaign/campaign_runner.hpp>

#include <cstdio>
#include <stdexcept>

namespace {

int run(const orrery::CampaignOptions& options) {
  if (options.command == "run") return orrery::run_campaign(options);
  if (options.command == "accept") return orrery::accept_campaign(options.folders.front());
  throw orrery::Refused(options.command + ": not available");
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
  try {
    return run(orrery::parse_campaign_options(arguments));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "orrery-campaign: %s\n", error.what());
    return orrery::kExitRefused;
  }
}
