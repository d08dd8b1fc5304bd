#include <orrery/harness/gtest/flags.hpp>
#include <orrery/harness/gtest/run_record.hpp>
#include <orrery/harness/kernel/text.hpp>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <fcntl.h>
#include <limits>
#include <set>
#include <unistd.h>

namespace orrery {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kPipeVariable = "ORRERY_RUN_RECORD";
constexpr int kVersion = 1;
constexpr std::size_t kMostText = 1000;  // of a failure
constexpr std::array<const char*, kRunOutcomes> kOutcomes = {
    "passed", "failed", "crashed", "timeout", "memory", "killed", "error"};

double number_or_nan(const Json& value) {
  return value.is_number() ? value.get<double>() : std::numeric_limits<double>::quiet_NaN();
}

bool same(double a, double b) {
  return a == b || (std::isnan(a) && std::isnan(b));
}

std::string shortened(std::string_view text, std::size_t most) {
  return std::string(text.substr(0, most)) + (text.size() > most ? " ..." : "");
}

std::string file_name(std::string_view path) {
  return std::string(path.substr(path.rfind('/') + 1));  // npos + 1 = 0
}

// A text as the name of a group: its first line, with numbers, which differ from run to run, left
// out.
std::string without_numbers(std::string_view text) {
  std::string kept;
  bool in_number = false;
  for (const char c : text.substr(0, text.find('\n')).substr(0, 160)) {
    const bool digit = c >= '0' && c <= '9';
    if (!digit) kept += c;
    if (digit && !in_number) kept += '#';
    in_number = digit;
  }
  return kept;
}

struct Collector {
  int pipe = -1;
  RunRecord record;
  std::string crash_site;
  bool flies_elsewhere = false;
};

Collector& collector() {
  static Collector the_collector;
  return the_collector;
}

void write_line(int pipe, std::string_view line) {
  std::size_t done = 0;
  while (done < line.size()) {
    const ssize_t n = write(pipe, line.data() + done, line.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return;  // nobody listens any more
    done += static_cast<std::size_t>(n);
  }
}

RunRecord from_json(const Json& json) {
  RunRecord r;
  if (json.at("v").get<int>() != kVersion) throw std::invalid_argument("another version");
  r.test = json.at("test").get<std::string>();
  r.run = json.at("run").get<std::uint32_t>();
  r.seed = json.at("seed").get<std::uint64_t>();
  r.runs = json.at("runs").get<std::uint32_t>();
  const auto outcome = outcome_of(json.at("outcome").get<std::string>());
  if (!outcome) throw std::invalid_argument("no outcome");
  r.outcome = *outcome;
  r.exit_code = json.at("exit").get<int>();
  r.signal = json.at("signal").get<int>();
  r.fingerprint = json.at("fingerprint").get<std::string>();
  r.simulated_s = json.at("simulated_s").get<double>();
  r.events = json.at("events").get<std::uint64_t>();
  for (const auto& [name, value] : json.at("metrics").items()) {
    r.metrics.emplace_back(name, number_or_nan(value));
  }
  for (const auto& [name, drawn] : json.at("dispersions").items()) {
    r.dispersions.push_back({name, number_or_nan(drawn.at(0)), drawn.at(1).get<std::string>()});
  }
  r.failure_site = json.at("site").get<std::string>();
  r.failure_text = json.at("failure").get<std::string>();
  for (const auto& [name, file] : json.at("libraries").items()) r.flight_libraries[name] = file;
  for (const auto& [name, hash] : json.at("sha256").items()) r.hashes[name] = hash;
  r.wall_s = json.at("wall_s").get<double>();
  r.cpu_s = json.at("cpu_s").get<double>();
  r.peak_kB = json.at("peak_kB").get<std::uint64_t>();
  return r;
}

}  // namespace

const char* to_string(RunOutcome outcome) {
  return kOutcomes.at(static_cast<std::size_t>(outcome));
}

std::optional<RunOutcome> outcome_of(std::string_view word) {
  for (std::size_t i = 0; i < kOutcomes.size(); ++i) {
    if (word == kOutcomes[i]) return static_cast<RunOutcome>(i);
  }
  return {};
}

const double* RunRecord::metric(std::string_view name) const {
  for (const auto& [known, value] : metrics) {
    if (known == name) return &value;
  }
  return nullptr;
}

std::string RunRecord::difference_from(const RunRecord& other) const {
  const auto differ = [](const std::string& what, const std::string& now, const std::string& then) {
    return what + " is " + (now.empty() ? "none" : now) + ", was " + (then.empty() ? "none" : then);
  };
  if (outcome != other.outcome) {
    return differ("the outcome", to_string(outcome), to_string(other.outcome));
  }
  if (fingerprint != other.fingerprint) {
    return differ("the fingerprint", fingerprint, other.fingerprint);
  }
  for (std::size_t i = 0; i < std::max(metrics.size(), other.metrics.size()); ++i) {
    if (i >= metrics.size() || i >= other.metrics.size() ||
        metrics[i].first != other.metrics[i].first) {
      return "the metrics are others";
    }
    if (!same(metrics[i].second, other.metrics[i].second)) {
      return differ(metrics[i].first, to_text(metrics[i].second), to_text(other.metrics[i].second));
    }
  }
  if (dispersions != other.dispersions) return "the dispersions are others";
  if (failure_site != other.failure_site) {
    return differ("the failure", failure_site, other.failure_site);
  }
  return {};
}

std::string to_json_line(const RunRecord& r) {
  Json metrics = Json::object(), dispersions = Json::object(), libraries = Json::object(),
       hashes = Json::object();
  for (const auto& [name, value] : r.metrics) metrics[name] = value;
  for (const DrawnDispersion& d : r.dispersions) {
    dispersions[d.name] = Json::array({d.value, d.distribution});
  }
  for (const auto& [name, file] : r.flight_libraries) libraries[name] = file;
  for (const auto& [name, hash] : r.hashes) hashes[name] = hash;
  const Json line = {{"v", kVersion},
                     {"test", r.test},
                     {"run", r.run},
                     {"seed", r.seed},
                     {"runs", r.runs},
                     {"outcome", to_string(r.outcome)},
                     {"exit", r.exit_code},
                     {"signal", r.signal},
                     {"fingerprint", r.fingerprint},
                     {"simulated_s", r.simulated_s},
                     {"events", r.events},
                     {"metrics", metrics},
                     {"dispersions", dispersions},
                     {"site", r.failure_site},
                     {"failure", r.failure_text},
                     {"libraries", libraries},
                     {"sha256", hashes},
                     {"wall_s", r.wall_s},
                     {"cpu_s", r.cpu_s},
                     {"peak_kB", r.peak_kB}};
  return line.dump(-1, ' ', false, Json::error_handler_t::replace);
}

std::optional<RunRecord> parse_run_record(std::string_view line) {
  const Json json = Json::parse(line, nullptr, /*allow_exceptions=*/false);
  if (!json.is_object()) return {};
  try {
    return from_json(json);
  } catch (const std::exception&) {  // a member that is missing or of another type
    return {};
  }
}

void record_metric(std::string_view name_with_unit, double value) {
  internal::note_metric(name_with_unit, value);
  if (testing::UnitTest::GetInstance()->current_test_info() == nullptr) return;
  testing::Test::RecordProperty(std::string(name_with_unit), std::to_string(value));
}

namespace internal {

void adopt_run_record() {
  const char* text = std::getenv(kPipeVariable);
  if (text == nullptr) return;
  const int pipe = std::atoi(text);
  unsetenv(kPipeVariable);  // a child of this one is not the run
  if (pipe > 2 && fcntl(pipe, F_SETFD, FD_CLOEXEC) == 0) collector().pipe = pipe;
}

bool leaves_run_record() {
  return collector().pipe >= 0;
}

void begin_run_record(const testing::TestInfo& test) {
  collector().crash_site.clear();
  collector().flies_elsewhere = false;
  RunRecord& record = collector().record = {};
  record.test = std::string(test.test_suite_name()) + "." + test.name();
  record.run = flags().run.value_or(0);
  record.seed = flags().seed + record.run;
  if (leaves_run_record()) write_line(collector().pipe, kRunBegun);
}

void note_metric(std::string_view name, double value) {
  auto& metrics = collector().record.metrics;
  for (auto& [known, last] : metrics) {
    if (known != name) continue;
    last = value;
    return;
  }
  metrics.emplace_back(name, value);
}

void note_dispersion(const DrawnDispersion& drawn) {
  collector().record.dispersions.push_back(drawn);
}

void note_world_end(const std::string& fingerprint, double simulated_s, std::uint64_t events,
                    const std::map<std::string, std::string>& flight_libraries) {
  RunRecord& record = collector().record;
  record.fingerprint += (record.fingerprint.empty() ? "" : ",") + fingerprint;
  record.simulated_s += simulated_s;
  record.events += events;
  record.flight_libraries.insert(flight_libraries.begin(), flight_libraries.end());
}

void note_crash_site(const std::string& site) {
  collector().crash_site = site;
}

void note_failure(const char* file, int line, std::string_view text) {
  RunRecord& record = collector().record;
  if (!record.failure_site.empty()) return;
  if (!collector().crash_site.empty()) {
    record.failure_site = collector().crash_site;
  } else if (file != nullptr && *file != 0) {
    record.failure_site = file_name(file) + ":" + std::to_string(line);
  } else {
    record.failure_site = without_numbers(text);
  }
  record.failure_text = shortened(text, kMostText);
}

void note_runs_elsewhere() {
  collector().flies_elsewhere = true;
}

void check_settings(const testing::TestInfo& test) {
  if (collector().flies_elsewhere || test.result()->Skipped()) return;
  const std::vector<DrawnDispersion>& drawn = collector().record.dispersions;
  if (drawn.empty() && test.result()->Failed()) return;  // it did not come that far
  std::string known;
  std::set<std::string, std::less<>> names;
  for (const DrawnDispersion& one : drawn) {
    if (names.insert(one.name).second) known += (known.empty() ? "" : ", ") + one.name;
  }
  for (const auto& [name, value] : flags().set) {
    if (names.count(name) > 0) continue;
    ADD_FAILURE() << "--orrery_set=" << name << "=" << to_text(value)
                  << ": this test draws no dispersion of that name; it draws "
                  << (known.empty() ? "none" : known);
  }
}

void note_campaign_run(std::uint32_t run, std::uint64_t seed, std::uint32_t runs) {
  RunRecord& record = collector().record;
  record.run = run;
  record.seed = seed;
  record.runs = runs;
}

void end_run_record(const testing::TestInfo& test) {
  const int pipe = std::exchange(collector().pipe, -1);
  if (pipe < 0) return;
  if (!test.result()->Skipped()) {
    RunRecord& record = collector().record;
    record.outcome = test.result()->Failed() ? RunOutcome::kFailed : RunOutcome::kPassed;
    write_line(pipe, to_json_line(record) + "\n");
  }
  close(pipe);
}

}  // namespace internal
}  // namespace orrery
