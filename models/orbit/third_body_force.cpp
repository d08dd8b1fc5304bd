#include <orrery/models/orbit/third_body_force.hpp>

#include <cmath>

namespace orrery {

Vec3 third_body_acceleration(const Vec3& r, const Vec3& s, double mu_m3ps2) {
  const double s2 = dot(s, s);
  const double q = dot(r, r - 2 * s) / s2;  // |s - r|^2 = |s|^2 (1 + q)
  const double root = std::sqrt(1 + q);
  const double cube = (1 + q) * root;  // |s - r|^3 / |s|^3
  const double F = q * (3 + q * (3 + q)) / (1 + cube);
  return -mu_m3ps2 / (s2 * std::sqrt(s2) * cube) * (r + F * s);
}

Vec3 ThirdBodyForce::acceleration_ECI(const OrbitState& state, const Surroundings& around) const {
  return body_ == Body::kSun
             ? third_body_acceleration(state.r_ECI, around.r_sun_ECI, kMuSun_m3ps2)
             : third_body_acceleration(state.r_ECI, around.r_moon_ECI, kMuMoon_m3ps2);
}

}  // namespace orrery
