/// The Sun's apparent direction, cheap enough for every look at an attitude.
#pragma once

#include <orrery/harness/kernel/time.hpp>
#include <orrery/models/attitude/pointing.hpp>

#include <array>

namespace orrery {

/// apparent_sun_direction_ECI and its derivative, from the cubic through its values at fixed
/// instants 6 h apart: a function of t alone. The Earth's monthly motion about the barycentre,
/// 3e-5 rad, is interpolated to 1e-11 rad.
/// Threads  None: the last interval is kept. Another object gives the same bits.
/// Checked  test_suites/unit/models/attitude/pointing_law_test.cpp
class SunTrack {
 public:
  /// @param t  From the GPS epoch on, to 2100 (eraEpv00).
  SunDirection at(SimTime t) const;

 private:
  mutable std::int64_t interval_ = -1;
  mutable std::array<Vec3, 4>
      knots_;  // at the interval's begin less a step, begin, end, end + step
};

}  // namespace orrery
