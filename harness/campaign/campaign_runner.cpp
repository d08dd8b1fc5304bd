#include <orrery/harness/campaign/campaign_progress.hpp>
#include <orrery/harness/campaign/campaign_runner.hpp>
#include <orrery/harness/gtest/child_process.hpp>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <stdexcept>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

namespace orrery {
namespace {

constexpr std::size_t kMostSites = 10;

volatile std::sig_atomic_t interrupted = 0;

void note_interrupt(int signal) {
  interrupted = signal;
}

void listen_for_interrupts() {
  struct sigaction action {};
  action.sa_handler = note_interrupt;
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) sigaction(signal, &action, nullptr);
}

/// Hashes of files, which are read again only when they seem to have changed.
class FileHashes {
 public:
  const std::string& of(const std::string& path) {
    struct stat now {};
    if (stat(path.c_str(), &now) != 0) {
      throw Refused(path + ": " + std::strerror(errno));
    }
    Known& known = known_[path];
    if (known.hash.empty() || changed(known.info, now)) known = {now, sha256_of(path)};
    return known.hash;
  }

 private:
  struct Known {
    struct stat info {};
    std::string hash = {};
  };
  static bool changed(const struct stat& a, const struct stat& b) {
    return a.st_ino != b.st_ino || a.st_size != b.st_size || a.st_mtim.tv_sec != b.st_mtim.tv_sec ||
           a.st_mtim.tv_nsec != b.st_mtim.tv_nsec;
  }
  std::map<std::string, Known> known_;
};

/// What all runs of a campaign must share, beyond its manifest.
class Common {
 public:
  /// Empty, or what a new record has that others have not.
  std::string difference_in(const RunRecord& run) const {
    for (const auto& [name, hash] : run.hashes) {
      const auto known = hashes_.find(name);
      if (known != hashes_.end() && known->second != hash) {
        return "the flight library " + name + " is another one (SHA-256 " + hash.substr(0, 12) +
               ", was " + known->second.substr(0, 12) + ")";
      }
    }
    for (const DrawnDispersion& d : run.dispersions) {
      const auto known = distributions_.find(d.name);
      if (known != distributions_.end() && known->second != d.distribution) {
        return "the dispersion of " + d.name + " is " + d.distribution + ", was " + known->second;
      }
    }
    return {};
  }
  void learn(const RunRecord& run) {
    hashes_.insert(run.hashes.begin(), run.hashes.end());
    for (const DrawnDispersion& d : run.dispersions) {
      distributions_.try_emplace(d.name, d.distribution);
    }
  }

 private:
  std::map<std::string, std::string> hashes_, distributions_;
};

class Runner {
 public:
  explicit Runner(const CampaignOptions& options) : options_(options), progress_(options.quiet) {
    manifest_ = {.test = options.filter,
                 .base_seed = options.seed,
                 .runs = options.runs,
                 .program = options.program,
                 .flags = options.flags,
                 .files = {},
                 .program_sha256 = hashes_.of(options.program)};
    for (const std::string& file : options.data) {
      const std::string path = std::filesystem::absolute(file).lexically_normal().string();
      manifest_.files[path] = hashes_.of(path);
    }
  }

  int run() {
    open_folder();
    listen_for_interrupts();
    if (manifest_.runs == 0 && !options_.until_failure) ask_how_many();
    plan();
    fly();
    return end();
  }

 private:
  std::filesystem::path own_file() const {
    if (options_.pilot > 0) return options_.out / "runs-pilot.jsonl";
    if (options_.shards == 1) return options_.out / "runs.jsonl";
    return options_.out / ("runs-" + std::to_string(options_.shard) + "of" +
                           std::to_string(options_.shards) + ".jsonl");
  }

  bool is_ours(std::uint32_t run) const { return run % options_.shards == options_.shard - 1; }

