#include <orrery/models/attitude/pointing.hpp>

#include <gtest/gtest.h>

namespace orrery {
namespace {

const InertialState kState{{7e6, 0, 0}, {0, 4500, 6000}};

TEST(ZenithPointingTest, AxesAreUpAlongTrackAndNormal) {
  const Mat3 R_BI = zenith_pointing(kState).R_BI;
  const Vec3 up_B = R_BI * Vec3{1, 0, 0}, along_B = R_BI * Vec3{0, 0.6, 0.8};
  EXPECT_LT(norm(up_B - Vec3{0, 0, 1}), 1e-15);
  EXPECT_LT(norm(along_B - Vec3{1, 0, 0}), 1e-15);
  EXPECT_LT(norm(cross(R_BI.row_x, R_BI.row_y) - R_BI.row_z), 1e-15) << "right-handed";
}

// omega_BI_B from two attitudes: R(t + dt) R(t)^T = 1 - [omega x] dt. On a circular orbit without
// perturbation; central difference over 2 s: error (omega dt)^2/6 = 2e-7 relative.
TEST(ZenithPointingTest, RateIsTheDerivativeOfTheAttitude) {
  const double n = 7500.0 / 7e6;
  const auto at = [&](double t) {
    const Vec3 x{1, 0, 0}, y{0, 0.6, 0.8};
    const Vec3 r = 7e6 * (std::cos(n * t) * x + std::sin(n * t) * y);
    return zenith_pointing({r, 7500 * (-std::sin(n * t) * x + std::cos(n * t) * y)});
  };
  const Mat3 step = at(1).R_BI * transpose(at(-1).R_BI);
  const Vec3 omega_B = Vec3{step.row_y.z, step.row_z.x, step.row_x.y} / 2.0;
  const Vec3 error = omega_B - at(0).omega_BI_B;
  EXPECT_LT(norm(error), 1e-6 * n);
}

}  // namespace
}  // namespace orrery
