#include <orrery/harness/campaign/campaign_manifest.hpp>
#include <orrery/harness/record/sha256.hpp>

#include <nlohmann/json.hpp>

#include <fstream>
#include <iterator>
#include <stdexcept>
#include <unistd.h>

namespace orrery {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kName = "campaign.json";

std::string short_hash(const std::string& hash) {
  return hash.empty() ? "absent" : hash.substr(0, 12);
}

}  // namespace

std::string CampaignManifest::difference_from(const CampaignManifest& other) const {
  const auto differ = [](const std::string& what, const std::string& now, const std::string& then) {
    return what + " is " + now + ", was " + then;
  };
  if (test != other.test) return differ("the test", test, other.test);
  if (base_seed != other.base_seed) {
    return differ("the base seed", std::to_string(base_seed), std::to_string(other.base_seed));
  }
  if (program_sha256 != other.program_sha256) {
    return differ("the program's SHA-256", short_hash(program_sha256),
                  short_hash(other.program_sha256));
  }
  if (flags != other.flags) return "the --orrery_ flags are others";
  for (const auto& [file, hash] : other.files) {
    const auto now = files.find(file);
    const std::string have = now == files.end() ? "" : now->second;
    if (have != hash) {
      return differ("the SHA-256 of " + file, short_hash(have), short_hash(hash));
    }
  }
  if (files.size() != other.files.size()) return "more data files are given";
  return {};
}

std::optional<CampaignManifest> read_manifest(const std::filesystem::path& folder) {
  const std::filesystem::path file = folder / kName;
  std::ifstream in(file, std::ios::binary);
  if (!in) return {};
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  try {
    const Json json = Json::parse(text);
    CampaignManifest m;
    m.test = json.at("test").get<std::string>();
    m.base_seed = json.at("base_seed").get<std::uint64_t>();
    m.runs = json.at("runs").get<std::uint32_t>();
    m.program = json.at("program").get<std::string>();
    m.program_sha256 = json.at("program_sha256").get<std::string>();
    m.flags = json.at("flags").get<std::vector<std::string>>();
    for (const auto& [name, hash] : json.at("files").items()) {
      m.files[name] = hash.get<std::string>();
    }
    return m;
  } catch (const Json::exception& error) {
    throw std::runtime_error(file.string() + ": " + error.what());
  }
}

void write_manifest(const CampaignManifest& m, const std::filesystem::path& folder) {
  Json files = Json::object();
  for (const auto& [name, hash] : m.files) files[name] = hash;
  const Json json = {{"test", m.test},   {"base_seed", m.base_seed},
                     {"runs", m.runs},   {"program", m.program},
                     {"flags", m.flags}, {"program_sha256", m.program_sha256},
                     {"files", files}};
  const std::filesystem::path file = folder / kName;
  const std::filesystem::path beside = file.string() + "." + std::to_string(getpid());
  std::ofstream out(beside, std::ios::binary);
  out << json.dump(2) << "\n";
  out.close();
  if (!out) throw std::runtime_error(beside.string() + ": cannot be written");
  std::filesystem::rename(beside, file);
}

std::string sha256_of(const std::filesystem::path& file) {
  Sha256 sum;
  sum.add_file(file);
  return sum.digest();
}

}  // namespace orrery