  void open_folder() {
    std::filesystem::create_directories(options_.out);
    if (const auto before = read_manifest(options_.out)) {
      const std::string difference = manifest_.difference_from(*before);
      if (!difference.empty()) {
        throw Refused(options_.out.string() + " has results of another campaign: " + difference);
      }
      manifest_.runs = std::max(manifest_.runs, before->runs);
    }
    merged_ = read_runs(options_.out);
    for (const auto& [index, record] : merged_.runs) {
      common_.learn(record);
      had_ours_ = had_ours_ || is_ours(index);
    }
    if (had_ours_ && !options_.resume && !options_.retry_failed) {
      throw Refused(options_.out.string() +
                    " has results: --resume flies what is missing, --retry-failed what did not "
                    "pass; or name another --out");
    }
    for (const auto& [index, record] : merged_.runs) check_libraries(record);
    if (manifest_.runs > 0) write_manifest(manifest_, options_.out);
    store_ = std::make_unique<RunStore>(own_file());
  }

  // Results of a library that has changed since would be mixed with those to come.
  void check_libraries(const RunRecord& record) {
    for (const auto& [name, path] : record.flight_libraries) {
      const auto hash = record.hashes.find(name);
      if (hash == record.hashes.end() || !checked_.insert({name, hash->second}).second) continue;
      if (hashes_.of(path) != hash->second) {
        throw Refused(options_.out.string() + " has results with another flight library: " + path +
                      " has changed");
      }
    }
  }

  // Run 0 tells what Runs{n} says.
  void ask_how_many() {
    if (merged_.runs.find(0) == merged_.runs.end()) {
      RunPool pool(1, options_.limits);
      pool.start(command_of(manifest_, 0));
      while (!pool.is_idle() && interrupted == 0) {
        for (RunRecord& record : pool.finished(1s)) keep(record);
      }
      if (interrupted != 0) return;
    }
    const RunRecord& first = merged_.runs.at(0);
    if (first.runs == 0) {
      throw Refused("--runs N: run 0 of " + manifest_.test + " " + to_string(first.outcome) +
                    " and did not say how many there are" +
                    (first.failure_text.empty() ? "" : ": " + first.failure_text));
    }
    manifest_.runs = first.runs;
    write_manifest(manifest_, options_.out);
  }

  void plan() {
    for (std::uint32_t run = 0; run < manifest_.runs; ++run) {
      if (!is_ours(run)) continue;
      const auto found = merged_.runs.find(run);
      // Whoever ended a killed run, a scheduler perhaps, it had no chance.
      const bool missing =
          found == merged_.runs.end() || found->second.outcome == RunOutcome::kKilled;
      const bool did_not_pass =
          found != merged_.runs.end() && found->second.outcome != RunOutcome::kPassed;
      const bool flies =
          (missing && (options_.resume || !had_ours_)) || (did_not_pass && options_.retry_failed);
      if (flies) todo_.push_back(run);
    }
    if (options_.pilot > 0 && todo_.size() > options_.pilot) todo_.resize(options_.pilot);
    next_endless_ = manifest_.runs;
  }

  std::optional<std::uint32_t> next() {
    if (interrupted != 0 || (options_.until_failure && failed_)) return {};
    if (!todo_.empty()) {
      const std::uint32_t run = todo_.front();
      todo_.pop_front();
      return run;
    }
    if (!options_.until_failure || options_.runs > 0) return {};
    while (!is_ours(next_endless_)) ++next_endless_;
    return next_endless_++;
  }

  void fly() {
    const bool endless = options_.until_failure && options_.runs == 0;
    if (!endless) progress_.expect(progress_.done() + static_cast<std::uint32_t>(todo_.size()));
    RunPool pool(options_.jobs, options_.limits);
    bool more = true;
    while (more || !pool.is_idle()) {
      while (more && pool.has_room()) {
        const auto run = next();
        more = run.has_value();
        if (!more) break;
        check_program();
        pool.start(command_of(manifest_, *run));
      }
      if (interrupted != 0) break;
      for (RunRecord& record : pool.finished(200ms)) keep(record);
      progress_.show();
    }
    progress_.clear();
  }

  void check_program() {
    if (hashes_.of(manifest_.program) != manifest_.program_sha256) {
      throw Refused(manifest_.program + " has changed while the campaign was flown");
    }
  }

  void keep(RunRecord& record) {
    for (const auto& [name, path] : record.flight_libraries) {
      record.hashes[name] = hashes_.of(path);
    }
    const std::string difference = common_.difference_in(record);
    if (!difference.empty()) {
      throw Refused("run " + std::to_string(record.run) +
                    " belongs to another campaign: " + difference);
    }
    common_.learn(record);
    store_->append(record);
    merged_.add(record);
    failed_ = failed_ || record.outcome != RunOutcome::kPassed;
    progress_.count(record);
  }

