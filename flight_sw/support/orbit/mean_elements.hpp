/// Orbital elements, osculating and mean, and the secular motion of the mean ones under J2.
///
/// Elements    Quasi-nonsingular: a, u = omega + M, ex = e cos omega, ey = e sin omega, i, RAAN, in
///             EME2000. Singular at i = 0 and 180 deg only.
/// Mean        The osculating elements less their short-period variation by J2, first order, zero
///             mean over M (the convention of Brouwer 1959). The variation is the integral of
///             Gauss's equations along the mean orbit, less its average: a sum over equally spaced
///             points of one turn, which for a periodic function converges faster than any power of
///             their number. That keeps all powers of the eccentricity, where the usual
///             near-circular series drop e^2.
/// Valid for   e < 0.05; there 16 points reach 1e-4 of the variation. Left out are J2^2 (metres,
///             but common to both spacecraft of a formation) and all higher harmonics.
/// Checked by  test_suites/unit/flight_sw/mean_elements_test.cpp
#pragma once

#include "earth_rotation.hpp"

namespace flight_support {

struct OrbitElements {
  double a_m = 0.0;
  double u_rad = 0.0;  ///< mean argument of latitude, in [0, 2 pi)
  double ex = 0.0, ey = 0.0;
  double i_rad = 0.0, raan_rad = 0.0;
};

/// The angle in [-pi, pi).
double wrap_pi(double angle_rad);
/// The angle in [0, 2 pi).
double wrap_two_pi(double angle_rad);

double mean_motion_radps(double a_m);
/// True argument of latitude, omega + nu [rad].
double true_argument_of_latitude_rad(const OrbitElements& elements);

OrbitElements osculating_from_state(const StateEci& state);
StateEci state_from_osculating(const OrbitElements& osculating);

OrbitElements mean_from_osculating(const OrbitElements& osculating);
OrbitElements osculating_from_mean(const OrbitElements& mean);

/// Rates of u, argument of perigee and RAAN of a mean orbit under J2, first order [rad/s].
struct SecularRates {
  double u_radps, perigee_radps, raan_radps;
};
SecularRates secular_rates(const OrbitElements& mean);

/// The mean elements `dt_s` later (or earlier).
OrbitElements propagate_mean(const OrbitElements& mean, double dt_s);

}  // namespace flight_support
