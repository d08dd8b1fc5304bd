#include <orrery/models/attitude/pointing.hpp>
#include <orrery/models/frames/rtn.hpp>

#include <cmath>
#include <stdexcept>

namespace orrery {
namespace {

// A unit vector and its derivative.
struct Direction {
  Vec3 unit_ECI, rate_ECI;
};

Direction direction(const Vec3& v, const Vec3& v_rate) {
  const double length = norm(v);
  const Vec3 u = v / length;
  return {u, (v_rate - dot(v_rate, u) * u) / length};
}

// Of axes x, y, z that turn: e' = omega x e, so omega = (x x x' + y x y' + z x z') / 2.
BodyAttitude attitude_of(const Direction& x, const Direction& y, const Direction& z) {
  const Mat3 R_BI{x.unit_ECI, y.unit_ECI, z.unit_ECI};
  const Vec3 omega_ECI = 0.5 * (cross(x.unit_ECI, x.rate_ECI) + cross(y.unit_ECI, y.rate_ECI) +
                                cross(z.unit_ECI, z.rate_ECI));
  return {R_BI, R_BI * omega_ECI};
}

}  // namespace

Mat3 turned(const BodyAttitude& attitude, double dt_s) {
  const double rate = norm(attitude.omega_BI_B);
  if (rate == 0) return attitude.R_BI;
  // What is fixed in inertial space turns backwards in body axes.
  const double half = -0.5 * rate * dt_s;
  const Vec3 v = std::sin(half) / rate * attitude.omega_BI_B;
  return to_matrix({std::cos(half), v.x, v.y, v.z}) * attitude.R_BI;
}

BodyAttitude zenith_pointing(const InertialState& state) {
  const Mat3 R_HI = rtn_axes(state);
  return {{R_HI.row_y, R_HI.row_z, R_HI.row_x}, {0, omega_HI_RTN(state).z, 0}};
}

BodyAttitude sun_pointing(const InertialState& state, const SunDirection& sun) {
  constexpr double kNoZenith = 1e-6;
  const Direction x = direction(sun.s_ECI, sun.rate_ECI);
  Direction up = direction(state.r_ECI, state.v_ECI);
  if (!is_finite(x.unit_ECI) || !is_finite(up.unit_ECI)) {
    throw std::domain_error("sun_pointing: r_ECI or the Sun's direction is zero or not finite");
  }
  if (norm(cross(x.unit_ECI, up.unit_ECI)) < kNoZenith) up = {rtn_axes(state).row_z, {}};
  const double along = dot(up.unit_ECI, x.unit_ECI);
  const double along_rate = dot(up.rate_ECI, x.unit_ECI) + dot(up.unit_ECI, x.rate_ECI);
  const Direction z = direction(up.unit_ECI - along * x.unit_ECI,
                                up.rate_ECI - along_rate * x.unit_ECI - along * x.rate_ECI);
  const Direction y{cross(z.unit_ECI, x.unit_ECI),
                    cross(z.rate_ECI, x.unit_ECI) + cross(z.unit_ECI, x.rate_ECI)};
  return attitude_of(x, y, z);
}

}  // namespace orrery
