#include "rpo_kit/guidance/sun_angle.hpp"

#include <algorithm>
#include <cmath>

#include "rpo_kit/guidance/safe_orbits.hpp"
#include "support/orbit/constants.hpp"

namespace rpo_kit {
namespace {

using namespace flight_support;

double angle_rad(const Vec3& a, const Vec3& b) {
  return std::atan2(norm(cross(a, b)), dot(a, b));
}

bool in_shadow(const Vec3& r_ECI, const Vec3& sun_ECI) {
  const double along = dot(r_ECI, sun_ECI);
  return along < 0.0 && norm(r_ECI - along * sun_ECI) < kRadiusEarth_m;
}

}  // namespace

bool may_look(const StateEci& target, const Vec3& r_CT_ECI, const Vec3& sun_ECI,
              const SunAngleOptions& options) {
  if (in_shadow(target.r_ECI, sun_ECI)) return false;
  const Vec3 line_of_sight = -1.0 * r_CT_ECI;
  if (angle_rad(line_of_sight, sun_ECI) < options.exclusion_rad) return false;
  if (angle_rad(r_CT_ECI, sun_ECI) > options.phase_rad) return false;
  if (options.limb_rad <= 0.0) return true;
  const Vec3 chaser = target.r_ECI + r_CT_ECI;
  const double limb = std::asin(std::min(1.0, kRadiusEarth_m / norm(chaser)));
  return angle_rad(line_of_sight, -1.0 * chaser) - limb > options.limb_rad;
}

double lit_fraction(const OrbitElements& target, const RelativeElements& a_roe, const Vec3& sun_ECI,
                    const SunAngleOptions& options) {
  constexpr int kSamples = 120;
  int lit = 0;
  for (int k = 0; k < kSamples; ++k) {
    OrbitElements at = target;
    at.u_rad = kTwoPi * k / kSamples;
    const StateEci state = state_from_osculating(at);
    const Vector<6> relative =
        rtn_from_relative_elements(at.u_rad, mean_motion_radps(at.a_m)) * a_roe;
    const Vec3 r_CT_ECI =
        transpose(eci_to_rtn(state)) * vec3(relative[0], relative[1], relative[2]);
    lit += may_look(state, r_CT_ECI, sun_ECI, options) ? 1 : 0;
  }
  return static_cast<double>(lit) / kSamples;
}

double best_phase_rad(const OrbitElements& target, double along_track_m, double radius_m,
                      const Vec3& sun_ECI, const SunAngleOptions& options) {
  constexpr int kPhases = 36;
  double best = -1.0, phase = 0.0;
  for (int k = 0; k < kPhases; ++k) {
    const double candidate = kTwoPi * k / kPhases;
    const double lit =
        lit_fraction(target, safe_orbit(along_track_m, radius_m, candidate), sun_ECI, options);
    if (lit > best) best = lit, phase = candidate;
  }
  return phase;
}

}  // namespace rpo_kit
