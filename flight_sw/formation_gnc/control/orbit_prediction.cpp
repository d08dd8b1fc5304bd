#include "formation_gnc/control/orbit_prediction.hpp"

#include <cmath>

#include "support/orbit/constants.hpp"

namespace formation_gnc {

using namespace flight_support;

namespace {

// GGM05S, unnormalised: J_n = -sqrt(2 n + 1) C_n0.
constexpr double kJ3 = -2.532491e-6;  // C30 = 9.571739577330e-7
constexpr double kJ4 = -1.619956e-6;  // C40 = 5.399853533873e-7

}  // namespace

// The gradient of mu/r (1 - sum J_n (R/r)^n P_n(s)), s = z/r: along r with (n+1) P_n + s P_n',
// along z with -P_n'.
Vec3 ZonalGravity::acceleration_ECI(std::int64_t, const Vec3& r) const {
  const double r2 = dot(r, r), d = std::sqrt(r2), s = r[2] / d, s2 = s * s;
  const double q = kRadiusEarth_m / d;
  const double p[3] = {0.5 * (3 * s2 - 1), 0.5 * s * (5 * s2 - 3),
                       0.125 * ((35 * s2 - 30) * s2 + 3)};
  const double slope[3] = {3 * s, 0.5 * (15 * s2 - 3), 0.5 * s * (35 * s2 - 15)};
  const double J[3] = {kJ2, kJ3, kJ4};
  double radial = 1.0, along_z = 0.0, power = q;
  for (int k = 0; k < 3; ++k) {
    power *= q;
    radial -= J[k] * power * ((k + 3) * p[k] + s * slope[k]);
    along_z -= J[k] * power * slope[k];
  }
  const double g = kMuEarth_m3ps2 / r2;
  return (-g * radial / d) * r + vec3(0.0, 0.0, g * along_z);
}

StateEci propagate(const GravityModel& gravity, const StateEci& state, std::int64_t from_ns,
                   std::int64_t to_ns, double longest_step_s) {
  const double span_s = seconds(to_ns - from_ns);
  const int steps = static_cast<int>(std::ceil(std::fabs(span_s) / longest_step_s - 1e-9));
  StateEci s = state;
  for (int k = 0; k < steps; ++k) {
    const double h = span_s / steps;
    const auto a = [&](double share, const Vec3& r) {
      return gravity.acceleration_ECI(from_ns + nanoseconds((k + share) * h), r);
    };
    const Vec3 v1 = s.v_ECI, a1 = a(0.0, s.r_ECI);
    const Vec3 v2 = s.v_ECI + 0.5 * h * a1, a2 = a(0.5, s.r_ECI + 0.5 * h * v1);
    const Vec3 v3 = s.v_ECI + 0.5 * h * a2, a3 = a(0.5, s.r_ECI + 0.5 * h * v2);
    const Vec3 v4 = s.v_ECI + h * a3, a4 = a(1.0, s.r_ECI + h * v3);
    s.r_ECI = s.r_ECI + (h / 6.0) * (v1 + 2.0 * v2 + 2.0 * v3 + v4);
    s.v_ECI = s.v_ECI + (h / 6.0) * (a1 + 2.0 * a2 + 2.0 * a3 + a4);
  }
  return s;
}

}  // namespace formation_gnc
