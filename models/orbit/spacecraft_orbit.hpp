/// The truth orbit of one spacecraft: propagated only as far as somebody looks.
#pragma once

#include <orrery/harness/kernel/time.hpp>
#include <orrery/models/orbit/orbit_dynamics.hpp>

#include <memory>

namespace orrery {

struct SpacecraftOrbitOptions {
  /// Of the integration grid, which starts at the initial state's instant. Above 0; 1 s to 10 s for
  /// millimetres a day.
  Duration step = 10s;
  /// Besides the point mass, e.g. make_earth_gravity(). Shared with other spacecraft if you like.
  OrbitDynamics::Forces forces = {};
  std::shared_ptr<const SpaceEnvironment> environment = {};  // required
};

/// A lazily propagated continuous system.
///
/// The grid is fixed by `step`, by the impulses and by the discontinuities of the forces. A look
/// between two grid points is interpolated and leaves no trace: any pattern of looks gives the same
/// orbit, to the bit. Instants run forward: the past beyond the last grid point is forgotten.
class SpacecraftOrbit {
 public:
  /// @throws std::invalid_argument  an orbit below the ground or not an ellipse, mass <= 0, step <=
  /// 0,
  ///                                no environment, a null force.
  SpacecraftOrbit(const OrbitState& initial, SpacecraftOrbitOptions options);

  /// @throws std::logic_error  after the first look or impulse. @throws std::invalid_argument null.
  void add_force(std::shared_ptr<const ForceModel> force);

  /// The state at `t`, right-continuous at impulses.
  /// @throws std::invalid_argument  before the last grid point that a look or impulse has passed.
  /// @throws PropagationError       the orbit went below the ground on the way.
  OrbitState at(SimTime t);

  /// As at(), and for up to 10 min before the last grid point passed: stepped back from there as if
  /// no impulse had come since, and forgotten. For comparing estimates of an earlier instant with
  /// truth.
  /// @throws std::invalid_argument  earlier than that.
  OrbitState recent(SimTime t);

  /// Changes the velocity by dv_ECI [m/s] at `t`; a grid point from then on.
  /// @throws as at(); std::domain_error  dv_ECI not finite.
  void apply_impulse(SimTime t, const Vec3& dv_ECI);

  /// Osculating elements at `t`. Errors as at().
  QuasiNonsingularElements elements_at(SimTime t) {
    return to_quasi_nonsingular(inertial_state(at(t)));
  }

  /// RK4 steps computed so far, those thrown away for an impulse included; looks between grid
  /// points.
  std::uint64_t steps() const { return steps_; }
  std::uint64_t interpolations() const { return interpolations_; }

 private:
  void start();
  void move_to(SimTime t);
  SimTime next_grid_point() const;

  SpacecraftOrbitOptions options_;
  OrbitState initial_;
  std::unique_ptr<const OrbitDynamics> dynamics_;  // from the start on
  OrbitDynamics::State left_;                      // the last grid point passed
  std::optional<OrbitDynamics::State> right_;      // the next one, once somebody has looked
  std::uint64_t steps_ = 0, interpolations_ = 0;
};

}  // namespace orrery
