/// Latitude, longitude and height above the WGS 84 ellipsoid.
#pragma once

#include <orrery/models/frames/vector.hpp>

namespace orrery {

struct Geodetic {
  double latitude_rad = 0;   // north positive
  double longitude_rad = 0;  // east positive, (-pi, pi]
  double height_m = 0;
};

/// Fukushima, J. Geod. 79, 2006 (eraGc2gd): latitude within 1e-12 rad up to 1000 km, 5e-11 rad
/// (1 mm) at geostationary heights. @throws std::domain_error  not finite.
Geodetic to_geodetic(const Vec3& r_ECEF);
/// @throws std::domain_error  |latitude| > pi/2, or not finite.
Vec3 to_ECEF(const Geodetic& place);

}  // namespace orrery
