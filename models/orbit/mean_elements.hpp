/// Mean elements: osculating ones without the short-period oscillation caused by J2.
#pragma once

#include <orrery/models/orbit/elements.hpp>

namespace orrery {

struct OblateBody {
  double mu_m3ps2 = kMuEarth_m3ps2;
  double radius_m = kRadiusEarth_m;
  double J2 = kJ2Earth;
};

/// Method     First order in J2, exact in eccentricity and inclination: osculating = mean + {mean,
/// S},
///            with S the short-period generating function of Brouwer, AJ 64 (1959), and the Poisson
///            brackets of the quasi-nonsingular elements, so nothing is singular at e = 0 (the
///            purpose of Lyddane, AJ 68 (1963)). Long-period terms (J2^2/J2, J3) stay in the mean
///            elements.
/// Error      Second order: J2^2 a, some metres, nearly the same for two spacecraft side by side.
/// Valid for  e below about 0.1, sin i not 0. Angles keep their count of turns.
/// Checked by test_suites/validation/models/orbit/mean_elements_test.cpp
/// @throws std::invalid_argument  as in elements.hpp; also sin i = 0.
QuasiNonsingularElements mean_to_osculating(const QuasiNonsingularElements& mean,
                                            const OblateBody& body = {});
/// The inverse of mean_to_osculating, by fixed-point iteration to round-off.
QuasiNonsingularElements osculating_to_mean(const QuasiNonsingularElements& osculating,
                                            const OblateBody& body = {});

/// Secular rates of mean elements, first order in J2 [rad/s].
struct SecularRates {
  double raan = 0;
  double argument_of_perigee = 0;
  double u = 0;  // of the mean argument of latitude, Keplerian motion included
};
SecularRates secular_rates(const QuasiNonsingularElements& mean, const OblateBody& body = {});

/// Mean elements after `dt_s` seconds of secular motion; angles are not wrapped.
QuasiNonsingularElements propagate_secular(const QuasiNonsingularElements& mean, double dt_s,
                                           const OblateBody& body = {});

}  // namespace orrery
