/// States of orbit data messages in ECI, whatever frame they are written in.
#pragma once

#include <orrery/models/ccsds/oem_interpolation.hpp>
#include <orrery/models/ccsds/opm.hpp>
#include <orrery/models/frames/frames.hpp>

namespace orrery {

/// Frames  EME2000, J2000   as written: ECI.
///         GCRF, ICRF       by the frame bias of IAU 2000, a constant 23 mas: 0.8 m in low Earth
///                          orbit.
///         ITRF, of any year (they differ by centimetres)  by the Earth's attitude in `around`;
///                          without Earth orientation parameters it is some tens of metres off.
/// Centre  the Earth.
/// @throws std::invalid_argument  another centre or frame; names it, and those that are accepted.
InertialState to_inertial(const OdmMetadata& metadata, const Vec3& r_km, const Vec3& v_kmps,
                          const Surroundings& around);

/// REF_FRAME is ITRF of some year: to_inertial() looks at `around` for no other.
bool is_itrf(const OdmMetadata& metadata);

}  // namespace orrery
