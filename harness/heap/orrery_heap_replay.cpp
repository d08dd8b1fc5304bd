// orrery-heap-replay TRACE: what a flight asked of its heap, asked of every policy. Exit code 0:
// all requests were met, 1: some were not, 2: trouble.
#include <orrery/harness/heap/heap_trace.hpp>

#include <array>
#include <cerrno>
#include <charconv>
#include <cinttypes>
#include <cstdio>
#include <cstring>
#include <exception>
#include <fstream>
#include <iterator>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace {

using orrery::HeapOptions;
using orrery::HeapPolicy;

constexpr const char* kUsage =
    "usage: orrery-heap-replay TRACE [--policy=NAME] [--alignment=8|16] [--limit=BYTES]\n"
    "                          [--history=FILE.csv]\n\n"
    "Asks of a simulated heap what a recorded trace says (HeapHandle::trace(), saved to a file).\n"
    "One line per policy: first-fit best-fit next-fit tlsf heap-4 newlib, or the one named.\n"
    "Sizes are of whole blocks, 8 bytes of tags included; the default limit is 64000000 bytes.\n"
    "--history, with one policy, writes a row per call of flight code.\n"
    "Exit code: 0 all requests met, 1 some refused, 2 something could not be read.\n";

struct NamedPolicy {
  const char* name;
  HeapPolicy policy;
};
constexpr std::array<NamedPolicy, 6> kPolicies = {{{"first-fit", HeapPolicy::kFirstFit},
                                                   {"best-fit", HeapPolicy::kBestFit},
                                                   {"next-fit", HeapPolicy::kNextFit},
                                                   {"tlsf", HeapPolicy::kTlsf},
                                                   {"heap-4", HeapPolicy::kFreeRtos4},
                                                   {"newlib", HeapPolicy::kNewlib}}};

struct Arguments {
  std::string trace, history;
  std::vector<NamedPolicy> policies{kPolicies.begin(), kPolicies.end()};
  HeapOptions options;
};

std::uint64_t number(std::string_view flag, std::string_view text) {
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size()) {
    throw std::invalid_argument(std::string(flag) + " takes a number of bytes, not \"" +
                                std::string(text) + "\"");
  }
  return value;
}

NamedPolicy policy_named(std::string_view name) {
  std::string names;
  for (const NamedPolicy& known : kPolicies) {
    if (name == known.name) return known;
    names += std::string(" ") + known.name;
  }
  throw std::invalid_argument("there is no policy \"" + std::string(name) + "\"; there are" +
                              names);
}

Arguments parse(int argc, char** argv) {
  Arguments arguments;
  for (int i = 1; i < argc; ++i) {
    const std::string_view argument = argv[i];
    const std::size_t equals = argument.find('=');
    const std::string_view flag = argument.substr(0, equals);
    const std::string_view value =
        equals == std::string_view::npos ? std::string_view{} : argument.substr(equals + 1);
    if (flag == "--policy") {
      arguments.policies = {policy_named(value)};
    } else if (flag == "--alignment") {
      arguments.options.alignment = static_cast<int>(number(flag, value));
    } else if (flag == "--limit") {
      arguments.options.limit_bytes = number(flag, value);
    } else if (flag == "--history") {
      arguments.history = value;
    } else if (flag.starts_with("-") || !arguments.trace.empty()) {
      throw std::invalid_argument("\"" + std::string(argument) + "\" is not understood");
    } else {
      arguments.trace = argument;
    }
  }
  if (arguments.trace.empty()) throw std::invalid_argument("no trace was named");
  if (!arguments.history.empty() && arguments.policies.size() != 1) {
    throw std::invalid_argument("--history needs --policy");
  }
  return arguments;
}

orrery::ByteBuffer read(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::string text{std::istreambuf_iterator<char>(file), {}};
  if (!file) throw std::runtime_error(path + ": " + std::strerror(errno));
  const orrery::Bytes bytes = std::as_bytes(std::span(text));
  return {bytes.begin(), bytes.end()};
}

void write_history(const std::string& path, const orrery::HeapHistory& history) {
  std::ofstream file(path);
  file << "t_s,resting_bytes,transient_peak_bytes,heap_bytes,largest_free_bytes,free_list_length,"
          "allocations\n";
  for (const orrery::HeapSample& s : history.samples()) {
    const double t_s = static_cast<double>((s.t - history.start()).count()) / 1e9;
    char time[40];
    std::snprintf(time, sizeof time, "%.9f", t_s);
    file << time << ',' << s.resting_bytes << ',' << s.transient_peak_bytes << ',' << s.heap_bytes
         << ',' << s.largest_free_bytes << ',' << s.free_list_length << ',' << s.allocations
         << '\n';
  }
  if (!file.flush()) throw std::runtime_error(path + ": cannot be written");
}

int run(const Arguments& arguments) {
  const orrery::ByteBuffer trace = read(arguments.trace);
  std::printf("%-10s %12s %12s %12s %8s %12s %9s %14s\n", "policy", "heap_bytes", "high_water",
              "largest_free", "free", "allocations", "refused", "blocks_looked_at");
  bool refused = false;
  for (const NamedPolicy& named : arguments.policies) {
    HeapOptions options = arguments.options;
    options.rules.policy = named.policy;
    const orrery::HeapReplay replayed = orrery::replay(trace, options);
    const orrery::HeapFigures& f = replayed.figures;
    std::printf("%-10s %12" PRIu64 " %12" PRIu64 " %12" PRIu64 " %8" PRIu64 " %12" PRIu64
                " %9" PRIu64 " %14" PRIu64 "\n",
                named.name, f.heap_bytes, f.high_water_bytes, f.largest_free_bytes,
                f.free_list_length, f.allocations, replayed.refused, f.search_steps);
    refused = refused || replayed.refused != 0;
    if (!arguments.history.empty()) write_history(arguments.history, replayed.history);
  }
  return refused ? 1 : 0;
}

}  // namespace

int main(int argc, char** argv) {
  const std::string_view first = argc > 1 ? argv[1] : "";
  if (first == "--help" || first == "-h") {
    std::fputs(kUsage, stdout);
    return 0;
  }
  try {
    return run(parse(argc, argv));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "orrery-heap-replay: %s\n\n%s", error.what(), argc > 1 ? "" : kUsage);
    return 2;
  }
}
