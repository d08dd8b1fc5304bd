#include <orrery/harness/campaign/campaign_options.hpp>

#include <charconv>
#include <cmath>
#include <functional>
#include <map>
#include <stdexcept>
#include <string_view>
#include <thread>

namespace orrery {
namespace {

[[noreturn]] void refuse(const std::string& option, const std::string& value,
                         const std::string& accepted) {
  throw std::invalid_argument(option + " " + value + ": expected " + accepted);
}

template <class T>
T parsed(const std::string& option, const std::string& text, T low, T high) {
  T value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() ||
      !(value >= low && value <= high)) {
    refuse(option, text, "a number from " + std::to_string(low) + " to " + std::to_string(high));
  }
  return value;
}

void parse_shard(CampaignOptions& o, const std::string& text) {
  const std::size_t slash = text.find('/');
  if (slash == std::string::npos) refuse("--shard", text, "i/n, as in 3/8");
  o.shards = parsed<std::uint32_t>("--shard", text.substr(slash + 1), 1, 1000000);
  o.shard = parsed<std::uint32_t>("--shard", text.substr(0, slash), 1, o.shards);
}

using Setter = std::function<void(CampaignOptions&, const std::string&)>;

Duration seconds(const char* option, const std::string& text) {
  return from_seconds(parsed<double>(option, text, 0.001, 1e7));
}

const std::map<std::string, Setter>& valued() {
  using O = CampaignOptions;
  static const std::map<std::string, Setter> kSetters = {
      {"--filter", [](O& o, const std::string& v) { o.filter = v; }},
      {"--runs",
       [](O& o, const std::string& v) { o.runs = parsed<std::uint32_t>("--runs", v, 1, 9999999); }},
      {"-j", [](O& o, const std::string& v) { o.jobs = parsed("-j", v, 1, 1024); }},
      {"--seed",
       [](O& o, const std::string& v) {
         o.seed = parsed<std::uint64_t>("--seed", v, 0, (std::uint64_t{1} << 53) - 10000001);
       }},
      {"--out", [](O& o, const std::string& v) { o.out = v; }},
      {"--shard", parse_shard},
      {"--time-limit",
       [](O& o, const std::string& v) { o.limits.time = seconds("--time-limit", v); }},
      {"--memory-limit",
       [](O& o, const std::string& v) {
         o.limits.memory_bytes =
             parsed<std::uint64_t>("--memory-limit", v, 1, 100'000'000) * 1'000'000;
       }},
      {"--data", [](O& o, const std::string& v) { o.data.push_back(v); }},
      {"--html", [](O& o, const std::string& v) { o.html = v; }},
      {"--csv", [](O& o, const std::string& v) { o.csv = v; }},
      {"--database", [](O& o, const std::string& v) { o.database = v; }},
      {"--chunk", [](O& o, const std::string& v) { o.chunk = seconds("--chunk", v); }},
      {"--processors",
       [](O& o, const std::string& v) { o.processors = parsed("--processors", v, 1, 1024); }},
      {"--partition", [](O& o, const std::string& v) { o.partition = v; }},
      {"--run",
       [](O& o, const std::string& v) { o.run = parsed<std::uint32_t>("--run", v, 0, 9999999); }},
      {"--parameter", [](O& o, const std::string& v) { o.parameter = v; }},
      {"--tolerance",
       [](O& o, const std::string& v) { o.tolerance = parsed("--tolerance", v, 1e-300, 1e300); }},
  };
  return kSetters;
}

const std::map<std::string, bool CampaignOptions::*>& switches() {
  static const std::map<std::string, bool CampaignOptions::*> kSwitches = {
      {"--resume", &CampaignOptions::resume},
      {"--retry-failed", &CampaignOptions::retry_failed},
      {"--until-failure", &CampaignOptions::until_failure},
      {"--quiet", &CampaignOptions::quiet},
      {"--slurm", &CampaignOptions::slurm},
      {"--dry-run", &CampaignOptions::dry_run}};
  return kSwitches;
}

// -j4, --runs=10 and --runs 10 are the same.
void parse_option(CampaignOptions& o, const std::vector<std::string>& arguments, std::size_t& i) {
  const std::string& argument = arguments[i];
  if (const auto found = switches().find(argument); found != switches().end()) {
    o.*found->second = true;
    return;
  }
  std::string name = argument.substr(0, argument.find('=')), value;
  bool has_value = name.size() < argument.size();
  if (has_value) value = argument.substr(name.size() + 1);
  if (argument.starts_with("-j") && argument.size() > 2 && !has_value) {
    name = "-j";
    value = argument.substr(2);
    has_value = true;
  }
  const auto setter = valued().find(name);
  if (setter == valued().end()) throw std::invalid_argument(argument + ": no such option");
  if (!has_value) {
    if (i + 1 >= arguments.size()) throw std::invalid_argument(argument + ": needs a value");
    value = arguments[++i];
  }
  setter->second(o, value);
}

void check(const CampaignOptions& o) {
  const bool flies = o.command == "run" || o.command == "submit";
  if (flies && o.program.empty()) throw std::invalid_argument(o.command + ": no test program");
  if (flies && (o.filter.empty() || o.filter.find_first_of("*?:") != std::string::npos)) {
    refuse("--filter", o.filter, "the whole name of one test, Suite.Test");
  }
  if (!flies && o.folders.empty()) {
    throw std::invalid_argument(o.command + ": no folder of results");
  }
  if (o.command == "submit" && !o.slurm) throw std::invalid_argument("submit: to what? --slurm");
  if (o.command == "bisect" && o.parameter.empty()) {
    throw std::invalid_argument("bisect: no --parameter NAME");
  }
  for (const std::string& flag : o.flags) {
    if (!flag.starts_with("--orrery_")) refuse("--", flag, "--orrery_* flags of the test program");
  }
}

}  // namespace

