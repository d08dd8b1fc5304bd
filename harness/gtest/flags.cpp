#include <orrery/harness/gtest/flags.hpp>
#include <orrery/harness/gtest/host_conditions.hpp>
#include <orrery/harness/gtest/listener.hpp>
#include <orrery/harness/gtest/run_record.hpp>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <map>
#include <stdexcept>
#include <string_view>
#include <unistd.h>

namespace orrery {
namespace {

constexpr std::uint64_t kSeedEnd = std::uint64_t{1} << 53;  // exact in a double, so in JSON
constexpr std::string_view kPrefix = "--orrery_";

[[noreturn]] void refuse(const std::string& name, std::string_view value,
                         const std::string& accepted) {
  throw std::invalid_argument("--orrery_" + name + "=" + std::string(value) + ": expected " +
                              accepted);
}

std::uint64_t parse_integer(const std::string& name, std::string_view text, std::uint64_t low,
                            std::uint64_t high) {
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || value < low || value > high) {
    refuse(name, text, "an integer from " + std::to_string(low) + " to " + std::to_string(high));
  }
  return value;
}

/// "1s", "500ms", or seconds as a plain number.
Duration parse_span(const std::string& name, std::string_view text) {
  double scale = 1.0;
  std::string_view number = text;
  if (number.ends_with("ms")) {
    scale = 1e-3;
    number.remove_suffix(2);
  } else if (number.ends_with("s")) {
    number.remove_suffix(1);
  }
  double value = 0;
  const auto [end, error] = std::from_chars(number.data(), number.data() + number.size(), value);
  if (error != std::errc() || end != number.data() + number.size() || !(value >= 0) ||
      value > 9e9) {
    refuse(name, text, "a time from 0 to 9e9 s, as in 90, 1.5s or 500ms");
  }
  return from_seconds(value * scale);
}

RecordSetting parse_record(std::string_view text) {
  if (text == "off") return {RecordSetting::Mode::kOff, {}};
  if (text == "events") return {RecordSetting::Mode::kEvents, {}};
  const Duration period = parse_span("record", text);
  if (period <= Duration::zero()) refuse("record", text, "off, events or a period above 0");
  return {RecordSetting::Mode::kPeriodic, period};
}

LogSetting parse_log(std::string_view text) {
  const std::size_t comma = text.find(',');
  const std::string_view level = text.substr(0, comma);
  constexpr std::string_view kLevels[] = {"debug", "info", "warning", "error", "off"};
  for (int i = 0; i < 5; ++i) {
    if (level != kLevels[i]) continue;
    LogSetting setting{.level = i};
    if (comma != std::string_view::npos) setting.spacecraft = text.substr(comma + 1);
    return setting;
  }
  refuse("log", text, "debug, info, warning, error or off, then optionally ,SPACECRAFT");
}

// "dsc=exec:./host lib.so; osc=tcp:10.0.0.5:5000"
void add_targets(Flags& flags, std::string_view text) {
  constexpr std::string_view kSeparator = "; ";
  while (!text.empty()) {
    const std::string_view one = text.substr(0, text.find(kSeparator));
    const std::size_t equals = one.find('=');
    if (equals == 0 || equals == std::string_view::npos) {
      refuse("target", one, "SPACECRAFT=HOW, as in dsc=tcp:10.0.0.5:5000");
    }
    try {
      flags.targets.push_back(
          {std::string(one.substr(0, equals)), parse_target_address(one.substr(equals + 1))});
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument("--orrery_target=" + std::string(one) + ": " + error.what());
    }
    text.remove_prefix(std::min(text.size(), one.size() + kSeparator.size()));
  }
}

PaceSetting parse_pace(std::string_view text) {
  const std::size_t comma = text.find(',');
  const std::string_view rate = text.substr(0, comma);
  PaceSetting pace;
  const auto [end, error] = std::from_chars(rate.data(), rate.data() + rate.size(), pace.rate);
  if (error != std::errc() || end != rate.data() + rate.size() || !(pace.rate >= 0) ||
      pace.rate > 1e9) {
    refuse("pace", text, "RATE[,DEADLINE], simulated seconds per second from 0 to 1e9");
  }
  if (comma != std::string_view::npos) pace.deadline = parse_span("pace", text.substr(comma + 1));
  return pace;
}

bool parse_switch(const std::string& name, std::string_view text) {
  if (text.empty() || text == "1" || text == "true") return true;
  if (text == "0" || text == "false") return false;
  refuse(name, text, "nothing, 1 or 0");
}

using Setter = std::function<void(Flags&, std::string_view)>;

const std::map<std::string, Setter>& setters() {
  static const std::map<std::string, Setter> kSetters = {
      {"seed",
       [](Flags& f, std::string_view v) { f.seed = parse_integer("seed", v, 0, kSeedEnd - 1); }},
      {"runs",
       [](Flags& f, std::string_view v) {
         f.runs = static_cast<int>(parse_integer("runs", v, 1, 1000000));
       }},
      {"run",
       [](Flags& f, std::string_view v) {
         f.run = static_cast<std::uint32_t>(parse_integer("run", v, 0, 9999999));
       }},
      {"jobs",
       [](Flags& f, std::string_view v) {
         f.jobs = static_cast<int>(parse_integer("jobs", v, 1, 1024));
       }},
      {"set",
       [](Flags& f, std::string_view v) {
         const std::size_t equals = v.rfind('=');
         double value = 0;
         const char* const end = v.data() + v.size();
         const auto parsed = equals == std::string_view::npos
                                 ? std::from_chars_result{v.data(), std::errc::invalid_argument}
                                 : std::from_chars(v.data() + equals + 1, end, value);
         if (parsed.ec != std::errc() || parsed.ptr != end || equals == 0 ||
             !std::isfinite(value)) {
           refuse("set", v, "NAME=NUMBER, as in deputy/mass_kg=11.2");
         }
         f.set[std::string(v.substr(0, equals))] = value;
       }},
      {"campaign",
       [](Flags& f, std::string_view v) {
         if (v.empty()) refuse("campaign", v, "a folder");
         f.campaign = v;
       }},
      {"out",
       [](Flags& f, std::string_view v) {
         if (v.empty()) refuse("out", v, "a folder");
         f.out = v;
       }},
      {"threads",
       [](Flags&, std::string_view v) {
         if (parse_integer("threads", v, 1, 1024) > 1) {
           refuse("threads", v, "1: one run uses one thread in this version");
         }
       }},
      {"break_at", [](Flags& f, std::string_view v) { f.break_at = parse_span("break_at", v); }},
      {"record", [](Flags& f, std::string_view v) { f.record = parse_record(v); }},
      {"log", [](Flags& f, std::string_view v) { f.log = parse_log(v); }},
      {"verify_determinism",
       [](Flags& f, std::string_view v) {
         f.verify_determinism = parse_switch("verify_determinism", v);
       }},
      {"shrink", [](Flags& f, std::string_view v) { f.shrink = parse_switch("shrink", v); }},
      {"shuffle_ties",
       [](Flags& f, std::string_view v) {
         f.shuffle_ties = parse_integer("shuffle_ties", v, 0, kSeedEnd - 1);
       }},
      {"target", add_targets},
      {"pace", [](Flags& f, std::string_view v) { f.pace = parse_pace(v); }},
      {"progress", [](Flags& f, std::string_view v) { f.progress = parse_switch("progress", v); }},
  };
  return kSetters;
}

std::string known_flags() {
  std::string list;
  for (const auto& [name, setter] : setters())
    list += (list.empty() ? "" : ", ") + ("--orrery_" + name);
  return list;
}

std::string upper(std::string text) {
  for (char& c : text) {
    if (c >= 'a' && c <= 'z') c = static_cast<char>(c - 'a' + 'A');
  }
  return text;
}

struct State {
  Flags flags;
  std::string program = "<test program>";
  std::vector<std::string> given = {};
  bool from_command_line = false;
};

std::vector<std::string> environment_strings() {
  std::vector<std::string> all;
  for (char** entry = environ; entry != nullptr && *entry != nullptr; ++entry)
    all.emplace_back(*entry);
  return all;
}

State& state() {
  static State the_state = [] {
    State s;
    try {
      s.flags = parse_flags({}, environment_strings());
    } catch (const std::invalid_argument& error) {
      std::fprintf(stderr, "orrery: %s\n", error.what());
      std::exit(2);
    }
    return s;
  }();
  return the_state;
}

}  // namespace

