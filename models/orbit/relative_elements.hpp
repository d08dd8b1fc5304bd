/// Relative orbital elements of a deputy with respect to a chief.
#pragma once

#include <orrery/models/orbit/elements.hpp>

namespace orrery {

/// Quasi-nonsingular relative elements, dimensionless; times the chief's a they are metres.
///   da = (a_d - a_c)/a_c            dl = (u_d - u_c) + (raan_d - raan_c) cos i_c
///   dex, dey = e_d - e_c            dix = i_d - i_c, diy = (raan_d - raan_c) sin i_c
/// S. D'Amico, Autonomous Formation Flying in Low Earth Orbit, TU Delft 2010.
/// Mean elements (mean_elements.hpp) for planning and for reporting; the osculating ones oscillate.
struct RelativeElements {
  double da = 0, dl = 0, dex = 0, dey = 0, dix = 0, diy = 0;

  friend RelativeElements operator*(double s, const RelativeElements& x) {
    return {s * x.da, s * x.dl, s * x.dex, s * x.dey, s * x.dix, s * x.diy};
  }
  friend RelativeElements operator-(const RelativeElements& a, const RelativeElements& b) {
    return {a.da - b.da, a.dl - b.dl, a.dex - b.dex, a.dey - b.dey, a.dix - b.dix, a.diy - b.diy};
  }
};

/// Differences of angles are taken to (-pi, pi] before anything else, wherever the two counts
/// start.
RelativeElements relative_elements(const QuasiNonsingularElements& chief,
                                   const QuasiNonsingularElements& deputy);

/// The deputy that has these relative elements: the exact inverse.
/// @throws std::invalid_argument  sin i_c = 0, or a deputy that is not on an ellipse.
QuasiNonsingularElements deputy_elements(const QuasiNonsingularElements& chief,
                                         const RelativeElements& relative);

/// Smallest distance in the radial/cross-track plane over a revolution, for da = 0 and without
/// perturbations [units of the elements]: D'Amico & Montenbruck, JGCD 29(3) 2006.
double minimum_radial_normal_distance(const RelativeElements& relative);

}  // namespace orrery
