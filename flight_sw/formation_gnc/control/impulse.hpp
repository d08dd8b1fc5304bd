/// What a thruster can be asked for, and how well it does it.
#pragma once

#include <cstdint>

#include "support/orbit/burn.hpp"
#include "support/orbit/relative_elements.hpp"

namespace formation_gnc {

/// A burn as it is commanded: middle of it, and delta-v in EME2000.
struct Impulse {
  std::int64_t t_ns = 0;        ///< GPS time, ns since 1980-01-06
  flight_support::Vec3 dv_ECI;  ///< [m/s]
};

/// Limits of one firing; the defaults are `cold_gas_6` at 11 kg.
struct ImpulseLimits {
  double max_mps = 0.033 / 11.0;    ///< 33 mN s
  double min_mps = 0.25e-3 / 11.0;  ///< 10 ms at 25 mN
  double spacing_s = 122.0;         ///< between the middles of two firings; 120 s and their length
};

/// 1-sigma of what a firing really does.
struct ThrusterErrors {
  double scale = 0.02;                ///< constant; less once it has been estimated
  double misalignment_rad = 8.7e-3;   ///< constant, 0.5 deg about each of two axes
  double shot_to_shot = 0.01;         ///< of the magnitude, anew at each firing
  double quantum_mps = 25e-6 / 11.0;  ///< on-times come in steps of 1 ms at 25 mN
};

/// The delta-v [m/s] of a burn in the RTN of the spacecraft that burns, in ECI and back.
flight_support::Vec3 dv_eci_from_rtn(const flight_support::StateEci& burning,
                                     const flight_support::Vec3& dv_RTN);
flight_support::Vec3 dv_rtn_from_eci(const flight_support::StateEci& burning,
                                     const flight_support::Vec3& dv_ECI);

/// Covariance of a burn's execution [m^2/s^2], in the axes of `dv`: what navigation adds when the
/// burn happens.
flight_support::Mat3 maneuver_covariance(const flight_support::Vec3& dv,
                                         const ThrusterErrors& errors);

/// Estimates the factor between commanded and delivered delta-v, a constant of the thrusters.
///
/// A scalar Kalman filter on the observed delta-v along the commanded one. Shots differ by
/// `shot_to_shot`, and an observation is as good as navigation before and after the burn.
class ThrusterScale {
 public:
  explicit ThrusterScale(const ThrusterErrors& errors = {});

  /// @param observed        Delta-v that navigation saw, in the axes of `commanded`.
  /// @param observed_sigma  1-sigma per axis of that [m/s], above 0.
  /// @return false if the observation is nothing to learn from: not finite, no burn, or more than
  ///         5 sigma off.
  bool observe(const flight_support::Vec3& commanded, const flight_support::Vec3& observed,
               double observed_sigma_mps);

  double scale() const { return scale_; }  ///< delivered over commanded
  double sigma() const;
  /// What to command so that `wanted` is delivered.
  flight_support::Vec3 command_for(const flight_support::Vec3& wanted) const;
  /// The errors that remain: `scale` is replaced by sigma().
  ThrusterErrors errors() const;

 private:
  ThrusterErrors errors_;
  double scale_ = 1.0, variance_;
};

}  // namespace formation_gnc
