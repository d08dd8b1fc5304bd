/// When two radios can hear each other: range, the Earth between them, the antennas' beams.
#pragma once

#include <orrery/models/frames/vector.hpp>

namespace orrery {

/// Limits of a link. The defaults limit nothing, and then no orbit is asked for.
struct LinkVisibility {
  double max_range_m = 0;             // 0: no limit
  bool earth_occludes = false;        // the line of sight must clear the Earth
  double grazing_altitude_m = 100e3;  // by this much, 0 to 1000 km: atmosphere
  double beam_half_angle_rad = 0;     // of each antenna, below pi; 0: sees everywhere
  Vec3 boresight_from_B = {0, 0, 1};  // of the sender's antenna in its body axes
  Vec3 boresight_to_B = {0, 0, 1};    // of the receiver's

  bool is_limited() const { return max_range_m > 0 || earth_occludes || beam_half_angle_rad > 0; }
};

/// Both ends at one instant.
struct LinkGeometry {
  Vec3 r_from_ECI, r_to_ECI;  // [m]
  Mat3 R_BI_from, R_BI_to;    // f_B = R_BI f_ECI
};

enum class LinkObstacle { kNone, kRange, kEarth, kBeam };

/// The first obstacle in the order of LinkObstacle.
///
/// Method  The line of sight clears the Earth if its point nearest to the centre lies not between
///         the ends, or above the equatorial radius plus the grazing altitude (a sphere: a GNC
///         convention, up to 21 km cautious over the poles). A beam is a cone about the boresight;
///         both antennas must have the other end in theirs.
LinkObstacle obstacle(const LinkGeometry& geometry, const LinkVisibility& limits);

/// Lowest altitude of the segment between two points above the equatorial radius [m].
double grazing_altitude_m(const Vec3& a_ECI, const Vec3& b_ECI);

/// @throws std::invalid_argument  a limit outside its range, a boresight without direction.
void check(const LinkVisibility& limits);

}  // namespace orrery
