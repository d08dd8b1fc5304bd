/// Orientation of the Earth relative to ECI, cheap enough for every stage of an integrator.
#pragma once

#include <orrery/harness/kernel/time.hpp>
#include <orrery/models/frames/vector.hpp>

#include <array>
#include <mutex>

namespace orrery {

struct EarthAttitude {
  Mat3 R_EI;           // ECI -> ECEF
  Vec3 omega_EI_ECEF;  // angular velocity of the Earth relative to ECI [rad/s]; derivative of R_EI
};

/// R_EI = R3(GAST) N P through ERFA: IAU 1976 precession, IAU 1980 nutation, GMST 1982 with the
/// 1994 equation of the equinoxes, UT1 = UTC (so it steps by 15" at a leap second), no polar
/// motion.
///
/// Method   N P and GAST less its mean rate are cubics through ERFA's values at fixed instants 3 h
/// apart
///          (both intervals beside the one asked for), so the result depends on t alone and not on
///          what was asked before. Interpolation
///          error (9/16)(h^4/24) max|f''''|: 3e-13 rad from the nutation of 0.23" at 13.7 d, 4e-13
///          rad in all, 3 um at the Earth's surface.
/// Threads  Safe. The last few intervals are kept; two objects, or none kept, give the same bits.
/// Checked  test_suites/validation/models/frames/earth_orientation_test.cpp
class EarthOrientation {
 public:
  EarthOrientation() = default;
  EarthOrientation(const EarthOrientation&) = delete;
  EarthOrientation& operator=(const EarthOrientation&) = delete;

  /// @throws std::invalid_argument  `t` before 1980 or beyond 2200.
  EarthAttitude at(SimTime t) const;
  Mat3 R_EI(SimTime t) const { return at(t).R_EI; }

  /// ERFA's own matrix, without interpolation: about 10 us.
  static Mat3 exact_R_EI(SimTime t);

 private:
  struct Cubic {
    double c0 = 0, c1 = 0, c2 = 0, c3 = 0;
  };
  struct Interval {
    std::int64_t index = 0;
    bool valid = false;
    int leap_seconds = 0;  // at its begin
    bool leap_second_inside = false;
    double gast_rad = 0;      // at its begin
    Cubic gast_residual;      // GAST - gast_rad - mean rate * (t - begin)
    std::array<Cubic, 9> NP;  // row-major
  };

  static Interval make_interval(std::int64_t index);
  static Cubic through(double at_minus_1, double at_0, double at_1, double at_2);
  Interval interval(std::int64_t index) const;
  static double gast(const Interval& in, SimTime t, double tau, double* rate);

  // Slot index mod 4: a few spacecraft at slightly different times do not displace one another.
  mutable std::mutex mutex_;
  mutable std::array<Interval, 4> kept_;
};

/// R3: turns components into those of axes turned by `angle_rad` about z.
Mat3 rotation_about_z(double angle_rad);

}  // namespace orrery
