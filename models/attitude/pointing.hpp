/// Ideal pointing laws: attitude as an analytic function of the orbit and of the Sun's direction,
/// until attitude dynamics exists.
#pragma once

#include <orrery/models/frames/frames.hpp>

namespace orrery {

struct BodyAttitude {
  Mat3 R_BI;        // f_B = R_BI f_ECI
  Vec3 omega_BI_B;  // angular velocity of the body relative to ECI, in body axes [rad/s]
};

/// R_BI after dt_s more seconds at the same angular velocity.
Mat3 turned(const BodyAttitude& attitude, double dt_s);

/// Where the Sun is seen, and how that direction moves.
struct SunDirection {
  Vec3 s_ECI;     // unit vector
  Vec3 rate_ECI;  // its derivative [1/s], 2e-7 from the Earth's motion
};

/// Zenith mode: +Z up along the position, +X along track (T), +Y along the orbit normal (N).
/// The rate is the osculating orbit's, (0, |r x v|/|r|^2, 0); see omega_HI_RTN.
/// @throws std::domain_error  r and v span no plane.
BodyAttitude zenith_pointing(const InertialState& state);

/// Sun mode: +X to the Sun, +Z as near to the zenith as that allows. The rate is exact for the
/// given velocity and `sun.rate_ECI`. Within 1e-6 rad of the subsolar point, where no direction is
/// nearest to the zenith, +Z is along the orbit normal instead.
/// @throws std::domain_error  r and v span no plane there; r or the Sun's direction zero or not
///                            finite.
BodyAttitude sun_pointing(const InertialState& state, const SunDirection& sun);

}  // namespace orrery
