#include "rpo_kit/imaging/attitude.hpp"

#include <cmath>

#include "support/symmetric.hpp"

namespace rpo_kit {
namespace {

using namespace flight_support;

Matrix<4, 4> davenport(const Mat3& B) {
  const double trace = B(0, 0) + B(1, 1) + B(2, 2);
  Matrix<4, 4> K;
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) K(r, c) = B(r, c) + B(c, r) - (r == c ? trace : 0.0);
  }
  // Sum of w measured x reference, which B holds in its odd part.
  const Vec3 z = vec3(B(1, 2) - B(2, 1), B(2, 0) - B(0, 2), B(0, 1) - B(1, 0));
  for (int k = 0; k < 3; ++k) K(k, 3) = K(3, k) = z[k];
  K(3, 3) = trace;
  return K;
}

// Vector part first, scalar last; turns components as R_CI does.
Mat3 rotation(const Vector<4>& q) {
  const double x = q[0], y = q[1], z = q[2], w = q[3];
  return Mat3{{{1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)},
               {2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)},
               {2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)}}};
}

}  // namespace

bool solve_attitude(const DirectionPair* pairs, int count, Attitude* attitude) {
  if (count < 2) return false;
  Mat3 B, information;
  double total = 0.0;
  for (int k = 0; k < count; ++k) {
    const double weight = 1.0 / (pairs[k].sigma_rad * pairs[k].sigma_rad);
    const Mat3 outer = pairs[k].measured_C * transpose(pairs[k].measured_C);
    information = information + weight * (identity<3>() - outer);
    B = B + weight * (pairs[k].measured_C * transpose(pairs[k].reference_ECI));
    total += weight;
  }
  Mat3 covariance;
  if (!solve((1.0 / total) * information, identity<3>(), &covariance)) return false;
  // All on one line leaves the turn about it open: two stars 0.1 deg apart are still taken.
  const SymmetricEigen<3> spread = eigen_symmetric((1.0 / total) * information);
  if (!(spread.values[spread.smallest()] > 1e-7)) return false;
  const SymmetricEigen<4> eigen = eigen_symmetric(davenport((1.0 / total) * B));
  const Vector<4> q = eigen.vector(eigen.largest());
  attitude->R_CI = rotation((1.0 / norm(q)) * q);
  attitude->covariance_C = (1.0 / total) * symmetric(covariance);
  return true;
}

}  // namespace rpo_kit
