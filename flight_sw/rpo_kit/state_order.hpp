/// The order of every state and covariance that crosses from one part of the package to another:
/// the one place where it is written down.
///
/// Two parts of a package like this one once had two orders for one state (position before
/// attitude, and after); the covariance stayed symmetric, and its Cholesky factor failed once in
/// hundreds of runs (Bell & D'Amico). So no part has an order of its own.
///
/// Far range   a_roe of the target relative to the observer [m], in the order of
///             support/orbit/relative_elements.hpp: kDa, kDl, kDex, kDey, kDix, kDiy.
/// Rotations   A small turn d that leads from an estimated attitude to the true one is
///             R_true = (I - [d x]) R_estimated, d about the axes of the frame that R turns INTO
///             unless said otherwise.
#pragma once

namespace rpo_kit {

/// A pose, and its covariance: where the target's origin is and how the target is turned.
enum PoseOrder {
  kPosePosition = 0,  ///< target's origin less camera, axes of C, 3 [m]
  kPoseRotation = 3,  ///< of the target relative to the camera, about the axes of C, 3 [rad]
  kPoseStates = 6
};

/// The near-range filter's state, and its covariance.
enum NearOrder {
  kNearPosition = 0,  ///< target less chaser, RTN of the chaser, 3 [m]
  kNearVelocity = 3,  ///< its derivative in RTN, 3 [m/s]
  kNearRotation = 6,  ///< of R_BI, about the axes of the target's body, 3 [rad]
  kNearRate = 9,      ///< omega_BI_B, 3 [rad/s]
  kNearStates = 12
};

}  // namespace rpo_kit
