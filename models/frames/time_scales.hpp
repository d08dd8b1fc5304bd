/// GPS time as the two-part Julian dates of other time scales, for ERFA and for records.
#pragma once

#include <orrery/harness/kernel/time.hpp>

namespace orrery {

/// day + fraction, day ends in .5 (midnight), 0 <= fraction < 1: resolves 1e-11 s.
struct JulianDate {
  double day = 0;
  double fraction = 0;
};

/// TT = GPST + 51.184 s.
JulianDate gps_to_tt(SimTime t);
/// Centuries of 36525 days TT from J2000.0.
double gps_to_tt_centuries(SimTime t);

/// TAI - UTC [s], from ERFA's table of leap seconds (eraDat). Throughout a leap second: the old
/// value.
/// @throws std::invalid_argument  before 1980 or beyond 2200.
int leap_seconds(SimTime t);
/// UTC = GPST + 19 s - (TAI - UTC). A leap second reads like the second after it.
JulianDate gps_to_utc(SimTime t);

}  // namespace orrery
