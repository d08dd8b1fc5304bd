/// Gravity of the Earth by spherical harmonics, GGM05S to degree and order 20, at two points at
/// once.
///
/// Method      Cunningham's recursion, Montenbruck & Gill, Satellite Orbits (2000), section 3.2.4.
///             Both points go through the same operations in the two halves of a vector.
/// Frames      ECEF in, ECEF out. Central term included.
/// Data        Coefficients from models/data/ggm05s_d60.gfc, taken at build time.
/// Valid for   |r| above the reference radius.
/// Checked by  test_suites/unit/flight_sw/formation_gnc/orbit_pair_test.cpp
#pragma once

#include "support/matrix.hpp"

namespace formation_gnc {

constexpr int kGravityDegree = 20;

/// Accelerations [m/s^2] at r_ECEF [m]. @param degree  2 to kGravityDegree.
void gravity_ECEF(int degree, const flight_support::Vec3 r_ECEF[2], flight_support::Vec3 a_ECEF[2]);

}  // namespace formation_gnc
