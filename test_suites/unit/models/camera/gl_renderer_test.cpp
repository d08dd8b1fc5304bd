// OpenGL against the CPU's path, which is checked against closed forms, and OSMesa against EGL.
#include <orrery/harness/kernel/random.hpp>
#include <orrery/models/camera/gl_renderer.hpp>
#include <orrery/models/camera/scene.hpp>
#include <orrery/models/orbit/earth.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <numbers>
#include <numeric>
#include <optional>
#include <string>

namespace orrery {
namespace {

using ::testing::HasSubstr;

// Stars all over the field, as many as the sky has.
StarCatalogue scattered_stars() {
  RandomStream stream(4);
  std::vector<Star> stars;
  for (int k = 0; k < 9000; ++k) {
    const double z = stream.uniform(-1, 1), a = stream.uniform(0, 2 * std::numbers::pi);
    const double r = std::sqrt(1 - z * z);
    stars.push_back({.number = k + 1,
                     .direction_ECI = {r * std::cos(a), r * std::sin(a), z},
                     .magnitude = 6.5 + 2 * std::log10(stream.uniform())});
  }
  return StarCatalogue(std::move(stars));
}

PinholeCamera camera() {
  return PinholeCamera({.width_px = 200,
                        .height_px = 160,
                        .fx_px = 400,
                        .fy_px = 402,
                        .distortion = {.k1 = -0.1, .k2 = 0.02, .p1 = 3e-4, .p2 = -2e-4}});
}

// Over the limb at 550 km, with a target of two parts that shade each other, lobes and all.
SceneState over_the_limb(double target_m) {
  SceneState state;
  state.r_sun_ECI = {1.1e11, 1e11, 2e10};
  state.r_moon_ECI = {-3.8e8, 0, 0};
  const Vec3 z = unit({-0.39, 0, 0.92}), x = unit(cross(Vec3{0, 1, 0}, z));
  state.camera = {.t = gps_midnight(2025, 3, 20), .r_ECI = {6928e3, 0, 0}, .v_ECI = {0, 7585, 0}};
  state.camera.R_CI = {x, cross(z, x), z};
  state.targets = {{.r_ECI = state.camera.r_ECI + target_m * unit(z + 0.05 * x),
                    .v_ECI = state.camera.v_ECI,
                    .R_TI = rotation_by({0.4, 1.1, -0.3})}};
  return state;
}

// With coasts and night lights where they are installed.
const EarthSurface& surface() {
  static const EarthSurface kept = [] {
    try {
      return EarthSurface::xplanet();
    } catch (const std::runtime_error&) {
      return EarthSurface::uniform();
    }
  }();
  return kept;
}

// A driver leaks what it pleases, and its code is not instrumented.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kHasSanitizer = true;
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
constexpr bool kHasSanitizer = true;
#else
constexpr bool kHasSanitizer = false;
#endif
#else
constexpr bool kHasSanitizer = false;
#endif

SceneOptions options(Renderer renderer) {
  Mesh target = Mesh::box({1, 0.6, 0.4}, {.albedo = 0.4, .specular = 0.3, .shininess = 20});
  target.add(Mesh::sphere(0.25, 16, {.albedo = 0.6}), {0.3, 0.1, 0.5});
  return {.stars = scattered_stars(),
          .earth_view = {.surface = surface(), .glint = true},
          .targets = {target},
          .renderer = renderer};
}

std::optional<SceneFrame> rendered(Renderer renderer, double target_m, std::string& why_not) {
  if (kHasSanitizer && renderer != Renderer::kCpu) {
    why_not = "not with sanitizers";
    return {};
  }
  try {
    return Scene(camera(), {}, options(renderer)).render(over_the_limb(target_m), {});
  } catch (const std::runtime_error& error) {
    why_not = error.what();
    EXPECT_THAT(why_not, HasSubstr("install Debian's package libosmesa6, or libegl1 with"));
    return {};
  }
}

double total_of(const ElectronImage& image) {
  return std::accumulate(image.values.begin(), image.values.end(), 0.0);
}

class GlRendererTest : public ::testing::TestWithParam<Renderer> {};
INSTANTIATE_TEST_SUITE_P(On, GlRendererTest, ::testing::Values(Renderer::kOsMesa, Renderer::kEgl),
                         [](const auto& tested) {
                           return tested.param == Renderer::kOsMesa ? "OsMesa" : "Egl";
                         });

// Near (60 px), at a change of sampling, and as a point. Samples of an edge may fall to the other
// side, one of 16 x 16 in a pixel: 1e-3 of the target. All the rest is rounding of floats: 1e-5 of
// the image, observed 1e-6.
TEST_P(GlRendererTest, DrawsWhatTheCpuDraws) {
  for (const double target_m : {7.0, 60.0, 5000.0}) {
    std::string why_not;
    const auto gl = rendered(GetParam(), target_m, why_not);
    if (!gl) GTEST_SKIP() << why_not;
    const SceneFrame cpu = *rendered(Renderer::kCpu, target_m, why_not);
    EXPECT_NEAR(total_of(gl->light) / total_of(cpu.light), 1, 1e-5) << target_m;
    ASSERT_TRUE(gl->targets[0] && cpu.targets[0]);
    EXPECT_NEAR(gl->targets[0]->electrons / cpu.targets[0]->electrons, 1, 1e-3) << target_m;
    EXPECT_NEAR(gl->targets[0]->photocentre.u, cpu.targets[0]->photocentre.u, 0.01) << target_m;
    EXPECT_NEAR(gl->targets[0]->photocentre.v, cpu.targets[0]->photocentre.v, 0.01) << target_m;
    double off = 0;
    for (std::size_t k = 0; k < cpu.light.values.size(); ++k) {
      off += std::abs(double(gl->light.values[k]) - double(cpu.light.values[k]));
    }
    EXPECT_LT(off / total_of(cpu.light), 1e-5) << target_m;
  }
}

// Stars alone, against the CPU's reference: centroids over 9 x 9 px. Bound 0.01 px; observed below
// 1e-4.
TEST_P(GlRendererTest, StarsStandWhereTheReferenceHasThem) {
  if (kHasSanitizer) GTEST_SKIP() << "not with sanitizers";
  std::optional<Scene> scene;
  const PinholeCamera lens = camera();
  try {
    scene.emplace(lens, OpticsOptions{},
                  SceneOptions{.stars = scattered_stars(),
                               .earth = false,
                               .sun_and_moon = false,
                               .renderer = GetParam()});
  } catch (const std::runtime_error& error) {
    GTEST_SKIP() << error.what();
  }
  SceneState state = over_the_limb(1000);
  state.targets.clear();
  const SceneFrame frame = scene->render(state, {.duration_s = 0.5});
  int alone = 0;
  for (const DrawnPoint& star : frame.stars) {
    if (!lens.is_inside(star.at, -6)) continue;
    bool is_alone = true;
    for (const DrawnPoint& other : frame.stars) {
      is_alone &=
          &other == &star || std::hypot(other.at.u - star.at.u, other.at.v - star.at.v) > 12;
    }
    if (!is_alone) continue;
    ++alone;
    const int u0 = int(std::lround(star.at.u)), v0 = int(std::lround(star.at.v));
    double sum = 0, u = 0, v = 0;
    for (int j = v0 - 4; j <= v0 + 4; ++j) {
      for (int i = u0 - 4; i <= u0 + 4; ++i) {
        // Vignetting would shift it by its slope.
        const double cosine = lens.direction_C({double(i), double(j)}).z;
        const double e = double(frame.light.at(i, j)) / cosine;
        sum += e, u += e * i, v += e * j;
      }
    }
    EXPECT_NEAR(u / sum, star.at.u, 0.002);
    EXPECT_NEAR(v / sum, star.at.v, 0.002);
    EXPECT_NEAR(sum / star.electrons, 1, 1e-4);
  }
  EXPECT_GT(alone, 10);
}

TEST(GlPlatformTest, OsMesaAndEglDrawTheSamePixels) {
  std::string why_not;
  const auto osmesa = rendered(Renderer::kOsMesa, 7, why_not);
  const auto egl = osmesa ? rendered(Renderer::kEgl, 7, why_not) : std::nullopt;
  if (!egl) GTEST_SKIP() << why_not;
  EXPECT_EQ(osmesa->light, egl->light);
}

// The driver reads its number of threads once: each number has a process.
TEST(GlSubject, PrintsItsPixels) {
  if (std::getenv("PRINT_PIXELS") == nullptr) GTEST_SKIP() << "run by the next test";
  std::string why_not;
  const auto frame = rendered(Renderer::kOpenGl, 7, why_not);
  if (!frame) GTEST_SKIP() << why_not;
  std::uint64_t hash = 14695981039346656037u;  // FNV-1a
  for (const float value : frame->light.values) {
    hash = (hash ^ std::bit_cast<std::uint32_t>(value)) * 1099511628211u;
  }
  std::printf("pixels %016llx\n", static_cast<unsigned long long>(hash));
}

std::string pixels_with_threads(int threads) {
  const std::string command = "PRINT_PIXELS=1 LP_NUM_THREADS=" + std::to_string(threads) + " '" +
                              std::filesystem::read_symlink("/proc/self/exe").string() +
                              "' --gtest_filter=GlSubject.PrintsItsPixels 2>&1";
  FILE* pipe = popen(command.c_str(), "r");
  std::string text;
  for (int c; pipe != nullptr && (c = std::fgetc(pipe)) != EOF;) text += char(c);
  if (pipe != nullptr) pclose(pipe);
  const std::size_t at = text.find("pixels ");
  return at == std::string::npos ? "" : text.substr(at, 23);
}

TEST(GlPlatformTest, ThreadsOfTheDriverDoNotShow) {
  const std::string one = pixels_with_threads(1);
  if (one.empty()) GTEST_SKIP() << "no OpenGL";
  EXPECT_EQ(pixels_with_threads(0), one);
  EXPECT_EQ(pixels_with_threads(4), one);
}

}  // namespace
}  // namespace orrery
