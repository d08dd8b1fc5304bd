/// The equations of motion of one spacecraft and their integrator; spacecraft_orbit.hpp drives
/// them.
#pragma once

#include <orrery/models/orbit/elements.hpp>
#include <orrery/models/orbit/force_model.hpp>
#include <orrery/models/orbit/space_environment.hpp>

#include <memory>
#include <optional>
#include <stdexcept>
#include <vector>

namespace orrery {

/// The numerics left their range: an orbit went below the ground or ceased to be an ellipse.
class PropagationError : public std::runtime_error {
 public:
  PropagationError(const std::string& what, const OrbitState& state);
  /// The last state that was still good.
  const OrbitState& state() const { return state_; }

 private:
  OrbitState state_;
};

/// Gauss' variational equations in quasi-nonsingular elements, RK4.
///
/// Method     x = (a, ex, ey, i, raan, u): Kepler's motion is exact whatever the step, so 10 s
/// steps in
///            a 60x60 field stay within a millimetre a day (Cartesian ones: half a metre).
///            Equations: Battin, An Introduction to the Mathematics and Methods of Astrodynamics
///            (1999), ch. 10, in nonsingular form. Four force evaluations a step.
/// Frames     ECI throughout; forces as force_model.hpp says, the point mass by kMuEarth_m3ps2.
/// Valid for  Ellipses above the ground, not within 1e-9 rad of equatorial.
/// Checked by test_suites/validation/models/orbit/propagation_test.cpp
class OrbitDynamics {
 public:
  using Forces = std::vector<std::shared_ptr<const ForceModel>>;

  /// What is known at a grid point: the elements, and what the next step and a look both need.
  struct State {
    OrbitState orbit;
    QuasiNonsingularElements elements;
    QuasiNonsingularElements rate;  // derivative of the elements [1/s]
    Vec3 a_ECI;                     // whole acceleration [m/s^2] from this instant on
    Vec3 a_before_ECI;              // and up to it: another one where a force jumps
  };

  /// @throws std::invalid_argument  null environment or null force.
  OrbitDynamics(std::shared_ptr<const SpaceEnvironment> environment, Forces forces);

  /// @throws std::invalid_argument  elements.hpp; also an orbit below the ground, mass <= 0.
  State start(const OrbitState& initial) const;
  /// One RK4 step to `to`, any length. @throws PropagationError
  State step(const State& from, SimTime to) const;
  /// The velocity changed by dv_ECI at this instant.
  /// @throws std::domain_error  not finite. @throws PropagationError  no longer an ellipse.
  State after_impulse(const State& at, const Vec3& dv_ECI) const;
  /// Quintic Hermite on position, velocity and acceleration, a.t <= t <= b.t. Error for 10 s: 1e-9
  /// m.
  static OrbitState interpolate(const State& a, const State& b, SimTime t);
  /// The first instant after `t` at which a force jumps.
  std::optional<SimTime> next_discontinuity(SimTime t) const;

 private:
  struct Evaluation;
  Evaluation evaluate(SimTime t, const QuasiNonsingularElements& x, double mass_kg,
                      const Surroundings& around) const;
  State completed(SimTime t, const QuasiNonsingularElements& x, double mass_kg,
                  const Surroundings& around) const;

  std::shared_ptr<const SpaceEnvironment> environment_;
  Forces forces_;
};

}  // namespace orrery
