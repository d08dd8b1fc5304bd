#include <orrery/models/atmosphere/nrlmsise00.hpp>
#include <orrery/models/atmosphere/nrlmsise00_atmosphere.hpp>

#include <benchmark/benchmark.h>

#include <cmath>

namespace orrery {
namespace {

Nrlmsise00Input input_at(double altitude_km) {
  return {.day_of_year = 172,
          .ut_s = 29000,
          .altitude_km = altitude_km,
          .latitude_deg = 60,
          .longitude_deg = -70,
          .local_solar_time_h = 16,
          .f107a_sfu = 150,
          .f107_sfu = 150,
          .ap_daily = 15};
}

// Arguments vary from call to call, as along an orbit.
void evaluate(benchmark::State& state, Nrlmsise00Input input) {
  for (auto _ : state) {
    input.latitude_deg = input.latitude_deg > 80 ? -80 : input.latitude_deg + 0.1;
    input.longitude_deg = input.longitude_deg > 179 ? -179 : input.longitude_deg + 0.1;
    benchmark::DoNotOptimize(evaluate_nrlmsise00(input));
  }
}

void BM_Nrlmsise00_DailyAp(benchmark::State& state) {
  evaluate(state, input_at(static_cast<double>(state.range(0))));
}
BENCHMARK(BM_Nrlmsise00_DailyAp)->Arg(50)->Arg(100)->Arg(250)->Arg(400)->Arg(550)->Arg(800);

void BM_Nrlmsise00_ApHistory(benchmark::State& state) {
  Nrlmsise00Input input = input_at(static_cast<double>(state.range(0)));
  input.ap_history = {15, 15, 12, 9, 7, 20, 30};
  evaluate(state, input);
}
BENCHMARK(BM_Nrlmsise00_ApHistory)->Arg(400)->Arg(550);

// What a drag force pays: leap seconds, geodetic place, space weather and the model.
void BM_Nrlmsise00Atmosphere_Density(benchmark::State& state) {
  const Nrlmsise00Atmosphere atmosphere({.weather = SpaceWeather::monthly()});
  const SimTime epoch = gps_midnight(2024, 6, 20);
  Duration since{};
  for (auto _ : state) {
    since = since > 24h ? Duration{} : since + 10s;
    const double angle_rad = 1.1e-3 * to_seconds(since);
    const double sine = std::sin(angle_rad);
    const Vec3 r_ECEF{6.92e6 * std::cos(angle_rad), 6.92e6 * 0.1 * sine, 6.92e6 * 0.99 * sine};
    benchmark::DoNotOptimize(atmosphere.density_kgpm3(epoch + since, r_ECEF));
  }
}
BENCHMARK(BM_Nrlmsise00Atmosphere_Density);

}  // namespace
}  // namespace orrery
