// What an epoch of GNSS costs: constellation, signal path, noise, solution, logs as bytes.
#include <orrery/models/gnss/receiver.hpp>

#include <benchmark/benchmark.h>

#include <cmath>
#include <memory>
#include <vector>

namespace orrery {
namespace {

const SimTime kEpoch = gps_midnight(2025, 3, 20);

/// A circular orbit of 550 km over an Earth that does not turn, pointing to the zenith: costs next
/// to nothing itself.
class BenchContext final : public DeviceContext {
 public:
  explicit BenchContext(std::uint64_t seed) : streams_(seed) {}

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
  void log(int, std::string_view) override {}
  double fault(std::string_view, double nominal) const override { return nominal; }

 private:
  SimTime now_ = kEpoch;
  OrbitState state_;
  Mat3 R_BI_;
  RandomStreams streams_;
  Action every_;
  std::size_t bytes_ = 0;
};

GnssReceiverOptions ranging(Duration period) {
  using novatel::LogTrigger;
  GnssReceiverOptions options;
  options.period = period;
  options.logs = {{novatel::kRangeId, LogTrigger::kOnTime, period},
                  {novatel::kBestXyzId, LogTrigger::kOnTime, period},
                  {novatel::kRawEphemId, LogTrigger::kOnChanged}};
  return options;
}

/// @param receivers  that share one constellation and measure at the same instants
void BM_GnssReceiver_Epoch(benchmark::State& state) {
  const auto receivers = static_cast<std::size_t>(state.range(0));
  const Duration period = state.range(1) * 1s;
  RandomStreams streams(1);
  const auto gps = std::make_shared<GpsConstellation>(GpsConstellationOptions{}, kEpoch, streams);
  std::vector<std::unique_ptr<BenchContext>> contexts;
  std::vector<std::unique_ptr<GnssReceiver>> devices;
  for (std::size_t i = 0; i < receivers; ++i) {
    contexts.push_back(std::make_unique<BenchContext>(i + 1));
    devices.push_back(std::make_unique<GnssReceiver>(ranging(period), gps));
    devices.back()->start(*contexts.back());
  }
  SimTime t = kEpoch;
  double tracked = 0;
  for (auto _ : state) {
    t += period;
    for (std::size_t i = 0; i < receivers; ++i) {
      contexts[i]->set(t);
      contexts[i]->epoch();
    }
    tracked += static_cast<double>(devices[0]->tracker()->channels().size());
  }
  state.SetItemsProcessed(state.iterations());
  state.counters["tracked"] = tracked / static_cast<double>(state.iterations());
  state.counters["bytes"] =
      static_cast<double>(contexts[0]->bytes()) / static_cast<double>(state.iterations());
}
BENCHMARK(BM_GnssReceiver_Epoch)
    ->ArgNames({"receivers", "period_s"})
    ->ArgsProduct({{1, 2}, {1, 10, 30}});

void BM_GpsConstellation_At(benchmark::State& state) {
  RandomStreams streams(1);
  GpsConstellation gps({}, kEpoch, streams);
  SimTime t = kEpoch;
  for (auto _ : state) benchmark::DoNotOptimize(gps.at(t += state.range(0) * 1s).transmitting);
}
BENCHMARK(BM_GpsConstellation_At)->ArgName("period_s")->Arg(1)->Arg(10)->Arg(30);

}  // namespace
}  // namespace orrery
