/// Position and velocity integrated as they are: the alternative to orbit_dynamics.hpp.
#pragma once

#include <orrery/models/orbit/orbit_dynamics.hpp>

namespace orrery {

/// The whole acceleration [m/s^2]: -mu r/|r|^3, which ForceModel leaves to the propagator, and the
/// forces.
Vec3 acceleration_ECI(const OrbitDynamics::Forces& forces, const OrbitState& state,
                      const Surroundings& around);
/// The first instant after `t` at which one of the forces jumps.
std::optional<SimTime> next_discontinuity(const OrbitDynamics::Forces& forces, SimTime t);

/// RK4 on Cartesian position and velocity; a LazySystem drives it.
///
/// Method     r' = v, v' = -mu r/|r|^3 + forces. Four force evaluations a step, as OrbitDynamics;
///            an error some 1000 times larger at 10 s (0.5 m a day instead of 0.1 mm), 0.05 mm a
///            day at 1 s. For orbits that elements do not describe (equatorial ones, escape), and
///            as a second opinion.
/// Frames     ECI throughout; forces as force_model.hpp says, the point mass by kMuEarth_m3ps2.
/// Valid for  Any orbit above the ground.
/// Checked by test_suites/validation/models/orbit/integrators_test.cpp
class CartesianRk4 {
 public:
  /// At a grid point; its elements are left out.
  using State = OrbitDynamics::State;

  /// @throws std::invalid_argument  null environment or null force.
  CartesianRk4(std::shared_ptr<const SpaceEnvironment> environment, OrbitDynamics::Forces forces);

  /// @throws std::invalid_argument  not finite, below the ground, mass <= 0.
  State start(const OrbitState& initial) const;
  /// One RK4 step from one instant to the other, either way in time. @throws PropagationError
  State step(const State& from, SimTime, SimTime to) const;
  /// The velocity changed by dv_ECI at this instant. @throws std::domain_error  not finite.
  State after_impulse(const State& at, const Vec3& dv_ECI) const;
  /// OrbitDynamics::interpolate.
  State interpolate(const State& a, SimTime, const State& b, SimTime, SimTime t) const {
    return {.orbit = OrbitDynamics::interpolate(a, b, t)};
  }
  /// The first instant after `t` at which a force jumps.
  std::optional<SimTime> next_discontinuity(SimTime t) const {
    return orrery::next_discontinuity(forces_, t);
  }

 private:
  std::shared_ptr<const SpaceEnvironment> environment_;
  OrbitDynamics::Forces forces_;
};

}  // namespace orrery