  int end() {
    if (options_.until_failure && manifest_.runs < next_endless_) {
      manifest_.runs = next_endless_;
      write_manifest(manifest_, options_.out);
    }
    print_failures();
    std::printf("%u runs in %.1f s: %s; results in %s\n", progress_.done(), progress_.seconds(),
                progress_.counts().c_str(), options_.out.c_str());
    if (interrupted != 0) {
      std::printf("interrupted; --resume flies what is missing\n");
      return 128 + interrupted;
    }
    for (const Contradiction& one : merged_.contradictions) {
      std::printf("DEFECT: run %u (seed %llu) gave another result: %s\n", one.run,
                  static_cast<unsigned long long>(one.seed), one.what.c_str());
    }
    if (!merged_.contradictions.empty()) return kExitContradiction;
    return verdict();
  }

  int verdict() {
    if (options_.pilot > 0) return kExitPassed;
    if (options_.until_failure) return failed_ ? kExitFailed : kExitPassed;
    if (options_.shards > 1) return kExitPassed;  // accept judges when all of them are done
    const bool is_campaign = !merged_.runs.empty() && merged_.runs.begin()->second.runs > 0;
    if (is_campaign) return accept_campaign(options_.out);
    const bool complete = merged_.runs.size() >= manifest_.runs;
    const bool all_passed =
        std::all_of(merged_.runs.begin(), merged_.runs.end(),
                    [](const auto& run) { return run.second.outcome == RunOutcome::kPassed; });
    return complete && all_passed ? kExitPassed : kExitFailed;
  }

  void print_failures() const {
    std::map<std::string, std::vector<const RunRecord*>> by_site;
    for (const auto& [index, record] : merged_.runs) {
      if (record.outcome == RunOutcome::kPassed) continue;
      by_site[std::string(to_string(record.outcome)) + ": " + record.failure_site].push_back(
          &record);
    }
    std::size_t shown = 0;
    for (const auto& [site, runs] : by_site) {
      if (++shown > kMostSites) break;
      std::printf("%zu %s\n  replay: %s\n", runs.size(), site.c_str(),
                  replay_command_of(command_of(manifest_, runs.front()->run)).c_str());
    }
  }

  CampaignOptions options_;
  FileHashes hashes_;
  CampaignManifest manifest_;
  MergedRuns merged_;
  Common common_;
  std::set<std::pair<std::string, std::string>> checked_;
  std::unique_ptr<RunStore> store_;
  std::deque<std::uint32_t> todo_;
  std::uint32_t next_endless_ = 0;
  CampaignProgress progress_;
  bool had_ours_ = false, failed_ = false;
};

}  // namespace

RunCommand command_of(const CampaignManifest& manifest, std::uint32_t run) {
  return {.program = manifest.program,
          .test = manifest.test,
          .base_seed = manifest.base_seed,
          .run = run,
          .flags = manifest.flags};
}

CampaignManifest manifest_of(const std::filesystem::path& folder) {
  if (auto manifest = read_manifest(folder)) return *manifest;
  throw Refused(folder.string() + ": no campaign.json, so no results of a campaign");
}

int run_campaign(const CampaignOptions& options) {
  return Runner(options).run();
}

int accept_campaign(const std::filesystem::path& folder) {
  const CampaignManifest manifest = manifest_of(folder);
  if (sha256_of(manifest.program) != manifest.program_sha256) {
    throw Refused(manifest.program + " is another one than that which left the results in " +
                  folder.string());
  }
  const ChildOutcome outcome =
      run_child({.arguments = {"--gtest_filter=" + manifest.test, "--gtest_also_run_disabled_tests",
                               "--orrery_seed=" + std::to_string(manifest.base_seed),
                               "--orrery_campaign=" + std::filesystem::absolute(folder).string()},
                 .environment = {},
                 .removed = {"ORRERY_RUN", "ORRERY_OUT"},
                 .program = manifest.program});
  std::fputs(outcome.tail.c_str(), stdout);
  if (outcome.passed()) return kExitPassed;
  if (outcome.exit_code != 1) {
    throw Refused(manifest.program + " " + outcome.describe() + " when asked to judge");
  }
  return kExitFailed;
}

}  // namespace orrery
