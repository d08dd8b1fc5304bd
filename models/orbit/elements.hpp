/// Osculating orbital elements and Cartesian states.
#pragma once

#include <orrery/models/frames/frames.hpp>
#include <orrery/models/orbit/earth.hpp>
#include <orrery/models/orbit/force_model.hpp>

namespace orrery {

struct KeplerianElements {
  double a_m = 0;
  double e = 0;
  double i_rad = 0;
  double raan_rad = 0;
  double argument_of_perigee_rad = 0;
  double mean_anomaly_rad = 0;
};

/// Regular for circular orbits, singular for equatorial ones. ex = e cos(omega), ey = e sin(omega),
/// u = omega + M: the mean argument of latitude. Angles are not wrapped: a propagator may count
/// turns.
struct QuasiNonsingularElements {
  double a_m = 0;
  double ex = 0;
  double ey = 0;
  double i_rad = 0;
  double raan_rad = 0;
  double u_rad = 0;
};

// Every function here throws std::invalid_argument with the value and the accepted range for
// elements that are not finite, a <= 0, e >= 1 or i outside [0, pi].

QuasiNonsingularElements to_quasi_nonsingular(const KeplerianElements& elements);
/// omega and M in [0, 2 pi); omega = 0 for e = 0.
KeplerianElements to_keplerian(const QuasiNonsingularElements& elements);

InertialState to_inertial(const QuasiNonsingularElements& elements,
                          double mu_m3ps2 = kMuEarth_m3ps2);
InertialState to_inertial(const KeplerianElements& elements, double mu_m3ps2 = kMuEarth_m3ps2);

/// i in (0, pi), raan and u in [0, 2 pi).
/// @throws std::invalid_argument  not an ellipse (e >= 1), or an equatorial orbit (i within 1e-9
/// rad of
///         0 or pi), whose node is undefined.
QuasiNonsingularElements to_quasi_nonsingular(const InertialState& state,
                                              double mu_m3ps2 = kMuEarth_m3ps2);
KeplerianElements to_keplerian(const InertialState& state, double mu_m3ps2 = kMuEarth_m3ps2);

/// @throws std::invalid_argument  "orbit below the ground": the perigee a (1 - e) is below
///         kRadiusEarth_m. `where` names the caller in the message.
void require_above_ground(const QuasiNonsingularElements& elements, const char* where);

inline InertialState inertial_state(const OrbitState& state) {
  return {state.r_ECI, state.v_ECI};
}

/// True argument of latitude and what goes with it, from the mean one: Kepler's equation
/// F - ex sin F + ey cos F = u in nonsingular form, by Newton's method to 1e-15.
struct OrbitPoint {
  double r_m = 0;
  double sin_theta = 0, cos_theta = 0;  // theta: true argument of latitude
  double sin_F = 0, cos_F = 0;          // F: eccentric argument of latitude
};
OrbitPoint solve_kepler(const QuasiNonsingularElements& elements);

/// To (-pi, pi].
double wrap_to_pi(double angle_rad);
/// To [0, 2 pi).
double wrap_to_two_pi(double angle_rad);

}  // namespace orrery
