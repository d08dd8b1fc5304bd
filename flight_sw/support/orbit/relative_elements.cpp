#include "relative_elements.hpp"

#include <cmath>

#include "constants.hpp"

namespace flight_support {

RelativeElements relative_elements(const OrbitElements& chief, const OrbitElements& deputy) {
  const double draan = wrap_pi(deputy.raan_rad - chief.raan_rad);
  RelativeElements a_roe;
  a_roe[kDa] = deputy.a_m - chief.a_m;
  a_roe[kDl] = chief.a_m * (wrap_pi(deputy.u_rad - chief.u_rad) + draan * std::cos(chief.i_rad));
  a_roe[kDex] = chief.a_m * (deputy.ex - chief.ex);
  a_roe[kDey] = chief.a_m * (deputy.ey - chief.ey);
  a_roe[kDix] = chief.a_m * (deputy.i_rad - chief.i_rad);
  a_roe[kDiy] = chief.a_m * draan * std::sin(chief.i_rad);
  return a_roe;
}

OrbitElements apply_relative_elements(const OrbitElements& chief, const RelativeElements& a_roe) {
  const double a_m = chief.a_m;
  const double draan = a_roe[kDiy] / (a_m * std::sin(chief.i_rad));
  OrbitElements deputy;
  deputy.a_m = a_m + a_roe[kDa];
  deputy.u_rad = wrap_two_pi(chief.u_rad + a_roe[kDl] / a_m - draan * std::cos(chief.i_rad));
  deputy.ex = chief.ex + a_roe[kDex] / a_m;
  deputy.ey = chief.ey + a_roe[kDey] / a_m;
  deputy.i_rad = chief.i_rad + a_roe[kDix] / a_m;
  deputy.raan_rad = wrap_two_pi(chief.raan_rad + draan);
  return deputy;
}

// Koenig, Guffanti & D'Amico (2017), eq. for quasi-nonsingular ROE under J2; their symbols.
Matrix6 state_transition(const OrbitElements& chief, double dt_s) {
  const double e2 = chief.ex * chief.ex + chief.ey * chief.ey;
  const double eta = std::sqrt(1.0 - e2);
  const double n = mean_motion_radps(chief.a_m);
  const double ratio = kRadiusEarth_m / chief.a_m;
  const double kappa = 0.75 * kJ2 * ratio * ratio * n / (eta * eta * eta * eta);
  const double ci = std::cos(chief.i_rad), si = std::sin(chief.i_rad);
  const double E = 1.0 + eta, F = 4.0 + 3.0 * eta, G = 1.0 / (eta * eta);
  const double P = 3.0 * ci * ci - 1.0, Q = 5.0 * ci * ci - 1.0, S = 2.0 * si * ci, T = si * si;
  const double turn = kappa * Q * dt_s;
  const double c = std::cos(turn), s = std::sin(turn);
  const double exi = chief.ex, eyi = chief.ey;
  const double exf = exi * c - eyi * s, eyf = exi * s + eyi * c;
  const double k = kappa * dt_s;
  return Matrix6{{
      {1, 0, 0, 0, 0, 0},
      {-1.5 * n * dt_s - 3.5 * k * E * P, 1, k * exi * F * G * P, k * eyi * F * G * P, -k * F * S,
       0},
      {3.5 * k * eyf * Q, 0, c - 4 * k * exi * eyf * G * Q, -s - 4 * k * eyi * eyf * G * Q,
       5 * k * eyf * S, 0},
      {-3.5 * k * exf * Q, 0, s + 4 * k * exi * exf * G * Q, c + 4 * k * eyi * exf * G * Q,
       -5 * k * exf * S, 0},
      {0, 0, 0, 0, 1, 0},
      {3.5 * k * S, 0, -4 * k * exi * G * S, -4 * k * eyi * G * S, 2 * k * T, 1},
  }};
}

Matrix<6, 3> control_input(const OrbitElements& orbit) {
  const double theta = true_argument_of_latitude_rad(orbit);
  const double s = std::sin(theta), c = std::cos(theta);
  const double ex = orbit.ex, ey = orbit.ey;
  const double eta = std::sqrt(1.0 - ex * ex - ey * ey);
  const double e_cos_nu = ex * c + ey * s, e_sin_nu = ex * s - ey * c;
  const double k = 1.0 + e_cos_nu;
  const double tan_i = std::tan(orbit.i_rad);
  const Matrix<6, 3> scaled{{
      {2 * e_sin_nu / eta, 2 * k / eta, 0},
      {-2 * eta * eta / k, 0, 0},
      {eta * s, eta * ((2 + e_cos_nu) * c + ex) / k, eta * ey * s / (k * tan_i)},
      {-eta * c, eta * ((2 + e_cos_nu) * s + ey) / k, -eta * ex * s / (k * tan_i)},
      {0, 0, eta * c / k},
      {0, 0, eta * s / k},
  }};
  return (1.0 / mean_motion_radps(orbit.a_m)) * scaled;
}

Matrix6 rtn_from_relative_elements(double u_rad, double n) {
  const double s = std::sin(u_rad), c = std::cos(u_rad);
  return Matrix6{{
      {1, 0, -c, -s, 0, 0},
      {0, 1, 2 * s, -2 * c, 0, 0},
      {0, 0, 0, 0, s, -c},
      {0, 0, n * s, -n * c, 0, 0},
      {-1.5 * n, 0, 2 * n * c, 2 * n * s, 0, 0},
      {0, 0, 0, 0, n * c, n * s},
  }};
}

// The inverse of the map above, with vx = vx_ECI + n y and vy = vy_ECI - n x put in.
Matrix6 relative_elements_from_inertial_rtn(double u_rad, double n) {
  const double s = std::sin(u_rad), c = std::cos(u_rad);
  return Matrix6{{
      {2, 0, 0, 0, 2 / n, 0},
      {0, -1, 0, -2 / n, 0, 0},
      {c, s, 0, s / n, 2 * c / n, 0},
      {s, -c, 0, -c / n, 2 * s / n, 0},
      {0, 0, s, 0, 0, c / n},
      {0, 0, -c, 0, 0, s / n},
  }};
}

double minimum_radial_normal_m(const RelativeElements& a_roe) {
  // 64 points miss the minimum of an ellipse of 300 m by less than 0.4 m.
  constexpr int kSamples = 64;
  double smallest2 = INFINITY;
  for (int k = 0; k < kSamples; ++k) {
    const double u = kTwoPi * k / kSamples;
    const double s = std::sin(u), c = std::cos(u);
    const double x = a_roe[kDa] - a_roe[kDex] * c - a_roe[kDey] * s;
    const double z = a_roe[kDix] * s - a_roe[kDiy] * c;
    smallest2 = std::fmin(smallest2, x * x + z * z);
  }
  return std::sqrt(smallest2);
}

Mat3 eci_to_rtn(const StateEci& state) {
  const Vec3 h = cross(state.r_ECI, state.v_ECI);
  const Vec3 radial = (1.0 / norm(state.r_ECI)) * state.r_ECI;
  const Vec3 normal = (1.0 / norm(h)) * h;
  const Vec3 along = cross(normal, radial);
  Mat3 R_HI;
  for (int k = 0; k < 3; ++k) {
    R_HI(0, k) = radial[k];
    R_HI(1, k) = along[k];
    R_HI(2, k) = normal[k];
  }
  return R_HI;
}

RelativeStateRtn relative_state_rtn(const StateEci& chief, const StateEci& deputy) {
  const Mat3 R_HI = eci_to_rtn(chief);
  const double r2 = dot(chief.r_ECI, chief.r_ECI);
  // RTN turns about N at h / r^2; its turn about R, by J2, is 1e-3 of that and comes from the
  // force, not from the state, so it is left out here as everywhere.
  const Vec3 omega_HI_H = vec3(0.0, 0.0, norm(cross(chief.r_ECI, chief.v_ECI)) / r2);
  const Vec3 r_DC_RTN = R_HI * (deputy.r_ECI - chief.r_ECI);
  const Vec3 v_DC_RTN = R_HI * (deputy.v_ECI - chief.v_ECI) - cross(omega_HI_H, r_DC_RTN);
  return {r_DC_RTN, v_DC_RTN};
}

}  // namespace flight_support
