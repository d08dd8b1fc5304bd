/// A receiver in low orbit and a formulation of its own of what it must measure: everything in
/// inertial axes that coincide with ECEF at one instant, light time by plain iteration.
#pragma once

#include <orrery/models/gnss/constellation.hpp>
#include <orrery/models/gnss/signal_path.hpp>

#include <cmath>

namespace orrery {

inline const SimTime kSceneEpoch = gps_midnight(2025, 3, 20);
constexpr double kSceneOmega_radps = 7.2921151467e-5;  // IS-GPS-200
constexpr double kSceneLight_mps = 299792458;

/// A circular orbit of 550 km, inclined by 97.6 deg, in inertial axes.
struct LeoScene {
  double radius_m = 6928137, inclination_rad = 1.7034, node_rad = 0.4;
  double rate_radps = std::sqrt(3.986004415e14) / std::pow(6928137, 1.5);

  Vec3 r(double s) const {
    const double u = rate_radps * s;
    const Vec3 p{radius_m * std::cos(u), radius_m * std::sin(u) * std::cos(inclination_rad),
                 radius_m * std::sin(u) * std::sin(inclination_rad)};
    return {std::cos(node_rad) * p.x - std::sin(node_rad) * p.y,
            std::sin(node_rad) * p.x + std::cos(node_rad) * p.y, p.z};
  }
  Vec3 v(double s) const { return (1e2 / 2) * (r(s + 0.01) - r(s - 0.01)); }
};

/// Components in axes that have turned by `angle` about z, and back.
inline Vec3 turned(const Vec3& f, double angle) {
  return {std::cos(angle) * f.x + std::sin(angle) * f.y,
          -std::sin(angle) * f.x + std::cos(angle) * f.y, f.z};
}

/// The antenna `since` after kSceneEpoch, when inertial axes and ECEF coincide; it points to the
/// zenith with x along the track.
inline AntennaPlace antenna_at(const LeoScene& leo, Duration since) {
  const double s = to_seconds(since), angle = kSceneOmega_radps * s;
  const auto r_ECEF = [&](double x) { return turned(leo.r(x), kSceneOmega_radps * x); };
  AntennaPlace a;
  a.t = kSceneEpoch + since;
  a.r_ECEF = r_ECEF(s);
  const Vec3 omega{0, 0, kSceneOmega_radps};
  // Of uniform circular motion: v = n x r, a = -n^2 r, seen from turning axes.
  const Vec3 normal_I = unit(cross(leo.r(0), leo.r(100)));
  const Vec3 v_I = leo.rate_radps * cross(normal_I, leo.r(s));
  const Vec3 a_I = -leo.rate_radps * leo.rate_radps * leo.r(s);
  a.v_ECEF = turned(v_I, angle) - cross(omega, a.r_ECEF);
  a.a_ECEF = turned(a_I, angle) - 2 * cross(omega, a.v_ECEF) - cross(omega, cross(omega, a.r_ECEF));
  const Vec3 up = unit(a.r_ECEF), along = unit(turned(v_I, angle));
  const Vec3 x = unit(along - dot(along, up) * up);
  a.R_AE = {x, cross(up, x), up};
  return a;
}

/// What an ideal receiver measures of a satellite at true time kSceneEpoch + s.
struct ExactRange {
  double range_m, satellite_clock_s;
};

inline ExactRange exact_range(const GpsConstellation& gps, int prn, const LeoScene& leo, double s) {
  // The satellite's ECEF state carried by less than a second, to resolve instants below 1 ns.
  const auto at = [&](double x) {
    const auto ns = static_cast<std::int64_t>(std::floor(x * 1e9));
    return std::pair(*gps.exact(prn, kSceneEpoch + Duration(ns)),
                     x - 1e-9 * static_cast<double>(ns));
  };
  double transmit_s = s - 0.08;
  ExactRange out{};
  for (int i = 0; i < 12; ++i) {
    const auto [state, rest_s] = at(transmit_s);
    const Vec3 r_I = turned(state.r_ECEF + rest_s * state.v_ECEF, -kSceneOmega_radps * transmit_s);
    out.range_m = norm(r_I - leo.r(s));
    out.satellite_clock_s = state.clock_s + rest_s * state.clock_rate_sps;
    transmit_s = s - out.range_m / kSceneLight_mps;
  }
  return out;
}

}  // namespace orrery
