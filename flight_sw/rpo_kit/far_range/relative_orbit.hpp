/// The target's orbit relative to the observer's, as far-range navigation carries it.
///
/// State       a_roe of the target relative to the OBSERVER [m], mean, in the order of
///             support/orbit/relative_elements.hpp: da, dl, dex, dey, dix, diy. The observer is the
///             reference because its own orbit is known (GNSS); it is needed to 1e-6 only.
/// Motion      Not linear: both mean orbits are moved by secular J2 and compared again. At 30 km
///             the linear maps leave a_roe^2/a = 130 m; these leave what second order in J2 does
///             not share at two neighbouring arguments of latitude, 5 cm.
/// Direction   From both osculating states: curvature of the orbit and J2 are in it, which is what
///             shows the range to a camera that knows directions only.
/// Checked by  test_suites/unit/flight_sw/rpo_kit/relative_orbit_filter_test.cpp
#pragma once

#include <cstdint>

#include "support/orbit/relative_elements.hpp"

namespace rpo_kit {

/// The observer's own orbit at an instant.
struct Observer {
  std::int64_t t_ns = 0;  ///< GPS time, ns since 1980-01-06
  flight_support::OrbitElements mean;
};

Observer observer_from_state(std::int64_t t_ns, const flight_support::StateEci& state);
Observer propagate(const Observer& observer, std::int64_t to_ns);

/// a_roe `dt_s` later, no burns.
flight_support::RelativeElements drift(const flight_support::OrbitElements& observer,
                                       const flight_support::RelativeElements& a_roe, double dt_s);

/// A burn of the observer, as it is known to have been: mean and covariance.
struct ObserverBurn {
  std::int64_t t_ns = 0;
  flight_support::Vec3 dv_RTN;          ///< of the observer [m/s]
  flight_support::Mat3 covariance_RTN;  ///< [m^2/s^2]
};

/// What is known of a burn: magnitude to a fraction, direction to an angle (1 sigma, per axis).
flight_support::Mat3 burn_covariance(const flight_support::Vec3& dv, double magnitude_fraction,
                                     double direction_rad);

/// The observer's orbit after its burn.
flight_support::OrbitElements after_burn(const flight_support::OrbitElements& observer,
                                         const flight_support::Vec3& dv_RTN);
/// a_roe of the same target relative to another observer.
flight_support::RelativeElements seen_from(const flight_support::OrbitElements& observer,
                                           const flight_support::OrbitElements& other,
                                           const flight_support::RelativeElements& a_roe);

/// Target less observer in ECI [m].
flight_support::Vec3 target_position_ECI(const flight_support::OrbitElements& observer,
                                         const flight_support::Vec3& observer_r_ECI,
                                         const flight_support::RelativeElements& a_roe);
/// The observer's position that belongs to its mean elements [m].
flight_support::Vec3 position_ECI(const flight_support::OrbitElements& mean);

/// Where a camera saw the target: the observer's own, or that of a second observer whose place is
/// known beside it.
struct Bearing {
  std::int64_t t_ns = 0;
  flight_support::Vec3 direction_ECI;  ///< unit vector, geometric (stars' aberration removed)
  double sigma_rad = 0.0;              ///< 1-sigma per axis
  flight_support::Vec3 r_SO_ECI = {};  ///< the camera's spacecraft less the observer [m]
  flight_support::Mat3 covariance_SO_ECI = {};  ///< of that [m^2]
  bool is_own() const { return dot(r_SO_ECI, r_SO_ECI) == 0.0; }
};

/// Where two lines of sight pass each other, in closed form.
struct Intersection {
  double first_m = 0.0, second_m = 0.0;  ///< from the cameras, below 0 behind them
  double miss_m = 0.0;                   ///< between the lines there, across both
  flight_support::Vec3 across;           ///< unit vector of that
  double sine = 0.0;                     ///< of the angle between the lines
};
/// @param r_ECI  The second camera less the first. @return false: parallel.
bool intersect(const flight_support::Vec3& first, const flight_support::Vec3& second,
               const flight_support::Vec3& r_ECI, Intersection* at);

/// Two unit vectors across a direction: residuals are measured along them.
struct TangentPlane {
  explicit TangentPlane(const flight_support::Vec3& direction_ECI);
  /// Of a vector of any length, seen along the plane's normal [rad, for small angles].
  flight_support::Vector<2> offset(const flight_support::Vec3& towards) const;
  /// Variances [rad^2] of that for a vector with this covariance.
  flight_support::Matrix<2, 2> spread(const flight_support::Mat3& covariance, double length) const;
  flight_support::Vec3 normal, first, second;
};

}  // namespace rpo_kit
