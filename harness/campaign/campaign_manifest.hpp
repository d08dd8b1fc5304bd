/// What a folder of results is about: campaign.json.
#pragma once

#include <orrery/harness/kernel/simulator_only.hpp>

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace orrery {

struct CampaignManifest {
  std::string test;  // "Suite.Test"
  std::uint64_t base_seed = 1;
  std::uint32_t runs = 0;                         // indices 0 ... runs - 1
  std::string program;                            // absolute path
  std::vector<std::string> flags = {};            // --orrery_* that every run is given
  std::map<std::string, std::string> files = {};  // data that the runs read -> SHA-256
  std::string program_sha256 = {};

  /// What makes results of another campaign: empty, or "the program is another one (...)".
  std::string difference_from(const CampaignManifest& other) const;
};

/// Empty: the folder has none. @throws std::runtime_error  it cannot be read as one.
std::optional<CampaignManifest> read_manifest(const std::filesystem::path& folder);
/// Whole or not at all, whoever else writes one. @throws std::runtime_error  the disk is full, say.
void write_manifest(const CampaignManifest& manifest, const std::filesystem::path& folder);

/// SHA-256 of a file. @throws std::runtime_error  it cannot be read.
std::string sha256_of(const std::filesystem::path& file);

}  // namespace orrery
