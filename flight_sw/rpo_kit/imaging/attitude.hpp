/// Attitude from directions: Wahba's problem by Davenport's q-method.
///
/// Method      Eigenvector of the largest eigenvalue of K (Davenport 1968; Markley & Crassidis
///             (2014), §5.3), without the singularity of 180 deg that QUEST has to step around.
///             Covariance as of Shuster & Oh, J. Guidance 4(1), 1981.
/// Accuracy    1e-11 rad without noise for a field of 10 deg.
/// Checked by  test_suites/unit/flight_sw/rpo_kit/star_identification_test.cpp
#pragma once

#include "support/matrix.hpp"

namespace rpo_kit {

/// The same direction twice, as unit vectors, and how well it was measured.
struct DirectionPair {
  flight_support::Vec3 measured_C, reference_ECI;
  double sigma_rad = 0.0;  ///< 1-sigma per axis, above 0
};

struct Attitude {
  flight_support::Mat3 R_CI = flight_support::identity<3>();
  /// Of the small rotation, about the axes of C, that turns this attitude into the true one
  /// [rad^2].
  flight_support::Mat3 covariance_C;
};

/// @return false for fewer than two directions, or all on one line.
bool solve_attitude(const DirectionPair* pairs, int count, Attitude* attitude);

}  // namespace rpo_kit
