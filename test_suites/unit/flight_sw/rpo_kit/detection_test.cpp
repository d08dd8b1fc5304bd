#include "rpo_kit/imaging/detection.hpp"

#include <gtest/gtest.h>

#include "star_scene.hpp"

namespace rpo_kit {
namespace {

using flight_test::Exposure;
using flight_test::Noise;

// Two ways to write one formula: rounding of 1000 px. Back: Newton's last step.
TEST(CameraTest, ProjectsAsOpenCvDoesAndBack) {
  const Camera camera = flight_test::wide_camera();
  Noise noise(1);
  int seen = 0;
  for (int k = 0; k < 2000; ++k) {
    const double x = 0.4 * (noise.uniform() - 0.5);
    const double y = 0.4 * (noise.uniform() - 0.5);
    const flight_support::Vec3 direction = flight_support::vec3(x, y, 1.0);
    double u = 0.0, v = 0.0;
    if (!flight_test::pinhole(camera, direction, &u, &v)) continue;
    ++seen;
    Pixel pixel;
    ASSERT_TRUE(project(camera, 3.0 * direction, &pixel));
    EXPECT_NEAR(pixel.u, u, 1e-10);
    EXPECT_NEAR(pixel.v, v, 1e-10);
    flight_support::Vec3 back;
    ASSERT_TRUE(unproject(camera, pixel, &back));
    EXPECT_LT(norm(back - (1.0 / norm(direction)) * direction), 1e-13);
  }
  EXPECT_GT(seen, 1000);
}

// Against central differences; their third order is 1e-12 of the value.
TEST(CameraTest, PartialsAreTheDerivative) {
  const Camera camera = flight_test::wide_camera();
  const flight_support::Vec3 at = flight_support::vec3(0.4, -0.3, 2.5);
  Pixel pixel;
  flight_support::Matrix<2, 3> partials;
  ASSERT_TRUE(project(camera, at, &pixel, &partials));
  for (int k = 0; k < 3; ++k) {
    flight_support::Vec3 step;
    step[k] = 1e-5;
    Pixel plus, minus;
    ASSERT_TRUE(project(camera, at + step, &plus) && project(camera, at - step, &minus));
    EXPECT_NEAR(partials(0, k), (plus.u - minus.u) / 2e-5, 1e-5);
    EXPECT_NEAR(partials(1, k), (plus.v - minus.v) / 2e-5, 1e-5);
  }
}

TEST(CameraTest, BehindTheCameraIsRefused) {
  Pixel pixel;
  EXPECT_FALSE(project(Camera(), flight_support::vec3(0.1, 0.1, -1.0), &pixel));
  EXPECT_FALSE(project(Camera(), flight_support::vec3(0.1, 0.1, 0.0), &pixel));
}

class CentroidBiasTest : public testing::TestWithParam<double> {};

// Sources of 2e5 e- without noise at 17 x 17 places on the pixel grid; what is left is rounding to
// DN of 1 e- and the aliasing of the window, which falls with the PSF's width: 0.005 px is promised
// at 0.7 px, 0.001 px from 0.8 px on. Observed 6e-4 px at 0.8 px, 4e-5 px at 1.2 px; at 0.6 px it
// would be 0.017 px.
TEST_P(CentroidBiasTest, IsWhatAliasingLeaves) {
  const double sigma = GetParam();
  Exposure exposure(17 * 32, 17 * 32, 50.0);
  for (int j = 0; j < 17; ++j) {
    for (int i = 0; i < 17; ++i) {
      exposure.add_source(32 * i + 15 + i / 17.0, 32 * j + 15 + j / 17.0, 2e5, sigma);
    }
  }
  exposure.read_out(1.0, 0.0, nullptr);
  DetectionOptions options;
  options.psf_sigma_px = sigma;
  options.max_pixels = 2000;
  PointSourceDetector detector(17 * 32, 17 * 32, options);
  std::vector<Detection> found;
  ASSERT_TRUE(detector.detect(exposure.view(), &found));
  ASSERT_EQ(found.size(), 289u);
  double worst = 0.0;
  for (const Detection& d : found) {
    const double i = std::floor(d.u / 32), j = std::floor(d.v / 32);
    worst = std::max({worst, std::fabs(d.u - (32 * i + 15 + i / 17.0)),
                      std::fabs(d.v - (32 * j + 15 + j / 17.0))});
  }
  EXPECT_LT(worst, sigma < 0.75 ? 0.005 : 0.001);
  RecordProperty("worst_px", std::to_string(worst));
}
INSTANTIATE_TEST_SUITE_P(Psf, CentroidBiasTest, testing::Values(0.7, 0.8, 1.0, 1.2));

// 289 sources with shot, background and read noise: what is said of their errors holds. The root
// mean square of 578 normalised errors has 1 sigma of 0.03; fluxes of which the signal-to-noise
// ratio is 15 and 100.
TEST(DetectionTest, CentroidErrorsAreAsPredicted) {
  for (double electrons : {1500.0, 12000.0}) {
    Noise noise(7);
    Exposure exposure(17 * 32, 17 * 32, 60.0);
    for (int j = 0; j < 17; ++j) {
      for (int i = 0; i < 17; ++i) {
        exposure.add_source(32 * i + 15 + i / 17.0, 32 * j + 15 + j / 17.0, electrons, 0.8);
      }
    }
    exposure.read_out(2.0, 10.0, &noise);
    DetectionOptions options;
    options.electrons_per_dn = 2.0;
    options.floor_sigma_px = 0.0;
    PointSourceDetector detector(17 * 32, 17 * 32, options);
    std::vector<Detection> found;
    ASSERT_TRUE(detector.detect(exposure.view(), &found));
    EXPECT_NEAR(static_cast<double>(found.size()), 289.0, 2.0);
    double squares = 0.0, normalised = 0.0, flux = 0.0;
    for (const Detection& d : found) {
      const double i = std::floor(d.u / 32), j = std::floor(d.v / 32);
      const double du = d.u - (32 * i + 15 + i / 17.0), dv = d.v - (32 * j + 15 + j / 17.0);
      squares += 0.5 * (du * du + dv * dv);
      normalised += 0.5 * (du * du + dv * dv) / (d.sigma_px * d.sigma_px);
      flux += 2.0 * d.flux_dn;
    }
    const double count = static_cast<double>(found.size());
    RecordProperty("rms_px_" + std::to_string(static_cast<int>(electrons)),
                   std::to_string(std::sqrt(squares / count)));
    EXPECT_NEAR(std::sqrt(normalised / count), 1.0, 0.1) << electrons;
    // The window holds all but 2e-4 of the flux; noise of the mean is 0.5 %.
    EXPECT_NEAR(flux / count / electrons, 1.0, 0.02);
  }
}

// 5 sigma is exceeded by 2.9e-7 of pixels, 0.3 in a million; two side by side never.
TEST(DetectionTest, NoiseAloneGivesNothingAndBackgroundIsFollowed) {
  Noise noise(3);
  Exposure exposure(512, 512, 0.0);
  for (int y = 0; y < 512; ++y) {
    for (int x = 0; x < 512; ++x) exposure.add(x, y, 40.0 + 0.5 * x + 0.2 * y);
  }
  exposure.read_out(1.0, 10.0, &noise);
  PointSourceDetector detector(512, 512, DetectionOptions());
  std::vector<Detection> found;
  ASSERT_TRUE(detector.detect(exposure.view(), &found));
  EXPECT_EQ(found.size(), 0u);
  for (int at : {40, 200, 300, 470}) {
    // A tile's mean of 1024 pixels with 20 e-: 0.6; the gradient within it: none, being linear.
    EXPECT_NEAR(detector.background(at, at) - 100.0, 40.0 + 0.7 * at, 2.0);
    const double sigma = std::sqrt(40.0 + 0.7 * at + 100.0);
    // The gradient within a tile adds 0.54 * 32 / sqrt(12) = 5 in quadrature.
    EXPECT_NEAR(detector.noise(at, at), std::hypot(sigma, 5.0), 0.06 * sigma);
  }
}

TEST(DetectionTest, HotPixelsAreSharperThanAnySource) {
  Exposure exposure(128, 128, 50.0);
  exposure.add_source(40.0, 40.0, 5000.0, 0.8);  // centred: as sharp as a source can be
  exposure.add_source(80.5, 80.5, 5000.0, 0.8);
  exposure.add(100, 30, 5000.0);
  exposure.read_out(1.0, 0.0, nullptr);
  DetectionOptions options;
  options.min_pixels = 1;
  PointSourceDetector detector(128, 128, options);
  std::vector<Detection> found;
  ASSERT_TRUE(detector.detect(exposure.view(), &found));
  ASSERT_EQ(found.size(), 3u);
  for (const Detection& d : found) {
    EXPECT_EQ(d.sharpness > detector.hot_sharpness(), d.u > 90.0) << d.u << ' ' << d.sharpness;
  }
}

TEST(DetectionTest, ImageOfAnotherSizeIsRefused) {
  Exposure exposure(64, 32, 50.0);
  exposure.read_out(1.0, 0.0, nullptr);
  PointSourceDetector detector(64, 64);
  std::vector<Detection> found(3);
  EXPECT_FALSE(detector.detect(exposure.view(), &found));
  EXPECT_FALSE(detector.detect(ImageView(), &found));
  EXPECT_TRUE(found.empty());
}

}  // namespace
}  // namespace rpo_kit
