#include <orrery/models/camera/celestial_disc.hpp>
#include <orrery/models/camera/scene.hpp>
#include <orrery/models/orbit/earth.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <numbers>
#include <numeric>

#include "angles.hpp"

namespace orrery {
namespace {

using std::numbers::pi;

const Vec3 kSunAlongX{kAstronomicalUnit_m, 0, 0};

double total_of(const ElectronImage& image) {
  return std::accumulate(image.values.begin(), image.values.end(), 0.0);
}

// Axes of a camera that looks along `z`, x normal to it.
Mat3 looking_along(const Vec3& z) {
  const Vec3 n = unit(z), x = unit(cross(std::abs(n.z) < 0.9 ? Vec3{0, 0, 1} : Vec3{0, 1, 0}, n));
  return {x, cross(n, x), n};
}

// The edge of a sphere stands at asin(R/r) from nadir. Bound 0.1 px; the cover is linear over one
// pixel. Observed: 0.01 px (the slope of the circle within a pixel of it).
TEST(EarthViewTest, LimbIsAtTheTangentAngle) {
  const PinholeCamera camera({.width_px = 512,
                              .height_px = 512,
                              .fx_px = 900,
                              .fy_px = 900,
                              .distortion = {.k1 = -0.1, .k2 = 0.03}});
  const EarthView earth({.flattening = 0, .atmosphere = false});
  const Image<PixelRay> rays = pixel_rays(camera);
  for (const double altitude : {400e3, 800e3, 20000e3}) {
    const double r = 6378137 + altitude, limb = std::asin(6378137 / r);
    const double look = limb + 0.02;
    const Vec3 axis{-std::cos(look), 0.3 * std::sin(look), std::sqrt(1 - 0.09) * std::sin(look)};
    const Vec3 x = unit(cross(axis, Vec3{-1, 0, 0}));
    const Mat3 R_CI{x, cross(axis, x), axis};
    const EarthPose pose{.R_CI = R_CI, .r_ECI = {r, 0, 0}};
    Image<float> suns(512, 512), covered(512, 512);
    earth.add(suns, covered, rays, pose);
    int edges = 0;
    for (int u = 40; u < 512; u += 60) {
      // Covered from one end of the column on: its length is where the edge is.
      double length = 0;
      for (int v = 0; v < 512; ++v) length += covered.at(u, v);
      if (length < 2 || length > 510) continue;
      const double edge = covered.at(u, 0) > 0.5 ? length - 0.5 : 511.5 - length;
      const Vec3 d = transpose(R_CI) * camera.direction_C({double(u), edge});
      const double off = std::acos(-d.x) - limb;
      const Vec3 next = transpose(R_CI) * camera.direction_C({double(u), edge + 1});
      const double per_px = std::abs(std::acos(-next.x) - std::acos(-d.x));
      EXPECT_LT(std::abs(off) / per_px, 0.1) << altitude << " " << u;
      ++edges;
    }
    EXPECT_GE(edges, 3) << altitude;
  }
}

// From 300 radii the whole disc is a Lambert sphere under parallel rays. The pixels at the limb are
// evaluated at the limb: bound 1.5 %, as the crescent at 135 deg is 28 px wide at most.
TEST(EarthViewTest, FluxOfTheWholeDiscIsALambertSpheres) {
  const PinholeCamera camera({.width_px = 256, .height_px = 256, .fx_px = 3e4, .fy_px = 3e4});
  const EarthView earth(
      {.surface = EarthSurface::uniform(0.5), .flattening = 0, .atmosphere = false});
  const Image<PixelRay> rays = pixel_rays(camera);
  for (const double phase_deg : {0.0, 45.0, 90.0, 135.0}) {
    const double p = phase_deg * kDegree, d = 2e9;
    const EarthPose pose{.R_CI = looking_along({-1, 0, 0}),
                         .r_ECI = {d, 0, 0},
                         .to_sun_ECI = {std::cos(p), std::sin(p), 0},
                         .sun = 1.03};
    Image<float> suns(256, 256), covered(256, 256);
    earth.add(suns, covered, rays, pose);
    EXPECT_NEAR(total_of(suns) / lambert_sphere_suns(6378137, 0.5, d, p, 1.03), 1, 0.015)
        << phase_deg;
  }
}

TEST(EarthViewTest, EllipsoidIsFlatAtThePoles) {
  const PinholeCamera camera({.width_px = 512, .height_px = 512, .fx_px = 2500, .fy_px = 2500});
  const EarthView earth({.flattening = 0.01, .atmosphere = false});
  const EarthPose pose{.R_CI = looking_along({-1, 0, 0}), .r_ECI = {8e7, 0, 0}};
  Image<float> suns(512, 512), covered(512, 512);
  earth.add(suns, covered, pixel_rays(camera), pose);
  double across = 0, down = 0;
  for (int k = 0; k < 512; ++k) {
    across += 0.5 * (covered.at(k, 255) + covered.at(k, 256));
    down += 0.5 * (covered.at(255, k) + covered.at(256, k));
  }
  const bool north_is_along_u = across < down;
  const double polar = north_is_along_u ? across : down;
  EXPECT_NEAR(polar / (across + down - polar), 0.99, 1e-3);
}

TEST(EarthViewTest, LimbGlowsAndFallsByEPerScaleHeight) {
  const PinholeCamera camera({.width_px = 64, .height_px = 256, .fx_px = 3000, .fy_px = 3000});
  const double r = 6378137 + 600e3, limb = std::asin(6378137 / r);
  const EarthView earth({.flattening = 0, .scale_height_m = 8000});
  const double range = std::sqrt(r * r - 6378137.0 * 6378137.0);
  const Vec3 axis{-std::cos(limb), 0, std::sin(limb)};  // to the limb in the x-z plane
  const Mat3 R_CI{{0, 1, 0}, cross(axis, Vec3{0, 1, 0}), axis};
  const EarthPose pose{.R_CI = R_CI, .r_ECI = {r, 0, 0}, .to_sun_ECI = unit({0.2, 0, 1})};
  Image<float> suns(64, 256), covered(64, 256);
  earth.add(suns, covered, pixel_rays(camera), pose);
  const int up = covered.at(32, 0) < 0.5 ? -1 : 1;  // which way open space lies
  const double height_per_px = range / 3000;
  const int first = 127 + up * 4, later = 127 + up * 24;
  const double ratio = suns.at(32, first) / suns.at(32, later);
  EXPECT_NEAR(std::log(ratio), 20 * height_per_px / 8000, 0.03 * 20 * height_per_px / 8000);
}

TEST(EarthSurfaceTest, MapsOfXplanetLieTheRightWay) {
  if (!std::filesystem::exists("/usr/share/xplanet/images/earth.jpg")) {
    GTEST_SKIP() << "needs Debian's packages xplanet-images and libturbojpeg0";
  }
  EarthSurface map = EarthSurface::uniform();
  try {
    map = EarthSurface::xplanet();
  } catch (const std::runtime_error& error) {
    GTEST_SKIP() << error.what();
  }
  const auto at = [&](double longitude_deg, double latitude_deg) {
    const double a = longitude_deg * kDegree, b = latitude_deg * kDegree;
    return map.at({std::cos(a) * std::cos(b), std::sin(a) * std::cos(b), std::sin(b)});
  };
  const float sahara = at(10, 23).albedo, atlantic = at(-30, 5).albedo,
              pacific = at(-140, -20).albedo;
  EXPECT_GT(sahara, 3 * atlantic);
  EXPECT_GT(at(90, -80).albedo, 3 * atlantic);  // Antarctica
  EXPECT_LT(pacific, 0.1);
  float europe = 0, ocean = 0;
  for (int k = 0; k < 20; ++k)
    europe += at(2 + 0.5 * k, 50).night, ocean += at(-140 + k, -20).night;
  EXPECT_GT(europe, 5 * ocean);
}

SceneState low_orbit_state() {
  SceneState state;
  state.camera = {.t = gps_midnight(2025, 3, 20), .r_ECI = {0, 0, 7000e3}, .v_ECI = {7546, 0, 0}};
  state.r_sun_ECI = kSunAlongX;
  return state;
}

// The guide's figure: a sphere of 0.15 m and albedo 0.3 at 100 km and a phase angle of 60 deg has V
// = 4.7.
TEST(SceneTest, FarTargetIsAPointOfItsMagnitude) {
  Scene scene(PinholeCamera{}, {}, {.targets = {Mesh::sphere(0.15, 48, {.albedo = 0.3})}});
  SceneState state = low_orbit_state();
  state.camera.r_ECI = {0, 0, 1e9};  // without Earthshine
  const Vec3 to_target = unit({-std::cos(60 * kDegree), 0, std::sin(60 * kDegree)});
  state.camera.R_CI = looking_along(to_target);
  state.targets = {{.r_ECI = state.camera.r_ECI + 100e3 * to_target, .v_ECI = state.camera.v_ECI}};
  const SceneFrame frame = scene.render(state, {.duration_s = 1});
  ASSERT_TRUE(frame.targets[0]);
  const double electrons = frame.targets[0]->electrons;
  EXPECT_NEAR(-2.5 * std::log10(electrons / Optics().electrons_ps(0)), 4.7, 0.05);
  const double closed = lambert_sphere_suns(0.15, 0.3, 100e3, 60 * kDegree, 1);
  EXPECT_NEAR(electrons / Optics().electrons_ps_of_suns(closed), 1, 0.01);
  EXPECT_NEAR(total_of(frame.light) / electrons, 1, 1e-3);
}

// The image's sum times d^2 over the change from point to mesh, at 2 R f/d = 1 px: no jump. The
// grid of samples moves over the sphere: 0.2 %.
TEST(SceneTest, FluxDoesNotJumpWhenThePointBecomesAMesh) {
  Scene scene(PinholeCamera{}, {.vignetting_power = 0},
              {.earth = false, .targets = {Mesh::box({0.3, 0.2, 0.1}, {.albedo = 0.4})}});
  SceneState state = low_orbit_state();
  const Vec3 to_target = unit({-1, 0.3, 0.2});
  state.camera.R_CI = looking_along(to_target);
  std::vector<double> scaled;
  const double radius = 0.5 * std::sqrt(0.14);
  for (const double size_px : {0.05, 0.9, 0.99, 0.999, 1.001, 1.01, 1.1, 8.0, 60.0}) {
    const double d = 2 * radius * 4000 / size_px;
    state.targets = {{.r_ECI = state.camera.r_ECI + d * to_target,
                      .v_ECI = state.camera.v_ECI,
                      .R_TI = rotation_by({0.5, 0.2, 0.9})}};
    const SceneFrame frame = scene.render(state, {.duration_s = 1});
    scaled.push_back(total_of(frame.light) * d * d);
    EXPECT_NEAR(total_of(frame.light) / frame.targets[0]->electrons, 1, 1e-4) << size_px;
  }
  for (const double value : scaled) EXPECT_NEAR(value / scaled[0], 1, 0.004);
  EXPECT_NEAR(scaled[4] / scaled[3], 1, 0.002);
}

TEST(SceneTest, EarthAndTargetHideStars) {
  std::vector<Star> stars;
  const Vec3 down{0, 0, -1};
  for (int k = 0; k < 5; ++k) {  // one behind the Earth, four above its edge
    const double angle = k == 0 ? 0 : 1.2 + 0.1 * k;
    stars.push_back({.number = k, .direction_ECI = {std::sin(angle), 0, -std::cos(angle)}});
  }
  SceneState state = low_orbit_state();
  state.r_sun_ECI = {0, kAstronomicalUnit_m, 0};
  state.camera.R_CI = looking_along(unit({std::sin(1.1), 0, -std::cos(1.1)}));
  Scene scene(PinholeCamera({.fx_px = 400, .fy_px = 400}), {}, {.stars = StarCatalogue(stars)});
  EXPECT_EQ(scene.render(state, {}).stars.size(), 4u);
  // Limb at asin(6378/7000) = 1.146 rad; a box of 2 m at 10 m covers 0.1 rad about 1.4 rad.
  Scene with_target(PinholeCamera({.fx_px = 400, .fy_px = 400}), {},
                    {.stars = StarCatalogue(stars), .targets = {Mesh::box({1, 1, 1})}});
  state.targets = {{.r_ECI = state.camera.r_ECI + 10 * Vec3{std::sin(1.4), 0, -std::cos(1.4)},
                    .v_ECI = state.camera.v_ECI}};
  const auto seen = with_target.render(state, {}).stars;
  EXPECT_EQ(seen.size(), 3u);
  for (const DrawnPoint& star : seen) EXPECT_NE(star.number, 2);
  (void)down;
}

// A spacecraft in the Earth's shadow shines by the Earth's night side only: not at all.
TEST(SceneTest, TargetIsDarkInTheEarthsShadow) {
  Scene scene(PinholeCamera{}, {}, {.targets = {Mesh::sphere(0.5, 12)}});
  SceneState state = low_orbit_state();
  state.camera.r_ECI = {-7000e3, 0, 0};
  state.camera.R_CI = looking_along({-1, 0, 0});
  state.targets = {{.r_ECI = {-7010e3, 0, 0}}};
  EXPECT_LT(scene.render(state, {}).targets[0]->electrons, 1e-6);
}

// Allen's law at a phase angle of 90 deg: -12.73 + 2.34 + 0.2624.
TEST(SceneTest, MoonAndSunHaveTheirMagnitudes) {
  const Vec3 sun{kAstronomicalUnit_m, 0, 0}, moon{0, 384400e3, 0};
  EXPECT_NEAR(moon_magnitude(moon, sun, {0, 0, 0}), -12.73 + 2.34 + 4e-9 * 6.561e7, 0.01);
  Scene scene(PinholeCamera({.width_px = 256, .height_px = 256}), {.vignetting_power = 0},
              {.earth = false});
  SceneState state = low_orbit_state();
  state.r_moon_ECI = moon;
  const auto flux_towards = [&](const Vec3& direction) {
    state.camera.R_CI = looking_along(direction);
    return total_of(scene.render(state, {.duration_s = 1}).light);
  };
  const double moon_expected = Optics().electrons_ps(moon_magnitude(moon, sun, state.camera.r_ECI));
  EXPECT_NEAR(flux_towards(moon) / moon_expected, 1, 0.01);
  EXPECT_NEAR(flux_towards(sun) / Optics().electrons_ps(-26.74), 1, 0.01);
}

// A fifth of a degree per second over 1 s: the Earth's edge becomes 14 px wide, and the mean does
// not change.
TEST(SceneTest, MotionBlursTheMesh) {
  Scene scene(PinholeCamera({.width_px = 256, .height_px = 256}), {},
              {.earth = false, .targets = {Mesh::box({0.2, 0.2, 0.2})}});
  SceneState state = low_orbit_state();
  state.camera.R_CI = looking_along({-1, 0, 0});
  state.targets = {{.r_ECI = state.camera.r_ECI - Vec3{50, 0, 0}, .v_ECI = state.camera.v_ECI}};
  const auto width = [&](const SceneFrame& frame) {
    double total = 0, mean = 0, square = 0;
    for (int v = 0; v < 256; ++v) {
      for (int u = 0; u < 256; ++u) {
        const double e = frame.light.at(u, v);
        total += e, mean += e * u, square += e * u * u;
      }
    }
    return square / total - mean / total * (mean / total);
  };
  const double sharp = width(scene.render(state, {.duration_s = 0.5}));
  state.camera.omega_CI_C = {0, 8.0 / 4000 / 0.5, 0};  // 8 px
  const double blurred = width(scene.render(state, {.duration_s = 0.5}));
  EXPECT_NEAR(blurred - sharp, 64.0 / 12, 0.15);
}

TEST(SceneTest, StrayLightFallsWithTheAngle) {
  Scene scene(PinholeCamera({.width_px = 128, .height_px = 128}), {.vignetting_power = 0},
              {.earth = false,
               .sun_and_moon = false,
               .stray_light = {.sun_electrons_ps = 1000, .exponent = 2}});
  SceneState state = low_orbit_state();
  const auto level = [&](double angle_deg) {
    const double a = angle_deg * kDegree;
    state.camera.R_CI = looking_along({std::cos(a), std::sin(a), 0});
    return scene.render(state, {.duration_s = 0.5}).light.at(64, 64);
  };
  EXPECT_NEAR(level(30), 500, 1);
  EXPECT_NEAR(level(60), 125, 0.5);
  EXPECT_EQ(level(100), 0);
}

TEST(SceneTest, PixelsDoNotDependOnTheThreads) {
  std::vector<Star> stars;
  for (int k = 0; k < 40; ++k) {
    stars.push_back({.number = k, .direction_ECI = unit({1, 0.02 * k - 0.4, 0.3}), .magnitude = 4});
  }
  Scene scene(PinholeCamera({.width_px = 200, .height_px = 150, .fx_px = 300, .fy_px = 300}), {},
              {.stars = StarCatalogue(stars), .targets = {Mesh::sphere(1, 16)}});
  SceneState state = low_orbit_state();
  state.camera.R_CI = looking_along({1, 0, -0.3});
  state.camera.omega_CI_C = {0.01, 0.02, 0};
  state.targets = {{.r_ECI = state.camera.r_ECI + Vec3{9, 1, 0}, .v_ECI = state.camera.v_ECI}};
  const SceneFrame one = scene.render(state, {.duration_s = 0.2}, 1);
  EXPECT_GT(total_of(one.light), 0);
  for (const int threads : {2, 3, 7}) {
    EXPECT_EQ(scene.render(state, {.duration_s = 0.2}, threads).light, one.light);
  }
}

}  // namespace
}  // namespace orrery
