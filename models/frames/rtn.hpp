/// Position and velocity of one spacecraft relative to another, in the chief's RTN frame.
#pragma once

#include <orrery/models/frames/frames.hpp>

namespace orrery {

/// R_HI: turns ECI components into RTN components (rows R, T, N).
/// @throws std::domain_error  r and v parallel, zero or not finite: there is no orbit plane.
Mat3 rtn_axes(const InertialState& chief);

/// Angular velocity of RTN relative to ECI in RTN [rad/s]: (0, 0, |r x v|/|r|^2), the osculating
/// orbit's. What turns the plane adds r a_N/|r x v| along R, below 1e-6 rad/s in low Earth orbit.
Vec3 omega_HI_RTN(const InertialState& chief);

struct RelativeState {
  Vec3 r_DC_RTN;  // [m]
  Vec3 v_DC_RTN;  // [m/s], derivative taken in RTN
};

RelativeState relative_state(const InertialState& chief, const InertialState& deputy);
/// The inverse: the deputy's inertial state.
InertialState deputy_state(const InertialState& chief, const RelativeState& relative);

}  // namespace orrery
