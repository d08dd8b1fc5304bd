/// The frames of Orrery, each defined once, and the step between the inertial and the Earth-fixed
/// one.
///
/// ECI    Origin: centre of the Earth. Axes: mean equator and equinox of J2000.0 (EME2000),
/// realised by
///        the IAU 1976 precession and IAU 1980 nutation models, without frame bias and without
///        observed corrections to the pole. Not GCRF: the two differ by some tens of
///        milliarcseconds.
/// ECEF   Origin: centre of the Earth. Axes: turning with the Earth, z along the true pole of date,
/// x in
///        the Greenwich meridian. Realised from ECI by R_EI = R3(GAST) N P with UT1 = UTC and no
///        polar motion (earth_orientation.hpp).
/// RTN    H in pairs. Origin: a spacecraft. R along its position, N along r x v, T completes; T is
///        along the velocity for a circular orbit (rtn.hpp). Derivatives of *_RTN vectors are taken
///        in RTN itself.
/// Body   B. Origin: the spacecraft's centre of mass; axes fixed in its structure
/// (models/attitude).
///
/// Vectors are named after the frame of their components; velocities are relative to the axes of
/// the same frame (v_ECEF is seen by an observer on the turning Earth).
#pragma once

#include <orrery/models/frames/vector.hpp>

namespace orrery {

struct InertialState {
  Vec3 r_ECI;  // [m]
  Vec3 v_ECI;  // [m/s]
};

struct EarthFixedState {
  Vec3 r_ECEF;  // [m]
  Vec3 v_ECEF;  // [m/s], relative to the turning Earth
};

/// v_ECEF = R_EI v_ECI - omega_EI x r_ECEF.
inline EarthFixedState to_earth_fixed(const InertialState& s, const Mat3& R_EI,
                                      const Vec3& omega_EI_ECEF) {
  const Vec3 r_ECEF = R_EI * s.r_ECI;
  return {r_ECEF, R_EI * s.v_ECI - cross(omega_EI_ECEF, r_ECEF)};
}

inline InertialState to_inertial(const EarthFixedState& s, const Mat3& R_EI,
                                 const Vec3& omega_EI_ECEF) {
  const Mat3 R_IE = transpose(R_EI);
  return {R_IE * s.r_ECEF, R_IE * (s.v_ECEF + cross(omega_EI_ECEF, s.r_ECEF))};
}

}  // namespace orrery
