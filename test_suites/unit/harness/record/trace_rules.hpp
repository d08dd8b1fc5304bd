/// Rules of the Chrome trace-event format, as Perfetto reads it: what a trace.json must keep.
#pragma once

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <iterator>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace orrery {

/// Reads a trace event by event and gathers what breaks a rule.
class TraceRules {
 public:
  void read(const nlohmann::json& event) {
    const std::string phase = event.value("ph", "");
    if (phase == "M") return name(event);
    track_ = {event.value("pid", 0), event.value("tid", 0)};
    require(processes_.count(track_.first) == 1 && threads_.count(track_) == 1,
            "a track without a name", event);
    if (!event.contains("ts") || !event["ts"].is_number()) return require(false, "no time", event);
    // In ns; exact, as microseconds with three decimals up to 2^53 ns are told apart by a double.
    const auto ts = static_cast<long long>(event["ts"].get<double>() * 1000 + 0.5);
    require(ts >= last_, "time goes back", event);
    last_ = ts;
    auto& open = open_[track_];
    while (!open.empty() && open.back().end >= 0 && open.back().end <= ts) open.pop_back();
    if (phase == "B") {
      open.push_back({-1, event.value("cat", ""), ts});
    } else if (phase == "E") {
      end(open, ts, event);
    } else if (phase == "X") {
      complete(open, ts, event);
    } else if (phase == "s" || phase == "f") {
      flow(open, phase == "s", event);
    } else if (phase == "C") {
      counter(event);
    } else {
      require(phase == "i" && event.value("s", "") == "t", "another phase", event);
    }
    require(!event.value("name", "").empty(), "no name", event);
  }

  std::vector<std::string> finish() {
    for (const auto& [track, open] : open_) {
      for (const Open& one : open) {
        if (one.end < 0)
          problems_.push_back("a slice without end on " + std::to_string(track.second));
      }
    }
    for (const auto& id : flows_) problems_.push_back("flow " + id + " has no end");
    return problems_;
  }

 private:
  using Track = std::pair<int, int>;
  struct Open {
    long long end;  // -1: a B
    std::string category = {};
    long long begin = 0;  // of a B
  };

  void require(bool ok, const char* what, const nlohmann::json& event) {
    if (!ok) problems_.push_back(std::string(what) + ": " + event.dump());
  }
  void name(const nlohmann::json& event) {
    const std::string what = event.value("name", "");
    const int pid = event.value("pid", 0);
    require(!event.at("args").at("name").get<std::string>().empty(), "an empty name", event);
    if (what == "process_name") {
      require(processes_.insert(pid).second, "named twice", event);
    } else {
      require(what == "thread_name" && threads_.insert({pid, event.value("tid", 0)}).second,
              "named twice", event);
    }
  }
  void end(std::vector<Open>& open, long long ts, const nlohmann::json& event) {
    const auto begun =
        std::find_if(open.rbegin(), open.rend(), [](const Open& one) { return one.end < 0; });
    require(begun == open.rbegin() && begun != open.rend(), "an end out of turn", event);
    // Perfetto puts ends before beginnings of the same instant: this one would never end.
    require(begun == open.rend() || begun->begin < ts, "an end at the instant of its begin", event);
    if (begun != open.rend()) open.erase(std::next(begun).base());
  }
  void complete(std::vector<Open>& open, long long ts, const nlohmann::json& event) {
    require(event.contains("dur") && event["dur"].get<double>() >= 0, "no duration", event);
    const auto end = ts + static_cast<long long>(event.value("dur", 0.0) * 1000 + 0.5);
    require(open.empty() || open.back().end < 0 || end <= open.back().end, "partial overlap",
            event);
    open.push_back({end, event.value("cat", "")});
  }
  void flow(const std::vector<Open>& open, bool begins, const nlohmann::json& event) {
    require(!open.empty(), "a flow outside of a slice", event);
    // Perfetto takes the slice around it; Chrome's DevTools one of the same category alone.
    require(open.empty() || open.back().category == event.value("cat", ""),
            "a flow of another category than its slice", event);
    const std::string id = event.value("cat", "") + "/" + event.at("id").dump();
    if (begins) {
      require(used_.insert(id).second, "a flow id used twice", event);
      flows_.insert(id);
    } else {
      require(event.value("bp", "") == "e", "not bound to its slice", event);
      require(flows_.erase(id) == 1, "a flow that ends before it begins", event);
    }
  }
  void counter(const nlohmann::json& event) {
    require(event.contains("args") && !event["args"].empty(), "a counter without value", event);
    for (const auto& value : event["args"]) require(value.is_number(), "no number", event);
  }

  Track track_;
  long long last_ = 0;
  std::set<int> processes_;
  std::set<Track> threads_;
  std::map<Track, std::vector<Open>> open_;
  std::set<std::string> flows_, used_;
  std::vector<std::string> problems_;
};

inline std::vector<std::string> trace_problems(const nlohmann::json& trace) {
  TraceRules rules;
  for (const auto& event : trace.at("traceEvents")) rules.read(event);
  return rules.finish();
}

inline void expect_trace_rules(const nlohmann::json& trace) {
  const auto problems = trace_problems(trace);
  for (std::size_t i = 0; i < std::min<std::size_t>(problems.size(), 5); ++i)
    ADD_FAILURE() << problems[i];
  EXPECT_EQ(problems.size(), 0u);
}

}  // namespace orrery
