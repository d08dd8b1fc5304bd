#include <orrery/models/orbit/elements.hpp>

#include <cmath>
#include <stdexcept>
#include <string>

namespace orrery {
namespace {

constexpr double kPi = 3.141592653589793;
constexpr double kTwoPi = 6.283185307179586;
constexpr double kNodeTolerance_rad = 1e-9;  // the node of a plane nearer to the equator is noise

void require(bool ok, const char* where, const std::string& name, double value,
             const std::string& accepted) {
  if (ok) return;
  throw std::invalid_argument(std::string(where) + ": " + name + " = " + std::to_string(value) +
                              "; accepted: " + accepted);
}

void require_ellipse(const QuasiNonsingularElements& x, const char* where) {
  require(std::isfinite(x.a_m) && x.a_m > 0, where, "semi-major axis [m]", x.a_m,
          "above 0, finite");
  const double e = std::sqrt(x.ex * x.ex + x.ey * x.ey);
  require(e < 1, where, "eccentricity", e, "0 <= e < 1");
  require(x.i_rad >= 0 && x.i_rad <= kPi, where, "inclination [rad]", x.i_rad, "0 to pi");
  require(std::isfinite(x.raan_rad), where, "raan [rad]", x.raan_rad, "finite");
  require(std::isfinite(x.u_rad), where, "argument of latitude [rad]", x.u_rad, "finite");
}

void require_ellipse(const KeplerianElements& k, const char* where) {
  require(k.e >= 0 && k.e < 1, where, "eccentricity", k.e, "0 <= e < 1");
  require(std::isfinite(k.argument_of_perigee_rad), where, "argument of perigee [rad]",
          k.argument_of_perigee_rad, "finite");
}

// In the orbit plane, x towards the ascending node.
struct PlanarState {
  double x, y, vx, vy;
};

PlanarState planar_state(const QuasiNonsingularElements& e, double mu_m3ps2) {
  const OrbitPoint at = solve_kepler(e);
  const double eta = std::sqrt(1 - e.ex * e.ex - e.ey * e.ey);
  const double speed = std::sqrt(mu_m3ps2 / e.a_m) / eta;
  return {at.r_m * at.cos_theta, at.r_m * at.sin_theta, -speed * (at.sin_theta + e.ey),
          speed * (at.cos_theta + e.ex)};
}

// Mean argument of latitude of a true one.
double mean_argument(double ex, double ey, double theta) {
  const double eta = std::sqrt(1 - ex * ex - ey * ey);
  const double beta = 1 / (1 + eta);
  const double c = std::cos(theta), s = std::sin(theta);
  const double r_over_a = eta * eta / (1 + ex * c + ey * s);
  const double e_sin_E = r_over_a * (ex * s - ey * c) / eta;
  const double cos_F = r_over_a * c + ex - beta * ey * e_sin_E;
  const double sin_F = r_over_a * s + ey + beta * ex * e_sin_E;
  return std::atan2(sin_F, cos_F) - ex * sin_F + ey * cos_F;
}

}  // namespace

double wrap_to_pi(double angle_rad) {
  const double wrapped = std::remainder(angle_rad, kTwoPi);
  return wrapped <= -kPi ? kPi : wrapped;
}

double wrap_to_two_pi(double angle_rad) {
  const double wrapped = std::remainder(angle_rad, kTwoPi);
  return wrapped < 0 ? wrapped + kTwoPi : wrapped;
}

OrbitPoint solve_kepler(const QuasiNonsingularElements& e) {
  // u is wrapped first: sine and cosine of many turns would lose digits in Newton's differences.
  const double u = std::remainder(e.u_rad, kTwoPi);
  double F = u + e.ex * std::sin(u) - e.ey * std::cos(u);
  double s = std::sin(F), c = std::cos(F);
  for (int iteration = 0; iteration < 50; ++iteration) {
    const double step = (u - F + e.ex * s - e.ey * c) / (1 - e.ex * c - e.ey * s);
    F += step;
    s = std::sin(F);
    c = std::cos(F);
    if (std::abs(step) < 1e-9) break;  // quadratic: the next step would be below 1e-17
  }
  const double beta = 1 / (1 + std::sqrt(1 - e.ex * e.ex - e.ey * e.ey));
  const double r_over_a = 1 - e.ex * c - e.ey * s;
  const double x = c - e.ex + beta * e.ey * (e.ex * s - e.ey * c);
  const double y = s - e.ey - beta * e.ex * (e.ex * s - e.ey * c);
  return {e.a_m * r_over_a, y / r_over_a, x / r_over_a, s, c};
}

QuasiNonsingularElements to_quasi_nonsingular(const KeplerianElements& k) {
  require_ellipse(k, "to_quasi_nonsingular");
  const QuasiNonsingularElements x{k.a_m,
                                   k.e * std::cos(k.argument_of_perigee_rad),
                                   k.e * std::sin(k.argument_of_perigee_rad),
                                   k.i_rad,
                                   k.raan_rad,
                                   k.argument_of_perigee_rad + k.mean_anomaly_rad};
  require_ellipse(x, "to_quasi_nonsingular");
  return x;
}

KeplerianElements to_keplerian(const QuasiNonsingularElements& x) {
  require_ellipse(x, "to_keplerian");
  const double omega = wrap_to_two_pi(std::atan2(x.ey, x.ex));
  return {x.a_m, std::sqrt(x.ex * x.ex + x.ey * x.ey), x.i_rad, x.raan_rad,
          omega, wrap_to_two_pi(x.u_rad - omega)};
}

InertialState to_inertial(const QuasiNonsingularElements& e, double mu_m3ps2) {
  require_ellipse(e, "to_inertial");
  const PlanarState s = planar_state(e, mu_m3ps2);
  const double ci = std::cos(e.i_rad), si = std::sin(e.i_rad);
  const double cO = std::cos(e.raan_rad), sO = std::sin(e.raan_rad);
  const Vec3 node{cO, sO, 0}, ahead{-sO * ci, cO * ci, si};  // axes of the orbit plane
  return {s.x * node + s.y * ahead, s.vx * node + s.vy * ahead};
}

InertialState to_inertial(const KeplerianElements& elements, double mu_m3ps2) {
  return to_inertial(to_quasi_nonsingular(elements), mu_m3ps2);
}

QuasiNonsingularElements to_quasi_nonsingular(const InertialState& state, double mu_m3ps2) {
  constexpr const char* kWhere = "to_quasi_nonsingular";
  const double r = norm(state.r_ECI);
  const Vec3 h = cross(state.r_ECI, state.v_ECI);
  require(std::isfinite(r) && norm(h) > 0, kWhere, "|r x v| [m^2/s]", norm(h), "above 0, finite");
  const double a = 1 / (2 / r - dot(state.v_ECI, state.v_ECI) / mu_m3ps2);
  require(a > 0 && std::isfinite(a), kWhere, "semi-major axis [m]", a, "above 0 (an ellipse)");

  const Vec3 W = unit(h);
  const double sin_i = std::sqrt(W.x * W.x + W.y * W.y);
  const double i = std::atan2(sin_i, W.z);
  require(sin_i > kNodeTolerance_rad, kWhere, "inclination [rad]", i,
          "1e-9 to pi - 1e-9 (the node of an equatorial orbit is undefined)");
  const Vec3 node = Vec3{-W.y, W.x, 0} / sin_i;
  const Vec3 ahead = cross(W, node);

  const Vec3 e = cross(state.v_ECI, h) / mu_m3ps2 - state.r_ECI / r;
  const double ex = dot(e, node), ey = dot(e, ahead);
  require(ex * ex + ey * ey < 1, kWhere, "eccentricity", std::sqrt(ex * ex + ey * ey),
          "0 <= e < 1");
  const double theta = std::atan2(dot(state.r_ECI, ahead), dot(state.r_ECI, node));
  return {a,
          ex,
          ey,
          i,
          wrap_to_two_pi(std::atan2(node.y, node.x)),
          wrap_to_two_pi(mean_argument(ex, ey, theta))};
}

KeplerianElements to_keplerian(const InertialState& state, double mu_m3ps2) {
  return to_keplerian(to_quasi_nonsingular(state, mu_m3ps2));
}

void require_above_ground(const QuasiNonsingularElements& e, const char* where) {
  require_ellipse(e, where);
  const double perigee_m = e.a_m * (1 - std::sqrt(e.ex * e.ex + e.ey * e.ey));
  require(perigee_m >= kRadiusEarth_m, where, "orbit below the ground: perigee radius [m]",
          perigee_m, "at least " + std::to_string(kRadiusEarth_m) + " m");
}

}  // namespace orrery
