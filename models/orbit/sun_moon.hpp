/// Where the Sun and the Moon are.
#pragma once

#include <orrery/harness/kernel/time.hpp>
#include <orrery/models/frames/vector.hpp>

namespace orrery {

// Short series for forces: Montenbruck & Gill, Satellite Orbits (2000), 3.3.2; geocentric,
// geometric, ECI [m]. Within 0.12 deg of the ephemerides over 2016-2029 (Sun 8e-3 %, Moon 0.13 % in
// distance): not for pointing. The Sun's error, 0.1 deg in 2029, grows by 0.0032 deg a year.
Vec3 sun_position_ECI(SimTime t);
Vec3 moon_position_ECI(SimTime t);

/// The same by centuries TT from J2000.0.
Vec3 sun_position_ECI(double centuries_TT);
Vec3 moon_position_ECI(double centuries_TT);

/// Unit vector to where the Sun is seen from the Earth's centre: eraEpv00, light time in the Sun's
/// motion neglected (0.01"), stellar aberration by the Earth's motion. Its axes are ICRS, which
/// EME2000 follows within 0.03".
Vec3 apparent_sun_direction_ECI(SimTime t);

/// Right ascension of that direction in ECI, [0, 2 pi). A node at this angle less 45 deg is crossed
/// at 09:00 apparent solar time.
double apparent_solar_right_ascension_rad(SimTime t);

}  // namespace orrery
