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
  double scale = 0.02;                ///< constant
  double misalignment_rad = 8.7e-3;   ///< constant, 0.5 deg about each of two axes
  double shot_to_shot = 0.01;         ///< of the magnitude, anew at each firing
  double quantum_mps = 25e-6 / 11.0;  ///< on-times come in steps of 1 ms at 25 mN
};

/// The delta-v [m/s] of a burn in the RTN of the spacecraft that burns, in ECI and back.
flight_support::Vec3 dv_eci_from_rtn(const flight_support::StateEci& burning,
                                     const flight_support::Vec3& dv_RTN);
flight_support::Vec3 dv_rtn_from_eci(const flight_support::StateEci& burning,
                                     const flight_support::Vec3& dv_ECI);

/// What a command becomes: each component in whole on-times of its nozzle, none below half of
/// `limits.min_mps`, that from there on; together at most `limits.max_mps`, in the same direction.
/// @param dv_B  Body axes.
flight_support::Vec3 in_whole_on_times(const flight_support::Vec3& dv_B,
                                       const ImpulseLimits& limits, const ThrusterErrors& errors);

/// Estimates what six nozzles do: constants, along the axes of the body and against them, in the
/// order +X -X +Y -Y +Z -Z.
///
/// Each pushes along its axis, by a scale, and across it, by its misalignment. A Kalman filter per
/// axis of the body, of what each of the six adds to that axis; they are coupled, since nozzles
/// fire together. Shots differ by `shot_to_shot`, and an observation is as good as navigation
/// before and after the burn.
class ThrusterScale {
 public:
  static constexpr int kNozzles = 6;

  explicit ThrusterScale(const ThrusterErrors& errors = {});

  /// @param commanded_B       What the thruster was asked for [m/s], body axes.
  /// @param observed_B        What navigation saw of it.
  /// @param observed_sigma_B  1-sigma per axis of that [m/s], above 0.
  /// @return false, and nothing learnt: not finite, no burn, or more than 5 sigma off in an axis.
  bool observe(const flight_support::Vec3& commanded_B, const flight_support::Vec3& observed_B,
               const flight_support::Vec3& observed_sigma_B);

  /// Delivered over commanded, along the nozzle's axis.
  double scale(int nozzle) const;
  double sigma(int nozzle) const;
  /// What to command so that `wanted_B` is delivered.
  flight_support::Vec3 command_for(const flight_support::Vec3& wanted_B) const;
  /// What comes of a command.
  flight_support::Vec3 delivered(const flight_support::Vec3& commanded_B) const;
  /// Of what remains unknown of that [m^2/s^2]; axes of the body.
  flight_support::Mat3 covariance(const flight_support::Vec3& commanded_B) const;

 private:
  using Vec6 = flight_support::Vector<kNozzles>;

  double noise2(const flight_support::Vec3& commanded_B, int axis) const;

  ThrusterErrors errors_;
  Vec6 push_[3];  // by axis of the body: of each nozzle, per m/s that it is asked for
  flight_support::Matrix<kNozzles, kNozzles> P_[3];
};

}  // namespace formation_gnc
