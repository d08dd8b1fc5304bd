// What navigation costs: the four functions of the paper's Table 5, each alone, and a whole epoch,
// with twelve satellites in view of both receivers.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <memory>
#include <time.h>
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
  std::unique_ptr<FormationFilter> before, filter;  // behind the epoch before; at this one
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
    before = std::make_unique<FormationFilter>(navigation->filter());
    filter = std::make_unique<FormationFilter>(*before);
    filter->time_update(epoch->t_ns, {});
    formation_gnc::EarthAttitude earth;
    for (const auto& measured : epoch->measured) {
      satellites.prepare(*measured, recording().ephemerides, {}, &earth);
    }
  }

  void graphic(Who who) {
    const int k = static_cast<int>(who);
    filter->graphic_update(who, *epoch->measured[k], epoch->q_BI[k], satellites);
  }
  formation_gnc::UpdateReport sdcp() {
    return filter->sdcp_update(*epoch->measured[0], epoch->q_BI[0], *epoch->measured[1],
                               epoch->q_BI[1], satellites);
  }
};

double thread_cpu_us() {
  timespec t;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return 1e6 * static_cast<double>(t.tv_sec) + 1e-3 * static_cast<double>(t.tv_nsec);
}

/// The mean is the benchmark's own; 2000 more calls, each timed by itself, give the longest (CPU
/// time, so that of the call and of interrupts on its account).
template <class Call>
void run(benchmark::State& state, const Call& call) {
  for (auto _ : state) call();
  double longest_us = 0;
  for (int k = 0; k < 2000; ++k) {
    const double begin_us = thread_cpu_us();
    call();
    longest_us = std::max(longest_us, thread_cpu_us() - begin_us);
  }
  state.counters["max_us"] = longest_us;
}

void BM_Navigation_TimeUpdate(benchmark::State& state) {
  Instant at(90);
  std::int64_t t_ns = at.filter->t_ns();
  run(state, [&] { at.filter->time_update(t_ns += 10'000'000'000, {}); });
}
BENCHMARK(BM_Navigation_TimeUpdate);

void BM_Navigation_GraphicUpdate(benchmark::State& state) {
  Instant at(90);
  const FormationFilter begin = *at.filter;
  run(state, [&] {
    *at.filter =
        begin;  // 10 kB in 0.3 us, here and below: the same data twice is not the same work
    at.graphic(Who::kSelf);
  });
}
BENCHMARK(BM_Navigation_GraphicUpdate);

void BM_Navigation_SdcpUpdate(benchmark::State& state) {
  Instant at(90);
  at.graphic(Who::kSelf);
  at.graphic(Who::kOther);
  const FormationFilter begin = *at.filter;
  run(state, [&] {
    *at.filter = begin;
    at.sdcp();
  });
}
BENCHMARK(BM_Navigation_SdcpUpdate);

// An attempt with all eleven double differences still float.
void BM_Navigation_IntegerResolution(benchmark::State& state) {
  Instant at(90, false);
  at.graphic(Who::kSelf);
  at.graphic(Who::kOther);
  at.sdcp();
  formation_gnc::IntegerOptions integers;
  integers.repetitions = 1 << 20;  // never held: every attempt is a whole one
  at.filter->set_integer_options(integers);
  int differences = 0;
  run(state, [&] { differences = at.filter->resolve_ambiguities().candidates; });
  state.counters["differences"] = differences;
}
BENCHMARK(BM_Navigation_IntegerResolution);

// The four together with twelve satellites: one filter epoch.
void BM_Navigation_FilterEpoch(benchmark::State& state) {
  Instant at(90);
  formation_gnc::UpdateReport sdcp;
  run(state, [&] {
    *at.filter = *at.before;
    at.filter->time_update(at.epoch->t_ns, {});
    at.graphic(Who::kSelf);
    at.graphic(Who::kOther);
    sdcp = at.sdcp();
  });
  state.counters["used"] = sdcp.used;
}
BENCHMARK(BM_Navigation_FilterEpoch);

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

void BM_Navigation_State(benchmark::State& state) {
  const auto navigation = std::make_unique<Navigation>();
  for (int k = 0; k < 90; ++k) feed(navigation.get(), recording().epochs[k]);
  const std::int64_t t_ns = navigation->filter().t_ns() + 5'000'000'000;
  for (auto _ : state) benchmark::DoNotOptimize(navigation->state_at(t_ns).valid);
}
BENCHMARK(BM_Navigation_State);

}  // namespace
}  // namespace orrery
