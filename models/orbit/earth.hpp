/// The Earth's constants that orbits share.
#pragma once

#include <orrery/harness/kernel/simulator_only.hpp>

namespace orrery {

/// Of the point-mass attraction that the propagator carries itself (force_model.hpp).
constexpr double kMuEarth_m3ps2 = 3.986004415e14;  // GGM05S header
/// Reference radius of the gravity field, and "the ground" below which no orbit may go.
constexpr double kRadiusEarth_m = 6378136.3;  // GGM05S header
constexpr double kJ2Earth = 1.0826358e-3;     // -sqrt(5) C20 of GGM05S

}  // namespace orrery
