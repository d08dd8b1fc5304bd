/// A position and velocity solution, as formation keeping takes it from a BESTXYZ log.
#pragma once

#include <cstdint>

#include "support/matrix.hpp"
#include "support/novatel/novatel.h"

namespace flight_support {

/// A position and velocity solution of one receiver, of its antenna.
struct GnssFix {
  std::int64_t epoch_ns = 0;  ///< GPS ns since 1980-01-06
  Vec3 r_ECEF;                ///< [m]
  Vec3 v_ECEF;                ///< [m/s], relative to the rotating Earth
  double sigma_r_m = 0.0;     ///< 1-sigma per axis: root mean square of the three axes
  double sigma_v_mps = 0.0;   ///< likewise
};

/// Finite, between 6300 km and 50000 km from the Earth's centre, slower than 12 km/s, sigmas above
/// zero, time between 1980 and 2099.
bool is_plausible(const GnssFix& fix);

/// True if a receiver shows an old solution under a new time: never twice the same numbers, with
/// noise on them.
bool repeats(const GnssFix& before, const GnssFix& fix);

/// Room for the framer of a stream of which only BESTXYZ is wanted: longer logs are passed over,
/// and a damaged length delays a fix by no more than one frame.
constexpr std::size_t kGnssRoomBytes = 28 + 112 + 4;

/// False, with `fix` unchanged, for any other log and for one without a usable solution: not
/// computed, no time, not plausible.
bool read_fix(const novatel_frame& frame, GnssFix* fix);

}  // namespace flight_support
