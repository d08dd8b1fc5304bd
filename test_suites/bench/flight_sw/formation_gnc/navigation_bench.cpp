// What navigation costs: the four functions of the paper's Table 5, each alone, and a whole epoch,
// with twelve satellites in view of both receivers.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <memory>
#include <vector>

#include "../../../unit/flight_sw/formation_gnc/navigation_scene.hpp"
#include "formation_gnc/navigation/navigation.hpp"

namespace orrery {
namespace {

using formation_gnc::FormationFilter;
using formation_gnc::Navigation;
using formation_gnc::Who;

/// Half an hour of the reference mission as both receivers saw it.
struct Recording {
  std::vector<NavigationScene::Epoch> epochs;
  formation_gnc::EphemerisStore ephemerides;

  Recording() {
    NavigationScene scene;
    for (int k = 0; k < 180; ++k) {
      epochs.push_back(scene.next());
      for (const auto& e : epochs.back().ephemerides[0]) ephemerides.add(e);
    }
  }
};

const Recording& recording() {
  static const Recording r;
  return r;
}

void feed(Navigation* navigation, const NavigationScene::Epoch& e) {
  for (const auto& ephemeris : e.ephemerides[0]) navigation->ephemeris(ephemeris);
  navigation->own_epoch(*e.measured[0], e.q_BI[0]);
  navigation->remote_epoch(*e.measured[1], e.q_BI[1]);
}

/// The filter at an epoch with twelve satellites in both receivers, some time after the start.
struct Instant {
  const NavigationScene::Epoch* epoch = nullptr;
  std::unique_ptr<FormationFilter> filter;
  formation_gnc::SatelliteTable satellites;

  explicit Instant(int least_epochs, bool integers = true) {
    formation_gnc::NavigationOptions options;
    options.filter.integers.enabled = integers;
    const auto navigation = std::make_unique<Navigation>(options);
    int k = 0;
    for (; k < least_epochs || recording().epochs[k].measured[0]->count < 12 ||
           recording().epochs[k].measured[1]->count < 12;
         ++k) {
      feed(navigation.get(), recording().epochs[k]);
    }
    epoch = &recording().epochs[k];
    filter = std::make_unique<FormationFilter>(navigation->filter());
    filter->time_update(epoch->t_ns, {});
    formation_gnc::EarthAttitude earth;
    for (const auto& measured : epoch->measured) {
      satellites.prepare(*measured, recording().ephemerides, {}, &earth);
    }
  }
};

/// Runs `call`, keeping the longest; its mean is the benchmark's own.
class Longest {
 public:
  explicit Longest(benchmark::State& state) : state_(state) {}
  ~Longest() { state_.counters["max_us"] = longest_us_; }
  template <class Call>
  void time(const Call& call) {
    const auto begin = std::chrono::steady_clock::now();
    call();
    const std::chrono::duration<double, std::micro> took = std::chrono::steady_clock::now() - begin;
    longest_us_ = std::max(longest_us_, took.count());
  }

 private:
  benchmark::State& state_;
  double longest_us_ = 0;
};

void BM_Navigation_TimeUpdate(benchmark::State& state) {
  Instant at(90);
  Longest longest(state);
  std::int64_t t_ns = at.filter->t_ns();
  for (auto _ : state) {
    t_ns += 10'000'000'000;
    longest.time([&] { at.filter->time_update(t_ns, {}); });
  }
}
BENCHMARK(BM_Navigation_TimeUpdate);

void BM_Navigation_GraphicUpdate(benchmark::State& state) {
  Instant at(90);
  Longest longest(state);
  for (auto _ : state) {
    longest.time([&] {
      at.filter->graphic_update(Who::kSelf, *at.epoch->measured[0], at.epoch->q_BI[0],
                                at.satellites);
    });
  }
}
BENCHMARK(BM_Navigation_GraphicUpdate);

void BM_Navigation_SdcpUpdate(benchmark::State& state) {
  Instant at(90);
  at.filter->graphic_update(Who::kSelf, *at.epoch->measured[0], at.epoch->q_BI[0], at.satellites);
  at.filter->graphic_update(Who::kOther, *at.epoch->measured[1], at.epoch->q_BI[1], at.satellites);
  Longest longest(state);
  for (auto _ : state) {
    longest.time([&] {
      at.filter->sdcp_update(*at.epoch->measured[0], at.epoch->q_BI[0], *at.epoch->measured[1],
                             at.epoch->q_BI[1], at.satellites);
    });
  }
}
BENCHMARK(BM_Navigation_SdcpUpdate);

// An attempt with all eleven double differences still float.
void BM_Navigation_IntegerResolution(benchmark::State& state) {
  Instant at(90, false);
  FormationFilter& filter = *at.filter;
  filter.graphic_update(Who::kSelf, *at.epoch->measured[0], at.epoch->q_BI[0], at.satellites);
  filter.graphic_update(Who::kOther, *at.epoch->measured[1], at.epoch->q_BI[1], at.satellites);
  filter.sdcp_update(*at.epoch->measured[0], at.epoch->q_BI[0], *at.epoch->measured[1],
                     at.epoch->q_BI[1], at.satellites);
  formation_gnc::IntegerOptions integers;
  integers.repetitions = 1 << 20;  // never held: every attempt is a whole one
  filter.set_integer_options(integers);
  Longest longest(state);
  int candidates = 0;
  for (auto _ : state) longest.time([&] { candidates = filter.resolve_ambiguities().candidates; });
  state.counters["differences"] = candidates;
}
BENCHMARK(BM_Navigation_IntegerResolution);

// Time update, GRAPHIC of both, SDCP, integers, snapshots: epoch after epoch as they come.
void BM_Navigation_Epoch(benchmark::State& state) {
  auto navigation = std::make_unique<Navigation>();
  std::size_t k = 0;
  recording();
  for (auto _ : state) {
    if (k == recording().epochs.size()) {
      state.PauseTiming();
      navigation = std::make_unique<Navigation>();
      k = 0;
      state.ResumeTiming();
    }
    feed(navigation.get(), recording().epochs[k++]);
  }
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(BM_Navigation_Epoch)->MinTime(0.2);

void BM_Navigation_Estimate(benchmark::State& state) {
  const auto navigation = std::make_unique<Navigation>();
  for (int k = 0; k < 90; ++k) feed(navigation.get(), recording().epochs[k]);
  const std::int64_t t_ns = navigation->filter().t_ns() + 5'000'000'000;
  for (auto _ : state) benchmark::DoNotOptimize(navigation->at(t_ns).valid);
}
BENCHMARK(BM_Navigation_Estimate);

}  // namespace
}  // namespace orrery
