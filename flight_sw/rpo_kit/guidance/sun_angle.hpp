/// When the camera may look at the target, and where an inspection orbit should lie for it.
///
/// Conditions  The Sun at least `exclusion_rad` from the line of sight; the angle Sun - target -
///             chaser at most `phase_rad`, or the side that is seen is dark; the target outside the
///             Earth's shadow (a cylinder: the penumbra of 8 s at 550 km is left out); the Earth's
///             limb at least `limb_rad` from the line of sight.
/// Checked by  test_suites/unit/flight_sw/rpo_kit/guidance_test.cpp
#pragma once

#include "support/orbit/relative_elements.hpp"

namespace rpo_kit {

struct SunAngleOptions {
  double exclusion_rad = 0.52;  ///< 30 deg
  double phase_rad = 1.92;      ///< 110 deg
  double limb_rad = 0.0;        ///< 0: the Earth may be in the field
};

/// @param target  Position and velocity [ECI]. @param r_CT_ECI  Chaser less target [m].
/// @param sun_ECI  Unit vector to the Sun.
bool may_look(const flight_support::StateEci& target, const flight_support::Vec3& r_CT_ECI,
              const flight_support::Vec3& sun_ECI, const SunAngleOptions& options);

/// Part of a revolution in which the chaser may look, from a relative orbit that holds.
double lit_fraction(const flight_support::OrbitElements& target,
                    const flight_support::RelativeElements& a_roe,
                    const flight_support::Vec3& sun_ECI, const SunAngleOptions& options);

/// The phase of e and i vectors at which a safe orbit sees the target longest.
double best_phase_rad(const flight_support::OrbitElements& target, double along_track_m,
                      double radius_m, const flight_support::Vec3& sun_ECI,
                      const SunAngleOptions& options);

}  // namespace rpo_kit
