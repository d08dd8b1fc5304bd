#include <orrery/models/camera/detector.hpp>
#include <orrery/models/camera/scene.hpp>
#include <orrery/models/camera/star_field.hpp>

#include <benchmark/benchmark.h>

#include <numeric>

namespace orrery {
namespace {

// As many stars as the sky has to V 6.5, anywhere.
StarCatalogue made_up_stars() {
  RandomStream stream(3);
  std::vector<Star> stars;
  for (int k = 0; k < 9000; ++k) {
    const double z = stream.uniform(-1, 1);
    const double a = stream.uniform(0, 6.283185307179586);
    const double r = std::sqrt(1 - z * z);
    stars.push_back({.number = k + 1,
                     .direction_ECI = {r * std::cos(a), r * std::sin(a), z},
                     .magnitude = 6.5 + 2.0 * std::log10(stream.uniform())});
  }
  return StarCatalogue(std::move(stars));
}

// 15 deg across.
PinholeOptions star_tracker(int size) {
  const double f = 0.5 * size / std::tan(7.5 * 3.14159265358979323846 / 180);
  return {.width_px = size, .height_px = size, .fx_px = f, .fy_px = f};
}

void BM_StarField(benchmark::State& state) {
  const StarField sky(made_up_stars());
  const int size = static_cast<int>(state.range(0));
  const PinholeCamera camera(star_tracker(size));
  const Optics optics;
  CameraPose pose{.t = gps_midnight(2025, 3, 20)};
  std::size_t stars = 0;
  for (auto _ : state) {
    pose.R_CI = rotation_by({0.1, 0.001 * double(stars % 1000), 0.2});
    ElectronImage image(size, size);
    stars += sky.draw(image, camera, optics, pose, {}).size();
    benchmark::DoNotOptimize(image.values.data());
  }
  state.SetItemsProcessed(state.iterations());
  state.counters["stars"] = double(stars) / double(state.iterations());
}
BENCHMARK(BM_StarField)->Arg(512)->Arg(1024)->Unit(benchmark::kMillisecond);

// 1024 x 1024: stars, the Earth over half the image, and a target of 9800 triangles `range(0)` px
// across. Items are frames of floats, on `range(1)` threads.
void BM_Scene(benchmark::State& state) {
  const PinholeCamera camera(star_tracker(1024));
  Scene scene(camera, {}, {.stars = made_up_stars(), .targets = {Mesh::sphere(0.5, 50)}});
  SceneState now;
  now.r_sun_ECI = {1.1e11, 1e11, 2e10};
  now.r_moon_ECI = {-3.8e8, 0, 0};
  const Vec3 z{-0.39, 0, 0.92};  // to the limb at 550 km
  const Vec3 x = unit(cross(Vec3{0, 1, 0}, z));
  now.camera = {.t = gps_midnight(2025, 3, 20), .r_ECI = {6928e3, 0, 0}, .v_ECI = {0, 7585, 0}};
  now.camera.R_CI = {x, cross(unit(z), x), unit(z)};
  const double d = camera.fx_px() / double(state.range(0));
  now.targets = {{.r_ECI = now.camera.r_ECI + d * unit(z), .v_ECI = now.camera.v_ECI}};
  const int threads = static_cast<int>(state.range(1));
  scene.render(now, {}, threads);  // the first computes the rays of all pixels
  for (auto _ : state) benchmark::DoNotOptimize(scene.render(now, {}, threads).light.values.data());
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(BM_Scene)
    ->Args({100, 1})
    ->Args({100, 2})
    ->Args({300, 2})
    ->Unit(benchmark::kMillisecond)
    ->MeasureProcessCPUTime();

void BM_DetectorRead(benchmark::State& state) {
  const int size = static_cast<int>(state.range(0));
  RandomStream pattern(1);
  const Detector detector({}, size, size, pattern);
  const ElectronImage light(size, size, 5);
  std::uint64_t frame = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(detector.read(light, 0.1, ++frame, static_cast<int>(state.range(1))));
  }
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(BM_DetectorRead)
    ->Args({512, 1})
    ->Args({512, 2})
    ->Args({1024, 2})
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace orrery
