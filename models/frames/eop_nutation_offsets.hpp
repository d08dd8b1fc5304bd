/// From corrections to the IAU 2000A/2006 pole to corrections of the IAU 1980 nutation. Not
/// installed.
#pragma once

#include <orrery/models/frames/time_scales.hpp>

namespace orrery::eop {

struct NutationOffsets {
  double dpsi_rad = 0, deps_rad = 0;
};

/// The dPsi, dEps with which IAU 1976 precession and IAU 1980 nutation put the celestial pole where
/// IAU 2006/2000A puts it with dX, dY, both models from ERFA, by exact geometry: the two chains to
/// ITRF then agree within 0.002 mas. The frame bias of the pole is in the result, as it is in what
/// the IERS publishes, from which it differs by up to 0.2 mas (1980-2025).
NutationOffsets offsets_to_iau1980(const JulianDate& tt, double dX_rad, double dY_rad);

}  // namespace orrery::eop
