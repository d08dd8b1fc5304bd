/// A DeviceContext for unit tests of devices: a clock, timers, and a notebook of what the device
/// did. No world, no event loop, no flight software.
#pragma once

#include <orrery/harness/kernel/random.hpp>
#include <orrery/models/device/device.hpp>

#include <algorithm>
#include <functional>
#include <map>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace orrery {

class FakeDeviceContext final : public DeviceContext {
 public:
  struct ToFlight {
    SimTime t;
    ByteBuffer bytes;
  };
  struct Transmission {
    SimTime t;
    std::string to;
    ByteBuffer frame;
  };
  struct Impulse {
    SimTime t;
    Vec3 dv_ECI;
  };
  struct ThrustEdge {
    SimTime t;
    Thrust thrust;
  };
  struct Sample {
    SimTime t;
    std::string channel;
    double value;
  };
  struct Text {  // a state or an event
    SimTime t;
    std::string channel, text;
  };
  struct LogLine {
    int level;
    std::string text;
  };

  explicit FakeDeviceContext(SimTime start = from_ns(0), std::uint64_t seed = 1)
      : now_(start), streams_(seed) {}

  // What the device sees: set by the test at any time.
  std::function<OrbitState(SimTime)> truth_at = [](SimTime t) { return OrbitState{.t = t}; };
  std::function<Surroundings(SimTime)> surroundings_at = [](SimTime) { return Surroundings{}; };
  Mat3 attitude;
  Vec3 body_rate_B;
  Duration clock_offset{};  // onboard minus truth
  std::map<std::string, SpacecraftState, std::less<>> others;
  std::map<std::string, double, std::less<>> faults;

  // What the device did.
  std::vector<ToFlight> to_flight_log;
  std::vector<Transmission> transmissions;
  std::vector<Impulse> impulses;
  std::vector<ThrustEdge> thrusts;
  std::vector<Sample> samples;
  std::vector<Text> texts;
  std::vector<LogLine> log_lines;
  std::map<std::string, ByteBuffer, std::less<>> files;
  std::vector<Text> pictures;  // their captions

  /// Runs timers up to and including `t`, in order of time, then of setting.
  void run_until(SimTime t) {
    while (!timers_.empty()) {
      const auto next =
          std::min_element(timers_.begin(), timers_.end(), [](const Timer& a, const Timer& b) {
            return std::pair(a.t, a.order) < std::pair(b.t, b.order);
          });
      if (next->t > t) break;
      Timer timer = std::move(*next);
      timers_.erase(next);
      now_ = timer.t;
      fire(std::move(timer));
    }
    now_ = t;
  }
  void run_for(Duration d) { run_until(now_ + d); }

  std::string_view spacecraft() const override { return "chief"; }
  SimTime now() const override { return now_; }
  std::int64_t onboard_ns() const override { return to_ns(now_ + clock_offset); }
  SimTime truth_of_onboard(std::int64_t onboard_ns) const override {
    return from_ns(onboard_ns) - clock_offset;
  }
  OrbitState truth() const override { return truth_at(now_); }
  Surroundings surroundings() const override { return surroundings_at(now_); }
  Mat3 R_BI() const override { return attitude; }
  Vec3 omega_BI_B() const override { return body_rate_B; }
  SpacecraftState other(std::string_view spacecraft) const override {
    const auto at = others.find(spacecraft);
    return at == others.end() ? DeviceContext::other(spacecraft) : at->second;
  }
  bool keeps_files() const override { return true; }
  void record_file(std::string_view name, Bytes content) override {
    files[std::string(name)] = ByteBuffer(content.begin(), content.end());
  }
  void record_picture(std::string_view caption, Bytes) override {
    pictures.push_back({now_, "picture", std::string(caption)});
  }
  RandomStream& random(std::string_view purpose) override {
    return streams_.stream("chief", "device", purpose);
  }

  EventHandle after(Duration delay, Action action) override {
    if (delay < 0ns) throw std::invalid_argument("FakeDeviceContext::after: negative delay");
    return add({.t = now_ + delay, .action = std::move(action)});
  }
  EventHandle every(Duration period, Action action) override {
    if (period <= 0ns) throw std::invalid_argument("FakeDeviceContext::every: period <= 0");
    return add({.t = now_, .period = period, .action = std::move(action)});
  }
  bool cancel(EventHandle handle) override {
    const auto named = [&](const Timer& timer) { return timer.handle == handle; };
    const auto at = std::find_if(timers_.begin(), timers_.end(), named);
    if (at == timers_.end()) return false;
    timers_.erase(at);
    return true;
  }

  void to_flight(Bytes bytes) override {
    to_flight_log.push_back({now_, ByteBuffer(bytes.begin(), bytes.end())});
  }
  void transmit(std::string_view to, Bytes frame) override {
    transmissions.push_back({now_, std::string(to), ByteBuffer(frame.begin(), frame.end())});
  }
  void apply_impulse(const Vec3& dv_ECI) override { impulses.push_back({now_, dv_ECI}); }
  void set_thrust(const Thrust& thrust) override { thrusts.push_back({now_, thrust}); }
  void record(std::string_view channel, const Vec3& value) override {
    samples.push_back({now_, std::string(channel), norm(value)});
  }
  void record_state(std::string_view channel, std::string_view state) override {
    texts.push_back({now_, std::string(channel), std::string(state)});
  }
  void record_event(std::string_view channel, std::string_view what) override {
    texts.push_back({now_, std::string(channel), std::string(what)});
  }
  void declare_event(std::string_view) override {}
  void record(std::string_view channel, double value) override {
    samples.push_back({now_, std::string(channel), value});
  }
  void log(int level, std::string_view line) override {
    log_lines.push_back({level, std::string(line)});
  }
  double fault(std::string_view name, double nominal) const override {
    const auto at = faults.find(name);
    return at == faults.end() ? nominal : at->second;
  }

 private:
  struct Timer {
    SimTime t;
    Duration period{};  // 0: once
    Action action;
    EventHandle handle{};
    std::uint64_t order = 0;
  };

  EventHandle add(Timer timer) {
    timer.order = ++timers_set_;
    if (timer.handle == EventHandle{}) {
      timer.handle = {.slot = static_cast<std::uint32_t>(timers_set_), .generation = 1};
    }
    timers_.push_back(std::move(timer));
    return timers_.back().handle;
  }

  // A repeating timer is set again after its action, which may set others but not cancel itself.
  void fire(Timer timer) {
    timer.action();
    if (timer.period == 0ns) return;
    timer.t += timer.period;
    add(std::move(timer));
  }

  SimTime now_;
  RandomStreams streams_;
  std::vector<Timer> timers_;
  std::uint64_t timers_set_ = 0;
};

}  // namespace orrery
