#include "rpo_kit/far_range/relative_orbit.hpp"

#include <cmath>

#include "support/orbit/constants.hpp"

namespace rpo_kit {

using namespace flight_support;

Observer observer_from_state(std::int64_t t_ns, const StateEci& state) {
  return {t_ns, mean_from_osculating(osculating_from_state(state))};
}

Observer propagate(const Observer& observer, std::int64_t to_ns) {
  return {to_ns, propagate_mean(observer.mean, seconds(to_ns - observer.t_ns))};
}

RelativeElements drift(const OrbitElements& observer, const RelativeElements& a_roe, double dt_s) {
  return relative_elements(propagate_mean(observer, dt_s),
                           propagate_mean(apply_relative_elements(observer, a_roe), dt_s));
}

Mat3 burn_covariance(const Vec3& dv, double magnitude_fraction, double direction_rad) {
  const double along = magnitude_fraction * magnitude_fraction;
  const double across = direction_rad * direction_rad;
  return (along - across) * (dv * transpose(dv)) + (across * dot(dv, dv)) * identity<3>();
}

OrbitElements after_burn(const OrbitElements& observer, const Vec3& dv_RTN) {
  StateEci state = state_from_osculating(osculating_from_mean(observer));
  state.v_ECI = state.v_ECI + transpose(eci_to_rtn(state)) * dv_RTN;
  return mean_from_osculating(osculating_from_state(state));
}

RelativeElements seen_from(const OrbitElements& observer, const OrbitElements& other,
                           const RelativeElements& a_roe) {
  return relative_elements(other, apply_relative_elements(observer, a_roe));
}

Vec3 position_ECI(const OrbitElements& mean) {
  return state_from_osculating(osculating_from_mean(mean)).r_ECI;
}

Vec3 target_position_ECI(const OrbitElements& observer, const Vec3& observer_r_ECI,
                         const RelativeElements& a_roe) {
  return position_ECI(apply_relative_elements(observer, a_roe)) - observer_r_ECI;
}

bool intersect(const Vec3& first, const Vec3& second, const Vec3& r_ECI, Intersection* at) {
  const Vec3 normal = cross(first, second);
  at->sine = norm(normal);
  if (!(at->sine > 0.0)) return false;
  const double c = dot(first, second), s2 = at->sine * at->sine;
  const double along_first = dot(r_ECI, first), along_second = dot(r_ECI, second);
  at->first_m = (along_first - c * along_second) / s2;
  at->second_m = (c * along_first - along_second) / s2;
  at->across = (1.0 / at->sine) * normal;
  at->miss_m = std::fabs(dot(at->across, r_ECI));
  return true;
}

TangentPlane::TangentPlane(const Vec3& direction_ECI)
    : normal((1.0 / norm(direction_ECI)) * direction_ECI) {
  const Vec3 axis = std::fabs(normal[2]) < 0.7 ? vec3(0, 0, 1) : vec3(1, 0, 0);
  first = cross(axis, normal);
  first = (1.0 / norm(first)) * first;
  second = cross(normal, first);
}

Vector<2> TangentPlane::offset(const Vec3& towards) const {
  const double along = dot(normal, towards);
  Vector<2> z;
  // Behind the plane the tangent would mirror it: there the angle itself is what counts.
  const double across = std::hypot(dot(first, towards), dot(second, towards));
  const double scale = along > 0.0 ? 1.0 / along : std::atan2(across, along) / across;
  z[0] = scale * dot(first, towards);
  z[1] = scale * dot(second, towards);
  return z;
}

Matrix<2, 2> TangentPlane::spread(const Mat3& covariance, double length) const {
  const Vec3 axes[2] = {first, second};
  Matrix<2, 2> variances;
  for (int r = 0; r < 2; ++r) {
    for (int c = 0; c < 2; ++c) {
      variances(r, c) = dot(axes[r], covariance * axes[c]) / (length * length);
    }
  }
  return variances;
}

}  // namespace rpo_kit
