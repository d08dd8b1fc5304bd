// What an epoch of GNSS costs: constellation, signal path, noise, solution, logs as bytes.
#include <orrery/models/gnss/receiver.hpp>

#include <benchmark/benchmark.h>

#include <memory>
#include <vector>

#include "../../../unit/models/support/orbiting_device_context.hpp"

namespace orrery {
namespace {

const SimTime kEpoch = OrbitingDeviceContext::kEpoch;

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
  std::vector<std::unique_ptr<OrbitingDeviceContext>> contexts;
  std::vector<std::unique_ptr<GnssReceiver>> devices;
  for (std::size_t i = 0; i < receivers; ++i) {
    contexts.push_back(std::make_unique<OrbitingDeviceContext>(i + 1));
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
