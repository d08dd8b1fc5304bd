/// The real Earth's attitude from a table, by ERFA and without interpolation: about 15 us a call.
#pragma once

#include <orrery/models/frames/eop_table.hpp>
#include <orrery/models/frames/time_scales.hpp>
#include <orrery/models/orbit/space_environment.hpp>
#include <orrery/models/orbit/sun_moon.hpp>

#include <erfa.h>

#include <utility>

namespace orrery {

/// R_EI = W R3(GAST) N P: IAU 1976 precession, IAU 1980 nutation with dPsi and dEps, GAST 1994 with
/// UT1, polar motion.
class RealEarth final : public SpaceEnvironment {
 public:
  explicit RealEarth(EarthOrientationTable table) : table_(std::move(table)) {}

  Surroundings surroundings(SimTime t) const override {
    const EarthOrientationParameters eop = table_.at(t);
    const JulianDate tt = gps_to_tt(t), utc = gps_to_utc(t);
    const double day = utc.day, ut1 = utc.fraction + eop.ut1_minus_utc_s / 86400;
    double zeta, z, theta, dpsi, deps;
    eraPrec76(2451545.0, 0, tt.day, tt.fraction, &zeta, &z, &theta);
    eraNut80(tt.day, tt.fraction, &dpsi, &deps);
    const double eps = eraObl80(tt.day, tt.fraction);
    double R[3][3], W[3][3], R_EI[3][3];
    eraIr(R);
    eraRz(-zeta, R), eraRy(theta, R), eraRz(-z, R);  // precession
    eraRx(eps, R), eraRz(-(dpsi + eop.dpsi_rad), R), eraRx(-(eps + deps + eop.deps_rad), R);
    // With the corrected dpsi, as the IERS defines UT1 with this chain: 0.1", 4 m in this orbit.
    eraRz(eraGmst82(day, ut1) + eraEqeq94(tt.day, tt.fraction) + eop.dpsi_rad * std::cos(eps), R);
    eraPom00(eop.x_pole_rad, eop.y_pole_rad, 0, W);
    eraRxr(W, R, R_EI);
    const auto row = [&](int i) { return Vec3{R_EI[i][0], R_EI[i][1], R_EI[i][2]}; };
    // Turns about the pole of date, which is W times the z axis.
    const double rate_radps = 7.292115146706979e-5 * (1 - eop.length_of_day_s / 86400);
    const Vec3 pole{W[0][2], W[1][2], W[2][2]};
    return {{row(0), row(1), row(2)}, rate_radps * pole, sun_position_ECI(t), moon_position_ECI(t)};
  }

 private:
  EarthOrientationTable table_;
};

}  // namespace orrery
