/// The orbits of both spacecraft and how they move between measurements.
///
/// Force       Gravity (flight_gravity.hpp) of both at once; empirical accelerations. Drag, Sun and
///             Moon are left to the empirical ones: 1e-6 m/s^2 against 2e-5 of omitted gravity.
/// Method      Runge-Kutta-Nystroem of order 4 in three stages (Nystroem 1925) in ECI. Transition
///             matrix from the gradient of central term and J2 at the middle of the step.
/// Accuracy    After 30 min 5 mm with steps of 10 s, 27 mm with 15 s, common to both spacecraft;
/// relative,
///             at 40 m, 2e-7 and 1e-6 m.
/// Checked by  test_suites/unit/flight_sw/formation_gnc/orbit_pair_test.cpp
#pragma once

#include <cstdint>

#include "formation_gnc/navigation/ud_factor.hpp"
#include "support/orbit/earth_rotation.hpp"

namespace formation_gnc {

using flight_support::Mat3;
using flight_support::Vec3;

struct OrbitPairOptions {
  int gravity_degree = 20;  ///< 2 to 20
  flight_support::EarthTime earth_time = {};
  double longest_step_s = 15.0;  ///< 1 to 30
};

/// Centres of mass, ECI; index by Who.
struct OrbitPair {
  Vec3 r[2], v[2];
  Vec3 empirical_RTN[2];  ///< [m/s^2]
};

/// R_IE `dt_s` later, up to minutes: the Earth turns, its axis does not.
Mat3 turned_with_earth(const Mat3& R_IE, double dt_s);

/// R_IE at an instant; exact every 2 min of GPS time, in between turned by the Earth's rate: a
/// function of the instant alone. Precession makes 1e-9 rad of the difference (6 mm at a LEO).
class EarthAttitude {
 public:
  Mat3 ecef_to_eci(std::int64_t t_ns, const flight_support::EarthTime& earth_time);

 private:
  std::int64_t base_ns_ = -1;
  Mat3 base_;
};

/// Columns R, T, N in ECI.
Mat3 rtn_to_eci(const Vec3& r, const Vec3& v);

/// Gravity at two positions, ECI, `R_IE` being the Earth's attitude then [m/s^2].
void gravity_ECI(const Mat3& R_IE, int degree, const Vec3 r[2], Vec3 a[2]);

/// Both orbits `dt_s` later (or earlier), without empirical accelerations; in equal steps of at
/// most longest_step_s. For control too: this is the filter's field.
void coast(OrbitPair* pair, std::int64_t t_ns, double dt_s, const OrbitPairOptions& options,
           EarthAttitude* earth);

/// Gradient of gravity, central term and J2 about the z axis of ECI [1/s^2].
Mat3 gravity_gradient(const Vec3& r);

/// Empirical acceleration of one orbit: first-order Gauss-Markov by axis of RTN. Where it is a slow
/// one, what changes faster is white noise beside it.
struct EmpiricalAcceleration {
  Vec3 sigma_mps2;   ///< steady state
  Vec3 tau_s;        ///< at least three steps each
  Vec3 white_m2ps3;  ///< spectral density
};

/// From the state at the middle of a step.
OrbitTransition orbit_transition(const Vec3& r_middle, const Vec3& v_middle, double dt_s,
                                 const Vec3& tau_s);
/// The same for empirical accelerations of other time constants.
OrbitTransition with_time_constants(const OrbitTransition& transition, const Mat3& R_IH,
                                    double dt_s, const Vec3& tau_s);

/// What empirical accelerations build up over |dt_s|.
OrbitNoise orbit_noise(const Mat3& R_IH, double dt_s, const EmpiricalAcceleration& empirical);

}  // namespace formation_gnc
