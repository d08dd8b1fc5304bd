/// Trims before an observation: optics on the Sun line of the detector, at rest across it.
///
/// Target      r(optics) - r(detector) = +40 m along the apparent Sun direction at the middle of
///             the exposure, with no relative velocity across it.
/// Prediction  Both spacecraft propagated numerically (RK4) with the field that navigation uses:
///             at 40 m, what a point mass leaves out is 12 mm after 5 min, J2 1.0 mm after 10 min,
///             20x20 0.12 mm. The response to an impulse comes from the same propagation.
/// Law         Trims at three fixed times before the observation, planned two at a time and anew
///             before each: the first two take the formation to the target and stop it there, the
///             last corrects what their execution and navigation got wrong. The impulses minimise
///             the expected sum of squared errors over tolerances, the execution error of the
///             later one included.
/// Checked by  test_suites/unit/flight_sw/formation_gnc/fine_alignment_test.cpp
#pragma once

#include <cstdint>

#include "formation_gnc/control/impulse.hpp"
#include "formation_gnc/control/orbit_prediction.hpp"

namespace formation_gnc {

/// Estimate of both, centres of mass.
struct AlignmentState {
  std::int64_t t_ns = 0;
  flight_support::StateEci detector, optics;
};

struct AlignmentOptions {
  double separation_m = 40.0;
  ImpulseLimits limits = {};
  ThrusterErrors errors = {};
  double first_trim_before_s = 1800.0;  ///< before the observation
  double middle_trim_before_s = 420.0;  ///< 0: there is none
  double last_trim_before_s = 180.0;
  double longitudinal_m = 0.015, lateral_m = 0.018, lateral_mps = 2e-4;  ///< tolerances
};

/// What remains at the observation if nothing more is done.
struct AlignmentError {
  flight_support::Vec3 dr_ECI;  ///< r - target [m]
  double longitudinal_m = 0.0, lateral_m = 0.0, lateral_mps = 0.0;
};

struct TrimPlan {
  int count = 0;  ///< impulses, 0 to 2
  Impulse impulse[2];
  AlignmentError before, after;  ///< predicted at the observation, without and with the trims
  bool within_limits = true;     ///< false: an impulse was cut to the largest possible
};

class FineAlignment {
 public:
  /// @param gravity  Outlives this object.
  FineAlignment(const GravityModel& gravity, const AlignmentOptions& options = {});

  /// The next two trims that are not before `earliest_ns` (one or none, if there are no more), by
  /// the optics spacecraft or by the detector. Deliver what is said: command it through
  /// ThrusterScale::command_for. Impulses below the smallest possible are left out.
  TrimPlan plan(const AlignmentState& now, std::int64_t earliest_ns, std::int64_t observation_ns,
                const flight_support::Vec3& sun_ECI, bool optics_burns) const;

  AlignmentError predict(const AlignmentState& now, std::int64_t observation_ns,
                         const flight_support::Vec3& sun_ECI) const;

 private:
  const GravityModel& gravity_;
  AlignmentOptions options_;
};

}  // namespace formation_gnc
