/// Where a broadcast ephemeris puts its satellite, and what it says of its clock.
#pragma once

#include <orrery/harness/kernel/time.hpp>
#include <orrery/models/frames/vector.hpp>
#include <orrery/models/gnss/broadcast_ephemeris.hpp>

namespace orrery {

/// A satellite's antenna and clock at one instant, ECEF. Derivatives are taken in ECEF.
struct SatelliteState {
  Vec3 r_ECEF, v_ECEF, a_ECEF;  // [m], [m/s], [m/s^2]
  double clock_s = 0;           // satellite's clock minus GPS time, relativity included, TGD not
  double clock_rate_sps = 0;
  double clock_acceleration_sps2 = 0;
};

/// The user algorithm for ephemeris and clock, differentiated twice in closed form.
///
/// Source      IS-GPS-200, Table 20-IV (orbit), 20.3.3.3.3.1 (clock); constants in
///             gps_constants.hpp
/// Weeks       The ephemeris has its full week, so t - toe needs no folding at +-302400 s.
/// Valid for   |t - toe| of 2 h for a real message; further for one made from an almanac.
/// Checked by  test_suites/unit/models/gnss/broadcast_orbit_test.cpp, and against the precise
///             orbits of the IGS in test_suites/validation/models/gnss
SatelliteState broadcast_state(const BroadcastEphemeris& ephemeris, SimTime t);

/// toe as an instant.
SimTime time_of_ephemeris(const BroadcastEphemeris& ephemeris);

/// E - e sin E = M by Newton's method to 1e-15 rad; 0 <= e < 0.5.
double eccentric_anomaly_rad(double mean_anomaly_rad, double eccentricity);

}  // namespace orrery