CampaignOptions parse_campaign_options(const std::vector<std::string>& arguments) {
  CampaignOptions o;
  o.jobs = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  if (arguments.empty()) throw std::invalid_argument("no command");
  o.command = arguments[0];
  bool known = false;
  for (const char* command : {"run", "accept", "merge", "report", "submit", "bisect"}) {
    known = known || o.command == command;
  }
  if (!known) throw std::invalid_argument(o.command + ": no such command");
  for (std::size_t i = 1; i < arguments.size(); ++i) {
    const std::string& argument = arguments[i];
    if (argument == "--") {
      o.flags.assign(arguments.begin() + static_cast<std::ptrdiff_t>(i) + 1, arguments.end());
      break;
    }
    if (argument.starts_with("-")) {
      parse_option(o, arguments, i);
    } else if ((o.command == "run" || o.command == "submit") && o.program.empty()) {
      o.program = std::filesystem::absolute(argument).lexically_normal().string();
    } else if (o.command == "run" || o.command == "submit") {
      throw std::invalid_argument(argument + ": a second test program");
    } else {
      o.folders.emplace_back(argument);
    }
  }
  check(o);
  return o;
}

std::string campaign_usage() {
  return R"(usage: orrery-campaign COMMAND ...

  run PROGRAM --filter Suite.Test [--runs N] [-j J] [--out DIR] [--seed BASE] [-- --orrery_* ...]
      Flies runs 0 ... N-1, each in a process of its own, with seeds BASE, BASE+1 ... (default 1), J at
      a time (one per processor). N is what the test's Runs{n} says, if it has one. A line of JSON per
      run goes to DIR (campaign). Then the test judges the whole, where it calls fly_campaign().
      --shard i/n       only these; accept DIR judges when all shards are done
      --resume          fly what is missing or was killed
      --retry-failed    fly again what did not pass
      --until-failure   stop at the first failure; without --runs, go on until there is one
      --time-limit S    of each run on the host (600)
      --memory-limit MB likewise, resident (none)
      --data FILE       a file that runs read: results count as long as it stays the same
      --quiet           no progress bar
  accept DIR            the test judges the results in DIR
  merge DIR             DIR/campaign.sqlite
  merge OUT DIR ...     several folders of one campaign into OUT
  report DIR [--html FILE] [--csv FILE] [--database FILE]
  submit --slurm PROGRAM --filter Suite.Test [as run] [--chunk S] [--processors P] [--partition NAME]
      [--dry-run]       as a job array, in tasks of about S seconds (60)
  bisect DIR --run I --parameter NAME [--tolerance X]
      Where a failing run begins to fail, between its own value of a dispersion and the median.

Exit code: 0 passed, 1 failed, 2 usage or refused, 3 the same run gave another result.
)";
}

}  // namespace orrery
