#include <orrery/harness/kernel/text.hpp>
#include <orrery/models/orbit/earth.hpp>
#include <orrery/models/radio/link_geometry.hpp>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace orrery {
namespace {

bool in_beam(const Mat3& R_BI, const Vec3& boresight_B, const Vec3& direction_ECI,
             double half_angle_rad) {
  const Vec3 direction_B = R_BI * direction_ECI;
  const double angle_rad =
      std::atan2(norm(cross(boresight_B, direction_B)), dot(boresight_B, direction_B));
  return angle_rad <= half_angle_rad;
}

void require(bool ok, const std::string& name, double value, const char* accepted) {
  if (ok) return;
  throw std::invalid_argument("LinkVisibility: " + name + " = " + to_text(value) +
                              "; accepted: " + accepted);
}

}  // namespace

double grazing_altitude_m(const Vec3& a_ECI, const Vec3& b_ECI) {
  const Vec3 along = b_ECI - a_ECI;
  const double length2 = dot(along, along);
  // Share of the way from a to b at which the line is nearest to the Earth's centre.
  const double share = length2 > 0 ? std::clamp(-dot(a_ECI, along) / length2, 0.0, 1.0) : 0;
  return norm(a_ECI + share * along) - kRadiusEarth_m;
}

LinkObstacle obstacle(const LinkGeometry& ends, const LinkVisibility& limits) {
  const Vec3 d_ECI = ends.r_to_ECI - ends.r_from_ECI;
  if (limits.max_range_m > 0 && !(norm(d_ECI) <= limits.max_range_m)) return LinkObstacle::kRange;
  if (limits.earth_occludes &&
      grazing_altitude_m(ends.r_from_ECI, ends.r_to_ECI) < limits.grazing_altitude_m) {
    return LinkObstacle::kEarth;
  }
  const double half_angle_rad = limits.beam_half_angle_rad;
  if (half_angle_rad > 0 &&
      !(in_beam(ends.R_BI_from, limits.boresight_from_B, d_ECI, half_angle_rad) &&
        in_beam(ends.R_BI_to, limits.boresight_to_B, -d_ECI, half_angle_rad))) {
    return LinkObstacle::kBeam;
  }
  return LinkObstacle::kNone;
}

void check(const LinkVisibility& limits) {
  constexpr double kPi = 3.14159265358979323846;
  require(limits.max_range_m >= 0, "max_range_m", limits.max_range_m, "0 (no limit) or more");
  require(limits.grazing_altitude_m >= 0 && limits.grazing_altitude_m <= 1e6, "grazing_altitude_m",
          limits.grazing_altitude_m, "0 to 1e6 m");
  require(limits.beam_half_angle_rad >= 0 && limits.beam_half_angle_rad < kPi,
          "beam_half_angle_rad", limits.beam_half_angle_rad, "0 (sees everywhere) to below pi");
  for (const Vec3& boresight_B : {limits.boresight_from_B, limits.boresight_to_B}) {
    const double length = norm(boresight_B);
    require(length > 0 && std::isfinite(length), "length of a boresight", length, "above 0");
  }
}

}  // namespace orrery
