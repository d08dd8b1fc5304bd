/// The equations of motion of one spacecraft and their integrator; spacecraft_orbit.hpp drives
/// them.
#pragma once

#include <orrery/models/orbit/elements.hpp>
#include <orrery/models/orbit/force_model.hpp>
#include <orrery/models/orbit/space_environment.hpp>
#include <orrery/models/orbit/thrust.hpp>

#include <array>
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

/// What the integrator advances.
enum class OrbitVariables {
  kElements,  // quasi-nonsingular ones, by Gauss' equations
  kCartesian  // position and velocity
};

/// Gauss' variational equations in quasi-nonsingular elements, RK4; or RK4 on position and
/// velocity.
///
/// Method     x = (a, ex, ey, i, raan, u): Kepler's motion is exact whatever the step, so 10 s
/// steps in
///            a 60x60 field stay within a millimetre a day (Cartesian ones: half a metre).
///            Equations: Battin, An Introduction to the Mathematics and Methods of Astrodynamics
///            (1999), ch. 10, in nonsingular form. Four force evaluations a step.
/// Cartesian  r' = v, v' = -mu r/|r|^3 + forces: 0.4 m a day at 10 s, 0.04 mm at 1 s. For orbits
///            that the elements do not describe (equatorial ones, escape), and as a second opinion.
/// Frames     ECI throughout; forces as force_model.hpp says, the point mass by kMuEarth_m3ps2.
/// Thrust     Constant from one edge to the next, and an edge is the end of a step. The mass falls
///            linearly, m(t) = m0 - flow t, at the stages, at the end and in a look alike.
/// Valid for  Ellipses above the ground, not within 1e-9 rad of equatorial; in Cartesian variables
///            any orbit above the ground.
/// Checked by test_suites/validation/models/orbit/propagation_test.cpp, integrators_test.cpp
class OrbitDynamics {
 public:
  using Forces = std::vector<std::shared_ptr<const ForceModel>>;
  static constexpr std::size_t kMostForcesAlongOrbit = 4;
  using Memories = std::array<ForceMemory, kMostForcesAlongOrbit>;

  /// What is known at a grid point: the elements, and what the next step and a look both need.
  struct State {
    OrbitState orbit;
    QuasiNonsingularElements elements;  // these two with OrbitVariables::kElements only
    QuasiNonsingularElements rate;      // derivative of the elements [1/s]
    Vec3 a_ECI;                         // whole acceleration [m/s^2] from this instant on
    Vec3 a_before_ECI;                  // and up to it: another one where a force jumps
    Memories memories;                  // of the ForceAlongOrbit, for the step that begins here
  };

  /// Where the orbit leaves the region of a ForceAlongOrbit.
  struct Crossing {
    SimTime t;
    std::size_t force = 0;
  };

  /// @param attitude  What turns a body-fixed thrust; may be null if there is none.
  /// @throws std::invalid_argument  null environment or null force; more than four ForceAlongOrbit.
  OrbitDynamics(std::shared_ptr<const SpaceEnvironment> environment, Forces forces,
                std::shared_ptr<const AttitudeLaw> attitude = {},
                OrbitVariables variables = OrbitVariables::kElements);

  /// @throws std::invalid_argument  elements.hpp; also an orbit below the ground, mass <= 0; in
  ///         Cartesian variables a position below the ground, not finite.
  /// @throws what a force throws where it is not defined.
  State start(const OrbitState& initial) const;
  /// One RK4 step to `to`, any length.
  /// @throws PropagationError  no ellipse, below the ground, or a force refuses a place or instant.
  State step(const State& from, SimTime to) const;
  /// Whether a force has edges that the orbit may meet.
  bool has_edges() const { return has_edges_; }
  /// The first edge of a force met in (a.t, b.t], where b = step(a, b.t): found on the step's
  /// interpolant, to the nanosecond.
  std::optional<Crossing> crossing(const State& a, const State& b) const;
  /// The state at a crossing as the next step starts from it: position and velocity unchanged.
  State beyond(const State& at, const Crossing& crossing) const;
  /// The velocity changed by dv_ECI at this instant.
  /// @throws std::domain_error  not finite. @throws PropagationError  no longer an ellipse.
  State after_impulse(const State& at, const Vec3& dv_ECI) const;
  /// From now on every step is made under this thrust. A state made under another one needs
  /// under_new_thrust().
  /// @throws std::invalid_argument  not finite, a negative flow, force_B without an attitude law.
  void set_thrust(const Thrust& thrust);
  void check_thrust(const Thrust& thrust) const;
  const Thrust& thrust() const { return thrust_; }
  /// The same position, velocity and mass, with derivatives under the thrust as it is set now.
  State under_new_thrust(const State& at) const;
  /// Position and velocity at t, a.t <= t <= b.t, towards b as it was before anything happened
  /// there; mass linear.
  /// Quintic Hermite on position, velocity and acceleration: error for 10 s 1e-9 m. In steps below
  /// 2 s, where it would divide the rounding of positions by the step (1e-6 m/s at 30 ms), cubic
  /// Hermite on velocity and acceleration and its integral: below 5e-10 m/s and 5e-10 m.
  static OrbitState interpolate(const State& a, const State& b, SimTime t);
  /// The first instant after `t` at which a force jumps, or the attitude under a body-fixed thrust.
  std::optional<SimTime> next_discontinuity(SimTime t) const;

 private:
  struct Point;
  struct Force {
    std::shared_ptr<const ForceModel> model;
    const ForceAlongOrbit* along_orbit = nullptr;  // the same, if it is one
    std::size_t slot = 0;                          // in memories
  };
  static Point point(SimTime t, const QuasiNonsingularElements& x, double mass_kg);
  /// What a step begins from; without elements in Cartesian variables.
  Point grid_point(const State& at) const;
  Point start_point(const OrbitState& initial) const;
  /// @throws PropagationError  with `from`, if x is no orbit above the ground.
  static Point checked_point(SimTime t, const QuasiNonsingularElements& x, double mass_kg,
                             const State& from);
  Vec3 perturbation_ECI(const Point& at, const Surroundings& around,
                        const Memories& memories) const;
  State completed(const Point& at, const Surroundings& around, const Memories& memories) const;
  Vec3 thrust_acceleration_ECI(const OrbitState& orbit) const;
  std::optional<SimTime> edge_of(const Force& force, const State& a, const State& b) const;
  State stepped(const State& from, SimTime to) const;
  Point stepped_elements(const State& from, SimTime to, const Surroundings& at_end) const;
  Point stepped_cartesian(const State& from, SimTime to, const Surroundings& at_end) const;
  double mass_kg(const State& from, SimTime t) const;

  std::shared_ptr<const SpaceEnvironment> environment_;
  std::vector<Force> forces_;
  bool has_edges_ = false;
  std::shared_ptr<const AttitudeLaw> attitude_;
  Thrust thrust_;
  OrbitVariables variables_ = OrbitVariables::kElements;
};

}  // namespace orrery
