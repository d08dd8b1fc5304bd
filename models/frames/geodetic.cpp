#include <orrery/models/frames/geodetic.hpp>

#include <erfa.h>
#include <erfam.h>

#include <stdexcept>
#include <string>

namespace orrery {

Geodetic to_geodetic(const Vec3& r_ECEF) {
  if (!is_finite(r_ECEF)) throw std::domain_error("to_geodetic: r_ECEF is not finite");
  double xyz[3] = {r_ECEF.x, r_ECEF.y, r_ECEF.z};
  Geodetic place;
  eraGc2gd(ERFA_WGS84, xyz, &place.longitude_rad, &place.latitude_rad, &place.height_m);
  return place;
}

Vec3 to_ECEF(const Geodetic& place) {
  constexpr double kHalfPi = 1.5707963267948966;
  if (!(std::abs(place.latitude_rad) <= kHalfPi) || !std::isfinite(place.longitude_rad) ||
      !std::isfinite(place.height_m)) {
    throw std::domain_error("to_ECEF: latitude = " + std::to_string(place.latitude_rad) +
                            " rad; accepted: finite, -pi/2 to pi/2");
  }
  double xyz[3] = {};
  eraGd2gc(ERFA_WGS84, place.longitude_rad, place.latitude_rad, place.height_m, xyz);
  return {xyz[0], xyz[1], xyz[2]};
}

}  // namespace orrery
