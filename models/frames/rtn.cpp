#include <orrery/models/frames/rtn.hpp>

#include <stdexcept>

namespace orrery {

Mat3 rtn_axes(const InertialState& chief) {
  const Vec3 R = unit(chief.r_ECI);
  const Vec3 N = unit(cross(chief.r_ECI, chief.v_ECI));
  if (!is_finite(R) || !is_finite(N)) {
    throw std::domain_error(
        "rtn_axes: r_ECI and v_ECI span no orbit plane (parallel, zero or not finite)");
  }
  return {R, cross(N, R), N};
}

Vec3 omega_HI_RTN(const InertialState& chief) {
  return {0, 0, norm(cross(chief.r_ECI, chief.v_ECI)) / dot(chief.r_ECI, chief.r_ECI)};
}

RelativeState relative_state(const InertialState& chief, const InertialState& deputy) {
  const Mat3 R_HI = rtn_axes(chief);
  const Vec3 r_DC_RTN = R_HI * (deputy.r_ECI - chief.r_ECI);
  return {r_DC_RTN, R_HI * (deputy.v_ECI - chief.v_ECI) - cross(omega_HI_RTN(chief), r_DC_RTN)};
}

InertialState deputy_state(const InertialState& chief, const RelativeState& relative) {
  const Mat3 R_IH = transpose(rtn_axes(chief));
  const Vec3 v_inertial_RTN = relative.v_DC_RTN + cross(omega_HI_RTN(chief), relative.r_DC_RTN);
  return {chief.r_ECI + R_IH * relative.r_DC_RTN, chief.v_ECI + R_IH * v_inertial_RTN};
}

}  // namespace orrery
