#include <orrery/models/camera/star_field.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <vector>

#include "angles.hpp"
#include "opencv_projection.hpp"

namespace orrery {
namespace {

PinholeOptions star_tracker() {
  return {.width_px = 512,
          .height_px = 512,
          .fx_px = 1900,
          .fy_px = 1905,
          .cx_px = 253.7,
          .cy_px = 258.2,
          .distortion = {.k1 = -0.15, .k2 = 0.4, .p1 = 3e-4, .p2 = -2e-4, .k3 = 0.1}};
}

CameraPose pose_at_rest() {
  return {.t = gps_midnight(2025, 3, 20)};
}

double sum(const ElectronImage& image) {
  return std::accumulate(image.values.begin(), image.values.end(), 0.0);
}

// First moments over a square of pixels: as an independent observer would.
Pixel centroid(const ElectronImage& image, const Pixel& near, int half_width) {
  double total = 0, u_sum = 0, v_sum = 0;
  const int cu = int(std::lround(near.u)), cv = int(std::lround(near.v));
  for (int v = cv - half_width; v <= cv + half_width; ++v) {
    for (int u = cu - half_width; u <= cu + half_width; ++u) {
      const double e = image.at(u, v);
      total += e, u_sum += e * u, v_sum += e * v;
    }
  }
  return {u_sum / total, v_sum / total};
}

// Where classical optics says a direction is seen, written afresh: v/c along the velocity less its
// part along the line of sight, second order (2e-9) left out.
Vec3 classically_aberrated(const Vec3& u, const Vec3& v) {
  const Vec3 b = v / 299792458.0;
  return unit(u + b - dot(u, b) * u);
}

// Bound: 0.01 px. The moment of a Gaussian cut at 5 sigma (4 px) is biased by less than 1e-4 px,
// and the pixels are floats (6e-8 each). Observed over 361 stars: 7e-6 px.
TEST(StarFieldTest, CentroidsAreWhereOpenCvProjectsTheStars) {
  const PinholeCamera camera(star_tracker());
  const Optics optics({.psf_sigma_px = 0.8});
  CameraPose pose = pose_at_rest();
  pose.R_CI = rotation_by({0.3, -1.1, 2.0});
  pose.v_ECI = {-7500, 800, 900};
  std::vector<Star> stars;
  for (int j = 0; j < 19; ++j) {
    for (int i = 0; i < 19; ++i) {
      const Pixel at{8 + 27.52 * i + 0.031 * j, 7 + 27.57 * j - 0.047 * i};
      stars.push_back({.number = int(stars.size()) + 1,
                       .direction_ECI = transpose(pose.R_CI) * camera.direction_C(at),
                       .magnitude = 5});
    }
  }
  const Vec3 v = earth_velocity_ECI(pose.t) + pose.v_ECI;
  ElectronImage image(512, 512);
  const auto drawn = StarField(StarCatalogue(stars)).draw(image, camera, optics, pose, {});
  ASSERT_EQ(drawn.size(), stars.size());
  std::vector<Vec3> seen_C;
  for (const Star& star : stars) {
    seen_C.push_back(pose.R_CI * classically_aberrated(star.direction_ECI, v));
  }
  const std::vector<Pixel> expected = opencv_projection(camera, seen_C);
  if (expected.empty()) GTEST_SKIP() << "built without OpenCV (libopencv-calib3d-dev)";
  double worst = 0;
  for (const Pixel& at : expected) {
    const Pixel found = centroid(image, at, 6);
    worst = std::max(worst, std::hypot(found.u - at.u, found.v - at.v));
  }
  RecordProperty("worst_px", std::to_string(worst));
  EXPECT_LT(worst, 1e-3);
}

// 1.9e4 electrons per second and mm^2 from V = 0 (Liebe 2002); here 20 mm, 0.1 s and V 6 as in the
// literature's example: 2.4e3. Bound 0.5 %; the window leaves out 1e-6, floats 1e-7.
TEST(StarFieldTest, FluxIsThatOfTheMagnitudeAndLinear) {
  const PinholeCamera camera({.width_px = 64, .height_px = 64});
  const Optics optics({.aperture_m = 0.02});
  const auto flux = [&](double magnitude, double exposure_s) {
    ElectronImage image(64, 64);
    const Star star{.direction_ECI = {0, 0, 1}, .magnitude = magnitude};
    StarField(StarCatalogue({star}))
        .draw(image, camera, optics, pose_at_rest(), {.duration_s = exposure_s});
    return sum(image);
  };
  const double area_mm2 = 3.14159265358979323846 * 100;
  EXPECT_NEAR(flux(6, 0.1) / (1.9e4 * area_mm2 * 0.1 * std::pow(10, -2.4)), 1, 1e-5);
  EXPECT_NEAR(flux(6, 0.1), 2.4e3, 50);
  EXPECT_NEAR(flux(1, 0.1) / flux(6, 0.1), 100, 1e-3);  // Pogson: 5 magnitudes
  EXPECT_NEAR(flux(3, 2.0) / flux(3, 0.01), 200, 2e-3);
}

TEST(StarFieldTest, StarOutsideSpillsItsGaussianPartIntoTheImage) {
  ElectronImage image(64, 64);
  add_point(image, {-2.5, 30.2}, 1e6, 1.0);
  // The image begins at -0.5: beyond 2 sigma of a Gaussian.
  EXPECT_NEAR(sum(image) / 1e6, 0.5 * std::erfc(2 / std::sqrt(2.0)), 1e-6);
}

// The camera turns about y by 20 px during the exposure: the streak is uniform in time, so its mean
// is the place at mid-exposure and its variance L^2/12 + sigma^2 + 1/12 (the pixel).
TEST(StarFieldTest, MotionDrawsAStreakOfUniformBrightness) {
  const PinholeCamera camera({.width_px = 256, .height_px = 256, .fx_px = 2000, .fy_px = 2000});
  const Optics optics;
  CameraPose pose = pose_at_rest();
  const double length_px = 20, exposure_s = 0.2;
  pose.omega_CI_C = {0, length_px / 2000 / exposure_s, 0};
  ElectronImage image(256, 256);
  const double electrons_ps = 1e5;
  const auto middle = add_source(image, camera, optics, pose, {.duration_s = exposure_s},
                                 {{0.003, -0.002, 1}, {}, electrons_ps});
  const Pixel found = centroid(image, *middle, 20);
  EXPECT_NEAR(found.u, 127.5 + 6, 2e-3);
  EXPECT_NEAR(found.v, 127.5 - 4, 2e-3);
  EXPECT_NEAR(sum(image) / (electrons_ps * exposure_s), 1, 1e-5);
  double spread = 0;
  for (int u = 0; u < 256; ++u) {
    for (int v = 0; v < 256; ++v) spread += image.at(u, v) * (u - found.u) * (u - found.u);
  }
  const double expected = length_px * length_px / 12 + 0.8 * 0.8 + 1.0 / 12;
  EXPECT_NEAR(spread / sum(image) / expected, 1,
              0.002);  // the instants: -1/(40^2) of the first term
}

// A roll about the boresight... seen by rows at their own times: a turn about y at 100 px/s, rows 1
// ms apart, moves a star in row v by 0.1 px for each row below the middle.
TEST(StarFieldTest, RollingShutterSeesEachRowAtItsOwnTime) {
  const PinholeCamera camera({.width_px = 256, .height_px = 256, .fx_px = 2000, .fy_px = 2000});
  CameraPose pose = pose_at_rest();
  pose.omega_CI_C = {0, -100.0 / 2000, 0};
  for (const double row : {20.5, 127.5, 230.5}) {
    ElectronImage image(256, 256);
    const PointSource star{{0, (row - 127.5) / 2000, 1}, {}, 1e6};
    const auto at =
        add_source(image, camera, Optics(), pose, {.duration_s = 1e-3, .row_period_s = 1e-3}, star);
    // A star on the axis moves by f tan(0.05 dt): 3e-4 px beside the linear at 0.1 s.
    EXPECT_NEAR(at->u, 127.5 + 0.1 * (row - 127.5), 2e-3);
    EXPECT_NEAR(centroid(image, *at, 6).u, at->u, 1e-3);
  }
}

TEST(StarFieldTest, HiddenStarsAndThoseBehindAreNotDrawn) {
  const PinholeCamera camera;
  const std::vector<Star> stars{{.number = 1, .direction_ECI = {0, 0, 1}},
                                {.number = 2, .direction_ECI = unit({0.05, 0, 1})},
                                {.number = 3, .direction_ECI = {0, 0, -1}}};
  ElectronImage image(1024, 1024);
  const auto drawn = StarField(StarCatalogue(stars))
                         .draw(image, camera, Optics(), pose_at_rest(), {},
                               [](const Vec3& u) { return u.x < 0.01; });
  ASSERT_EQ(drawn.size(), 1u);
  EXPECT_EQ(drawn[0].number, 2);
}

TEST(VignettingTest, FollowsThePowerOfTheCosine) {
  const PinholeCamera camera({.width_px = 100, .height_px = 100, .fx_px = 60, .fy_px = 60});
  ElectronImage image(100, 100, 1000);
  Vignetting(camera, 4).apply(image);
  const double tangent = std::hypot(49.5, 49.5) / 60;
  EXPECT_NEAR(image.at(0, 0), 1000 * std::pow(std::cos(std::atan(tangent)), 4), 0.01);
  EXPECT_NEAR(image.at(50, 50), 1000, 0.5);
}

TEST(OpticsTest, RefusesWhatNoLensIs) {
  EXPECT_THROW(Optics({.aperture_m = 0}), std::invalid_argument);
  EXPECT_THROW(Optics({.psf_sigma_px = 0.1}), std::invalid_argument);
  EXPECT_THROW(Optics({.throughput = std::nan("")}), std::invalid_argument);
  EXPECT_NEAR(Optics().electrons_ps_of_suns(1) / Optics().electrons_ps(kSunMagnitude), 1, 1e-12);
  EXPECT_NEAR(rotation_by({0, 0, 90 * kDegree}).row_x.y, 1, 1e-15);  // components into turned axes
}

}  // namespace
}  // namespace orrery
