/// Ideal pointing laws: attitude as an analytic function of the orbit, until attitude dynamics
/// exists.
#pragma once

#include <orrery/models/frames/frames.hpp>

namespace orrery {

struct BodyAttitude {
  Mat3 R_BI;        // f_B = R_BI f_ECI
  Vec3 omega_BI_B;  // angular velocity of the body relative to ECI, in body axes [rad/s]
};

/// Zenith mode: +Z up along the position, +X along track (T), +Y along the orbit normal (N).
/// The rate is the osculating orbit's, (0, |r x v|/|r|^2, 0); see omega_HI_RTN.
/// @throws std::domain_error  r and v span no plane.
BodyAttitude zenith_pointing(const InertialState& state);

}  // namespace orrery
