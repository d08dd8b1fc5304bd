/// Orientation of the Earth relative to ECI, cheap enough for every stage of an integrator.
#pragma once

#include <orrery/harness/kernel/time.hpp>
#include <orrery/models/frames/eop_table.hpp>
#include <orrery/models/frames/vector.hpp>

#include <memory>

namespace orrery {

struct EarthAttitude {
  Mat3 R_EI;           // ECI -> ECEF
  Vec3 omega_EI_ECEF;  // angular velocity of the Earth relative to ECI [rad/s]; derivative of R_EI
};

/// R_EI = W R3(GAST) N P through ERFA: IAU 1976 precession, IAU 1980 nutation, GMST 1982 with the
/// 1994 equation of the equinoxes.
///
/// EOP      With a table: UT1, polar motion W, and dPsi, dEps added to the nutation (and to the
///          equation of the equinoxes), as the IERS Conventions (1996) have it. Without: UT1 = UTC
///          (so it steps by 15" at a leap second), no polar motion, the bare nutation model.
/// Method   N P and GAST less its mean rate are cubics through ERFA's values at fixed instants,
/// four
///          to each 3 h since the GPS epoch, so the result depends on t alone and not on what was
///          asked before. Interpolation error (h^4/24) max|f''''|, h = 1 h: 7e-15 rad from the
///          nutation of 0.23" at 13.7 d; with rounding 1e-13 rad from ERFA's own matrix, 1 um at
///          the Earth's surface. The table's values are its own cubics. dPsi, dEps turn the
///          matrix by small angles: their squares are left out, 3e-14 rad at 0.1".
/// Threads  Safe. The last few intervals are kept; two objects, or none kept, give the same bits.
/// Checked  test_suites/validation/models/frames/earth_orientation_test.cpp
class EarthOrientation {
 public:
  explicit EarthOrientation(EarthOrientationTable eop = EarthOrientationTable::none());
  ~EarthOrientation();
  EarthOrientation(const EarthOrientation&) = delete;
  EarthOrientation& operator=(const EarthOrientation&) = delete;

  /// @throws std::invalid_argument  `t` before 1980 or beyond 2200.
  /// @throws std::out_of_range      `t` outside the table of Earth orientation.
  EarthAttitude at(SimTime t) const;
  Mat3 R_EI(SimTime t) const { return at(t).R_EI; }

  /// ERFA's own matrix, without interpolation: about 10 us.
  static Mat3 exact_R_EI(SimTime t, const EarthOrientationParameters& eop = {});

 private:
  struct Interval;
  struct Kept;

  Interval make_interval(std::int64_t index) const;

  EarthOrientationTable eop_;
  std::unique_ptr<Kept> kept_;
};

/// R3: turns components into those of axes turned by `angle_rad` about z.
Mat3 rotation_about_z(double angle_rad);

}  // namespace orrery
