#include <orrery/harness/campaign/campaign_runner.hpp>
#include <orrery/harness/campaign/slurm_script.hpp>
#include <orrery/harness/kernel/text.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <sys/wait.h>

namespace orrery {
namespace {

constexpr std::uint32_t kPilots = 3;
constexpr double kMostTasks = 10000;

std::string quoted_for_shell(const std::string& text) {
  std::string out = "'";
  for (const char c : text) out += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return out + "'";
}

std::string output_of(const std::string& command) {
  FILE* pipe = popen(command.c_str(), "r");
  if (pipe == nullptr) throw Refused("cannot start: " + command);
  std::string text;
  std::array<char, 256> buffer;
  while (fgets(buffer.data(), buffer.size(), pipe) != nullptr) text += buffer.data();
  const int status = pclose(pipe);
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) throw Refused("failed: " + command);
  while (!text.empty() && text.back() == '\n') text.pop_back();
  return text;
}

double mean_run_s(const std::filesystem::path& folder) {
  double sum_s = 0, n = 0;
  for (const auto& [index, record] : read_runs(folder).runs) {
    sum_s += record.wall_s;
    ++n;
  }
  return n > 0 ? sum_s / n : 1;
}

}  // namespace

std::uint32_t slurm_tasks(const CampaignOptions& options, std::uint32_t runs, double run_s) {
  const double all_s = run_s * runs, chunk_s = to_seconds(options.chunk) * options.processors;
  const double most = std::min(kMostTasks, static_cast<double>(runs));
  return static_cast<std::uint32_t>(std::clamp(std::ceil(all_s / chunk_s), 1.0, most));
}

std::string slurm_script(const CampaignOptions& o, const std::string& runner, std::uint32_t tasks) {
  const std::string out = o.out.string(), n = std::to_string(tasks);
  std::string text = "#!/bin/bash\n";
  const auto ask = [&text](const std::string& option) { text += "#SBATCH --" + option + "\n"; };
  ask("job-name=orrery-" + o.filter);
  ask("array=1-" + n);
  ask("cpus-per-task=" + std::to_string(o.processors));
  if (!o.partition.empty()) ask("partition=" + o.partition);
  ask("requeue");           // when a node fails
  ask("open-mode=append");  // or a requeued task would lose its log
  ask("output=" + out + "/slurm-%a.log");
  text += "exec " + quoted_for_shell(runner) + " run " + quoted_for_shell(o.program) +
          " --filter " + quoted_for_shell(o.filter) + " --runs " + std::to_string(o.runs) +
          " --seed " + std::to_string(o.seed) + " --out " + quoted_for_shell(out) +
          " \\\n  --shard \"$SLURM_ARRAY_TASK_ID/" + n + "\" --resume --quiet -j " +
          std::to_string(o.processors) + " --time-limit " + to_text(to_seconds(o.limits.time));
  if (o.limits.memory_bytes > 0) {
    text += " --memory-limit " + std::to_string(o.limits.memory_bytes / 1'000'000);
  }
  for (const std::string& file : o.data) text += " --data " + quoted_for_shell(file);
  if (!o.flags.empty()) text += " --";
  for (const std::string& flag : o.flags) text += " " + quoted_for_shell(flag);
  return text + "\n";
}

int submit_to_slurm(const CampaignOptions& asked) {
  CampaignOptions options = asked;
  options.out = std::filesystem::absolute(options.out).lexically_normal();
  options.pilot = kPilots;
  options.resume = true;
  if (const int code = run_campaign(options); code != kExitPassed) return code;
  options.runs = manifest_of(options.out).runs;
  const double run_s = mean_run_s(options.out);
  const std::uint32_t tasks = slurm_tasks(options, options.runs, run_s);
  const std::string runner = std::filesystem::read_symlink("/proc/self/exe").string();
  const std::filesystem::path script = options.out / "campaign.slurm";
  std::ofstream(script) << slurm_script(options, runner, tasks);
  std::printf("%s: %u runs of %.3g s in %u tasks\n", script.c_str(), options.runs, run_s, tasks);
  const std::string end = quoted_for_shell(runner) + " report " +
                          quoted_for_shell(options.out.string()) + "; " + quoted_for_shell(runner) +
                          " accept " + quoted_for_shell(options.out.string());
  if (options.dry_run) {
    std::printf("then: %s\n", end.c_str());
    return kExitPassed;
  }
  const std::string job = output_of("sbatch --parsable " + quoted_for_shell(script.string()));
  std::string last = "sbatch --parsable --dependency=afterany:" + job +
                     " --job-name=orrery-report --output=" +
                     quoted_for_shell((options.out / "accept.log").string());
  if (!options.partition.empty()) last += " --partition=" + quoted_for_shell(options.partition);
  const std::string judge = output_of(last + " --wrap " + quoted_for_shell(end));
  std::printf("submitted: array %s, then report and verdict %s, in %s/accept.log\n", job.c_str(),
              judge.c_str(), options.out.c_str());
  return kExitPassed;
}

}  // namespace orrery
