/// A device's surroundings for benchmarks.
#pragma once

#include <orrery/harness/kernel/random.hpp>
#include <orrery/models/device/device.hpp>

#include <cmath>
#include <utility>

namespace orrery {

/// A DeviceContext on a circular orbit of 550 km over an Earth that does not turn, pointing to the
/// zenith. Costs next to nothing and allocates nothing itself: for benchmarks and for counting.
class OrbitingDeviceContext final : public DeviceContext {
 public:
  inline static const SimTime kEpoch = gps_midnight(2025, 3, 20);
  explicit OrbitingDeviceContext(std::uint64_t seed) : streams_(seed) {}

  void set(SimTime t) {
    now_ = t;
    const double u = 1.0951e-3 * to_seconds(t - kEpoch), c = std::cos(u), s = std::sin(u);
    state_ = {t, {6928137 * c, 0, 6928137 * s}, {-7585 * s, 0, 7585 * c}, 11};
    R_BI_ = {{-s, 0, c}, {0, -1, 0}, {c, 0, s}};
  }
  void epoch() { every_(); }
  std::size_t bytes() const { return bytes_; }

  std::string_view spacecraft() const override { return "chief"; }
  SimTime now() const override { return now_; }
  std::int64_t onboard_ns() const override { return to_ns(now_); }
  SimTime truth_of_onboard(std::int64_t ns) const override { return from_ns(ns); }
  OrbitState truth() const override { return state_; }
  Surroundings surroundings() const override {
    return {.omega_EI_ECEF = {0, 0, 7.292e-5}, .r_sun_ECI = {1.5e11, 0, 0}};
  }
  Mat3 R_BI() const override { return R_BI_; }
  Vec3 omega_BI_B() const override { return {0, 1.0951e-3, 0}; }
  RandomStream& random(std::string_view purpose) override {
    return streams_.stream("chief", "gnss", purpose);
  }
  EventHandle after(Duration, Action action) override {
    action();
    return {};
  }
  EventHandle every(Duration, Action action) override {
    every_ = std::move(action);
    return {};
  }
  bool cancel(EventHandle) override { return false; }
  void to_flight(Bytes bytes) override { bytes_ += bytes.size(); }
  void transmit(std::string_view, Bytes) override {}
  void apply_impulse(const Vec3&) override {}
  void set_thrust(const Thrust&) override {}
  void record(std::string_view, double) override {}
  void record(std::string_view, const Vec3&) override {}
  void record_state(std::string_view, std::string_view) override {}
  void record_event(std::string_view, std::string_view) override {}
  void declare_event(std::string_view) override {}
  void log(int, std::string_view) override {}
  double fault(std::string_view, double nominal) const override { return nominal; }
  bool may_be_faulty() const override { return false; }

 private:
  SimTime now_ = kEpoch;
  OrbitState state_;
  Mat3 R_BI_;
  RandomStreams streams_;
  Action every_;
  std::size_t bytes_ = 0;
};

}  // namespace orrery
