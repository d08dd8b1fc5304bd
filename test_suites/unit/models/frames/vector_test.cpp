#include <orrery/models/frames/vector.hpp>

#include <gtest/gtest.h>

#include <cmath>

namespace orrery {
namespace {

// Euler's formula for a rotation of vectors by `angle` about a unit axis, written independently of
// to_matrix.
Mat3 rotation(const Vec3& axis, double angle) {
  const auto turn = [&](const Vec3& v) {
    return std::cos(angle) * v + std::sin(angle) * cross(axis, v) +
           (1 - std::cos(angle)) * dot(axis, v) * axis;
  };
  return transpose(Mat3{turn({1, 0, 0}), turn({0, 1, 0}), turn({0, 0, 1})});
}

double largest_difference(const Mat3& a, const Mat3& b) {
  double largest = 0;
  for (const Vec3& d : {a.row_x - b.row_x, a.row_y - b.row_y, a.row_z - b.row_z})
    for (int i = 0; i < 3; ++i) largest = std::max(largest, std::abs(d[i]));
  return largest;
}

TEST(VectorTest, MatrixTurnsComponentsIntoTurnedAxes) {
  // Axes turned by +90 deg about z: what lay along the old x now lies along the new -y.
  const Mat3 R_BA{{0, 1, 0}, {-1, 0, 0}, {0, 0, 1}};
  EXPECT_EQ(R_BA * (Vec3{1, 0, 0}), (Vec3{0, -1, 0}));
}

TEST(QuaternionTest, AxesTurnedAboutZHaveTheDocumentedQuaternion) {
  const double half = 0.2;
  const Mat3 R3{{std::cos(2 * half), std::sin(2 * half), 0},
                {-std::sin(2 * half), std::cos(2 * half), 0},
                {0, 0, 1}};
  const Quaternion q = to_quaternion(R3);
  EXPECT_NEAR(q.w, std::cos(half), 1e-15);
  EXPECT_NEAR(q.z, -std::sin(half), 1e-15);
  EXPECT_EQ(q.x, 0);
  EXPECT_EQ(q.y, 0);
}

// Every branch of Shepperd's method: angles up to and beyond half a turn about axes near each of x,
// y, z. Tolerance: some ten roundings of numbers of size one; observed 4e-16.
TEST(QuaternionTest, MatrixSurvivesTheDetourWithRealPartNotNegative) {
  const Vec3 axes[] = {{1, 0.1, 0.2}, {0.1, 1, -0.3}, {-0.2, 0.3, 1}, {1, 1, 1}, {-1, 0, 0}};
  for (const Vec3& axis : axes) {
    for (double angle = -3.2; angle < 6.4; angle += 0.1) {
      const Mat3 R = rotation(unit(axis), angle);
      const Quaternion q = to_quaternion(R);
      EXPECT_GE(q.w, 0);
      EXPECT_LT(largest_difference(to_matrix(q), R), 2e-15) << "angle " << angle;
    }
  }
}

TEST(QuaternionTest, HalfTurnsAreExact) {
  EXPECT_EQ(to_quaternion({{1, 0, 0}, {0, -1, 0}, {0, 0, -1}}), (Quaternion{0, 1, 0, 0}));
  EXPECT_EQ(to_quaternion({{-1, 0, 0}, {0, 1, 0}, {0, 0, -1}}), (Quaternion{0, 0, 1, 0}));
  EXPECT_EQ(to_quaternion({{-1, 0, 0}, {0, -1, 0}, {0, 0, 1}}), (Quaternion{0, 0, 0, 1}));
}

TEST(QuaternionTest, ProductsCancelNeighboursLikeMatrices) {
  const Mat3 R_SB = rotation(unit({1, 2, 3}), 0.7), R_BI = rotation(unit({-2, 1, 1}), 1.9);
  const Quaternion q_SI = to_quaternion(R_SB) * to_quaternion(R_BI);
  EXPECT_LT(largest_difference(to_matrix(q_SI), R_SB * R_BI), 2e-15);
}

}  // namespace
}  // namespace orrery
