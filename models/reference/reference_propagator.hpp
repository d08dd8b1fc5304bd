/// Orbits as exactly as double precision allows, to measure other propagators with.
#pragma once

#include <orrery/models/orbit/orbit_dynamics.hpp>
#include <orrery/models/reference/orbit_events.hpp>

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

namespace orrery {

struct ReferenceSpacecraft {
  OrbitState initial;
  OrbitDynamics::Forces forces = {};  // besides the point mass, as SpacecraftOrbitOptions::forces
  std::shared_ptr<const AttitudeLaw> attitude = {};  // turns body-fixed thrust
};

struct ReferenceOptions {
  /// Local error per step as it is estimated, relative to |r| and |v|. 1e-15 to 1e-3; 1e-13 is a
  /// micrometre a step.
  double tolerance = 1e-13;
  /// Above 0. The shortest waves of a 60x60 field pass in 90 s, and the estimate is blind to part
  /// of them: with steps up to 60 s a day errs by 0.1 mm whatever the tolerance, with 30 s by some
  /// um. Events shorter than a step may be missed.
  Duration longest_step = 30s;
  /// Steps of this length instead, without error control: to measure the order of convergence.
  std::optional<Duration> fixed_step = {};
};

/// Several spacecraft, integrated together with a common adaptive step.
///
/// Method     SUNDIALS' ARKODE: explicit Runge-Kutta of Fehlberg, 13 stages, order 8 with an
///            estimate of order 7, in Cartesian position and velocity; NASA TR R-287, 1968. By
///            ARKStep: ERKStep of 6.4 takes every table whose last stage lies at the end of the
///            step for one that reuses it, and loses an order.
/// Forces     The same ForceModel list as the truth's propagator, the force itself without memory
///            (ForceAlongOrbit). The integration stops where a force jumps and begins anew; so it
///            does after an impulse and at a thrust edge. Edges in space (ForceAlongOrbit, those of
///            the shadow) are left to the step control, which sees part of such a kink: 0.6 mm of a
///            relative position at 1 km after ten orbits. Find them as events and stop there, as
///            relative_motion_test.cpp does, where that matters.
/// Frames     ECI; the point mass by kMuEarth_m3ps2.
/// Errors     24 h at 550 km in a 60x60 field: 2 to 15 um, by rounding (integrators_test.cpp).
/// Not for    Truth: an adaptive step depends on where the caller stops, so that a further look
///            changes the last bits. Use SpacecraftOrbit.
/// Checked by test_suites/validation/models/orbit/integrators_test.cpp, orbit_events_test.cpp
class ReferencePropagator {
 public:
  /// @throws std::invalid_argument  no spacecraft, instants that differ, a state below the ground
  ///         or not finite, mass <= 0, null environment or force, options outside their range.
  ReferencePropagator(std::vector<ReferenceSpacecraft> spacecraft,
                      std::shared_ptr<const SpaceEnvironment> environment,
                      const ReferenceOptions& options = {});
  ~ReferencePropagator();
  ReferencePropagator(const ReferencePropagator&) = delete;
  ReferencePropagator& operator=(const ReferencePropagator&) = delete;

  SimTime time() const;
  /// At time(). @throws std::out_of_range  no such spacecraft.
  const OrbitState& state(std::size_t spacecraft = 0) const;

  /// To `t`, later or earlier. @throws PropagationError  below the ground, or no step is short
  /// enough.
  void advance_to(SimTime t);
  /// The same, and the roots of the functions on the way, in the order in which they are met; to
  /// within 1 us.
  std::vector<OrbitEvent> advance_to(SimTime t, const std::vector<EventFunction>& functions);

  /// Changes a velocity by dv_ECI [m/s] at time(). @throws std::out_of_range, std::domain_error.
  void apply_impulse(std::size_t spacecraft, const Vec3& dv_ECI);
  /// The thrust on the path from time() on, whichever way it leads; Thrust{} ends it. The mass
  /// falls with time. @throws std::out_of_range, and as OrbitDynamics::set_thrust.
  void set_thrust(std::size_t spacecraft, const Thrust& thrust);

  /// Steps and evaluations of all forces so far.
  std::uint64_t steps() const;
  std::uint64_t evaluations() const;

 private:
  class Solver;
  std::unique_ptr<Solver> solver_;
};

}  // namespace orrery