Flags parse_flags(const std::vector<std::string>& arguments,
                  const std::vector<std::string>& environment) {
  Flags result;
  for (const auto& [name, set] : setters()) {
    const std::string prefix = "ORRERY_" + upper(name) + "=";
    for (const std::string& entry : environment) {
      if (entry.starts_with(prefix)) set(result, std::string_view(entry).substr(prefix.size()));
    }
  }
  for (const std::string& argument : arguments) {
    if (!argument.starts_with(kPrefix)) continue;
    const std::string_view rest = std::string_view(argument).substr(kPrefix.size());
    const std::size_t equals = rest.find('=');
    const auto setter = setters().find(std::string(rest.substr(0, equals)));
    if (setter == setters().end()) {
      throw std::invalid_argument(argument + ": no such flag; known are " + known_flags());
    }
    const bool has_value = equals != std::string_view::npos;
    const bool is_switch = setter->first == "progress" || setter->first == "shrink" ||
                           setter->first == "verify_determinism";
    if (!has_value && !is_switch) {
      throw std::invalid_argument(argument + ": needs a value, as in " + argument + "=VALUE");
    }
    setter->second(result, has_value ? rest.substr(equals + 1) : std::string_view());
  }
  return result;
}

void Init(int* argc, char** argv) {
  internal::fix_host_conditions(argv);
  std::vector<std::string> ours;
  int kept = *argc > 0 ? 1 : 0;
  for (int i = 1; i < *argc; ++i) {
    if (std::string_view(argv[i]).starts_with(kPrefix)) {
      ours.emplace_back(argv[i]);
    } else {
      argv[kept++] = argv[i];
    }
  }
  argv[kept] = nullptr;
  try {
    state().flags = parse_flags(ours, environment_strings());
  } catch (const std::invalid_argument& error) {
    std::fprintf(stderr, "orrery: %s\n", error.what());
    std::exit(2);
  }
  if (*argc > 0) state().program = argv[0];
  state().from_command_line = true;
  state().given = ours;
  internal::adopt_run_record();
  install_listener();
  *argc = kept;
}

const Flags& flags() {
  return state().flags;
}
bool initialised() {
  return state().from_command_line;
}
const std::string& program_name() {
  return state().program;
}
const std::vector<std::string>& given_flags() {
  return state().given;
}

}  // namespace orrery
