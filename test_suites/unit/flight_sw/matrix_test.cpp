#include "support/matrix.hpp"

#include <gtest/gtest.h>

#include "support/crc32.h"

namespace flight_support {
namespace {

// det = 2 (5*10 - 8*9) - ... = 3: regular, and needs a row exchange in the first column.
TEST(MatrixTest, SolveMeetsTheEquations) {
  const Matrix<3, 3> a{{{0, 2, 3}, {4, 5, 6}, {7, 8, 10}}};
  const Matrix<3, 2> x{{{1, -2}, {3, 0.5}, {-4, 7}}};
  Matrix<3, 2> found;
  ASSERT_TRUE(solve(a, a * x, &found));
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 2; ++c) EXPECT_NEAR(found(r, c), x(r, c), 1e-13);
  }
}

TEST(MatrixTest, SolveRefusesASingularMatrixAndNaN) {
  Vector<2> x = {{{5}, {6}}};
  EXPECT_FALSE(solve(Matrix<2, 2>{{{1, 2}, {2, 4}}}, Vector<2>{{{1}, {1}}}, &x));
  EXPECT_FALSE(solve(Matrix<2, 2>{{{NAN, 2}, {2, 4}}}, Vector<2>{{{1}, {1}}}, &x));
  EXPECT_EQ(x[0], 5);
}

TEST(MatrixTest, CrossAndTransposeFollowTheirDefinition) {
  const Vec3 n = cross(vec3(1, 0, 0), vec3(0, 1, 0));
  EXPECT_EQ(n[2], 1.0);
  const Matrix<2, 3> a{{{1, 2, 3}, {4, 5, 6}}};
  EXPECT_EQ(transpose(a)(2, 1), 6.0);
  EXPECT_EQ((a * transpose(a))(0, 1), 32.0);
}

// Check values of the two CRCs: 0xCBF43926 is that of zlib and IEEE 802.3; NovAtel's starts at
// zero.
TEST(Crc32Test, GivesTheCheckValues) {
  const unsigned char digits[] = "123456789";
  EXPECT_EQ(flight_crc32_novatel(digits, 9), 0x2DFD2D88u);
  EXPECT_EQ(flight_crc32_common(digits, 9), 0xCBF43926u);
}

}  // namespace
}  // namespace flight_support
