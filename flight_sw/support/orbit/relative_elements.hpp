/// Quasi-nonsingular relative orbital elements (ROE), how they drift and what impulses do to them.
///
/// Elements    a_roe = a_chief * (da, dl, dex, dey, dix, diy) [m], of mean elements: D'Amico
///             (2010), da = (a_D - a_C)/a_C, dl = u_D - u_C + (RAAN_D - RAAN_C) cos i_C, diy =
///             dRAAN sin i_C.
/// Drift       State transition matrix under J2 of Koenig, Guffanti & D'Amico, JGCD 40(7), 2017.
/// Impulses    Gauss's equations in these elements: RTN of the spacecraft that burns, [m/s] -> [m].
/// Valid for   separations far below a; the maps to and from RTN are for e < 0.01 (first order).
/// Checked by  test_suites/unit/flight_sw/relative_elements_test.cpp
#pragma once

#include "mean_elements.hpp"
#include "support/matrix.hpp"

namespace flight_support {

using RelativeElements = Vector<6>;
using Matrix6 = Matrix<6, 6>;
enum RelativeElement { kDa, kDl, kDex, kDey, kDix, kDiy };

/// a_roe [m] of the deputy relative to the chief, both mean (or both osculating).
RelativeElements relative_elements(const OrbitElements& chief, const OrbitElements& deputy);
/// The deputy's elements: the inverse of relative_elements().
OrbitElements apply_relative_elements(const OrbitElements& chief, const RelativeElements& a_roe);

/// Phi with a_roe(t + dt) = Phi a_roe(t), for the chief's mean elements at t.
Matrix6 state_transition(const OrbitElements& chief, double dt_s);

/// B with a_roe after = a_roe before + B dv_RTN, for a burn at the mean argument of latitude in
/// `orbit`.
Matrix<6, 3> control_input(const OrbitElements& orbit);

/// Deputy less chief in the chief's RTN [m, m/s], derivative taken in RTN, from a_roe: rows x_R,
/// y_T, z_N, vx, vy, vz. Near-circular and linear.
Matrix6 rtn_from_relative_elements(double u_rad, double n_radps);
/// a_roe from the difference of two inertial states in RTN components, the difference of velocities
/// taken in ECI: how measurement noise enters.
Matrix6 relative_elements_from_inertial_rtn(double u_rad, double n_radps);

/// Radial and cross-track distance never falls below this while the elements hold [m]: the smallest
/// norm of (x_R, z_N) over one revolution, along-track position disregarded. D'Amico & Montenbruck
/// (2006), sampled in u so that a*da may differ from zero.
double minimum_radial_normal_m(const RelativeElements& a_roe);

/// Unit vectors R, T, N as rows: R_HI, which turns ECI components into RTN components.
Mat3 eci_to_rtn(const StateEci& state);

/// Deputy relative to chief in the chief's RTN, derivative taken in RTN; exact.
struct RelativeStateRtn {
  Vec3 r_DC_RTN, v_DC_RTN;
};
RelativeStateRtn relative_state_rtn(const StateEci& chief, const StateEci& deputy);

}  // namespace flight_support
