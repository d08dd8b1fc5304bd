#include <orrery/models/camera/pinhole_camera.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>
#include <vector>

#include "opencv_projection.hpp"

namespace orrery {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

// A lens of 50 deg across with a barrel of 5 % at the corner, decentred.
PinholeOptions wide_lens() {
  return {.width_px = 640,
          .height_px = 480,
          .fx_px = 700,
          .fy_px = 710,
          .cx_px = 322.4,
          .cy_px = 236.9,
          .distortion = {.k1 = -0.18, .k2 = 0.06, .p1 = 8e-4, .p2 = -5e-4, .k3 = -0.012}};
}

std::vector<Vec3> grid_of_directions(const PinholeCamera& camera) {
  std::vector<Vec3> directions;
  for (int v = 0; v < camera.height_px(); v += 20) {
    for (int u = 0; u < camera.width_px(); u += 20) {
      directions.push_back(camera.direction_C({u + 0.3, v + 0.7}));
    }
  }
  return directions;
}

TEST(PinholeCameraTest, ProjectionIsOpenCvs) {
  const PinholeCamera camera(wide_lens());
  std::vector<Vec3> points = grid_of_directions(camera);
  for (std::size_t k = 0; k < points.size(); ++k) points[k] *= 1.0 + 10.0 * double(k % 7);
  const std::vector<Pixel> expected = opencv_projection(camera, points);
  if (expected.empty()) GTEST_SKIP() << "built without OpenCV (libopencv-calib3d-dev)";
  for (std::size_t k = 0; k < points.size(); ++k) {
    const Pixel seen = camera.project(points[k]).value();
    // Both are double arithmetic of one formula, values to 640: 1e-13 relative. Observed: 1.2e-13
    // px.
    EXPECT_NEAR(seen.u, expected[k].u, 1e-11);
    EXPECT_NEAR(seen.v, expected[k].v, 1e-11);
  }
}

// The inverse stops at 1e-13 of a normalised coordinate, 1e-10 px. Observed: 7e-11 px.
TEST(PinholeCameraTest, DirectionIsTheInverseOfProjection) {
  const PinholeCamera camera(wide_lens());
  for (int v = 0; v < 480; v += 17) {
    for (int u = 0; u < 640; u += 13) {
      const Pixel back = camera.project(3.0 * camera.direction_C({u + 0.25, v - 0.125})).value();
      EXPECT_NEAR(back.u, u + 0.25, 2e-10);
      EXPECT_NEAR(back.v, v - 0.125, 2e-10);
    }
  }
}

// A quadrilateral of directions one pixel wide: its solid angle by the two triangles' (Van Oosterom
// and Strackee 1983). The pixel's own value is that of its centre: second order in 1/700.
TEST(PinholeCameraTest, SolidAngleIsThatOfThePixelsCorners) {
  const PinholeCamera camera(wide_lens());
  const auto triangle = [](const Vec3& a, const Vec3& b, const Vec3& c) {
    return 2 * std::atan2(std::abs(dot(a, cross(b, c))), 1 + dot(a, b) + dot(b, c) + dot(c, a));
  };
  for (const Pixel p : {Pixel{0, 0}, Pixel{320, 240}, Pixel{639, 479}, Pixel{100, 400}}) {
    const Vec3 a = camera.direction_C({p.u - 0.5, p.v - 0.5});
    const Vec3 b = camera.direction_C({p.u + 0.5, p.v - 0.5});
    const Vec3 c = camera.direction_C({p.u + 0.5, p.v + 0.5});
    const Vec3 d = camera.direction_C({p.u - 0.5, p.v + 0.5});
    const double expected = triangle(a, b, c) + triangle(a, c, d);
    EXPECT_NEAR(camera.solid_angle_sr(p) / expected, 1, 2e-6);  // observed: 1.4e-7
  }
}

TEST(PinholeCameraTest, PrincipalPointIsTheMiddleByDefault) {
  const PinholeCamera camera({.width_px = 512, .height_px = 256});
  const Pixel middle = camera.project({0, 0, 5}).value();
  EXPECT_EQ(middle.u, 255.5);
  EXPECT_EQ(middle.v, 127.5);
  EXPECT_FALSE(camera.project({0.1, 0, -1}));
}

// With this lens alone, a direction at 60 deg would come back into the image.
TEST(PinholeCameraTest, NothingFarOutsideFoldsBackIntoTheImage) {
  const PinholeCamera camera(wide_lens());
  double before = camera.project({std::tan(0.3), 0, 1})->u;
  for (double angle = 0.31; angle < 1.5; angle += 0.01) {
    const double u = camera.project({std::tan(angle), 0, 1})->u;
    EXPECT_GT(u, before) << angle;
    before = u;
  }
}

TEST(PinholeCameraTest, RefusesWhatItCannotMap) {
  const auto make = [](PinholeOptions options) { return [options] { PinholeCamera{options}; }; };
  EXPECT_THAT(make({.width_px = 8}), ThrowsMessage<std::invalid_argument>(
                                         HasSubstr("width_px = 8 px; accepted: 16 to 4096")));
  EXPECT_THAT(make({.fx_px = std::nan("")}),
              ThrowsMessage<std::invalid_argument>(HasSubstr("fx_px = nan px")));
  EXPECT_THAT(make({.cx_px = -3.0}),
              ThrowsMessage<std::invalid_argument>(HasSubstr("cx_px = -3 px")));
  EXPECT_THAT(make({.fx_px = 500, .fy_px = 500, .distortion = {.k1 = -0.6}}),
              ThrowsMessage<std::invalid_argument>(HasSubstr("one to one")));
}

}  // namespace
}  // namespace orrery
