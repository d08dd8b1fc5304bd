/// The truth orbit of one spacecraft: propagated only as far as somebody looks.
#pragma once

#include <orrery/harness/kernel/lazy_system.hpp>
#include <orrery/harness/kernel/time.hpp>
#include <orrery/models/orbit/orbit_dynamics.hpp>

#include <deque>
#include <functional>
#include <memory>
#include <optional>

namespace orrery {

struct SpacecraftOrbitOptions {
  /// Of the integration grid, which starts at the initial state's instant. Above 0; 1 s to 10 s for
  /// millimetres a day.
  Duration step = 10s;
  /// Besides the point mass, e.g. make_earth_gravity(). Shared with other spacecraft if you like.
  OrbitDynamics::Forces forces = {};
  std::shared_ptr<const SpaceEnvironment> environment = {};  // required
  /// Turns body-fixed thrust; without it there can be none. Changes only in change_attitude().
  std::shared_ptr<const AttitudeLaw> attitude = {};
  /// kCartesian needs 1 s steps for what elements do at 10 s, but takes any orbit.
  OrbitVariables variables = OrbitVariables::kElements;
};

/// A LazySystem of OrbitDynamics: its grid is fixed by `step`, by impulses and thrust edges, by the
/// discontinuities of the forces and by their edges in space; any pattern of looks gives the same
/// orbit, to the bit. Looks, impulses and edges come in the order of time.
class SpacecraftOrbit {
 public:
  /// @throws std::invalid_argument  an orbit below the ground or not an ellipse, mass <= 0, step <=
  ///                                0, no environment, a null force.
  SpacecraftOrbit(const OrbitState& initial, SpacecraftOrbitOptions options);

  /// @throws std::logic_error  after the first look or impulse. @throws std::invalid_argument null.
  void add_force(std::shared_ptr<const ForceModel> force);

  /// The state at `t`; at an impulse, after it.
  /// @throws std::logic_error  `t` before the last grid point that a look or impulse has passed.
  /// @throws PropagationError  the orbit went below the ground on the way.
  OrbitState at(SimTime t);

  /// The truth as it was at `t`, up to 10 min before the last grid point passed: the same bits that
  /// a look gave at that time, impulses since then undone. For comparing estimates of an earlier
  /// instant with truth. From the last grid point on it is at().
  /// @throws std::logic_error  earlier than that, or before the start.
  OrbitState recent(SimTime t);

  /// Changes the velocity by dv_ECI [m/s] at `t`, which becomes a grid point.
  /// @throws as at(); std::domain_error  dv_ECI not finite; PropagationError  no ellipse any more.
  void apply_impulse(SimTime t, const Vec3& dv_ECI);

  /// From `t` on, which becomes a grid point to the nanosecond, this is the thrust of all nozzles
  /// together; Thrust{} ends it. The mass falls from then on.
  /// @throws as at(); std::invalid_argument  as OrbitDynamics::set_thrust. PropagationError, from a
  ///         later look or edge: the thrust used up all mass.
  void set_thrust(SimTime t, const Thrust& thrust);
  const Thrust& thrust() const { return thrust_; }

  /// Runs `change`, which changes the attitude law from `t` on. Under a body-fixed thrust `t`
  /// becomes a grid point; otherwise the orbit does not depend on the attitude and nothing is
  /// propagated.
  void change_attitude(SimTime t, const std::function<void()>& change);

  /// What impulses and thrusts have delivered up to `t`, not before the last of them.
  Propulsion propulsion(SimTime t) const { return account_.at(t); }

  /// Osculating elements at `t`. Errors as at().
  QuasiNonsingularElements elements_at(SimTime t) {
    return to_quasi_nonsingular(inertial_state(at(t)));
  }

  /// RK4 steps computed so far, those thrown away for an impulse or an edge included; looks between
  /// grid points.
  std::uint64_t steps() const { return system_ ? system_->steps() : 0; }
  std::uint64_t interpolations() const { return system_ ? system_->interpolations() : 0; }

 private:
  /// What LazySystem propagates. It keeps the steps of the last minutes for recent(); that changes
  /// no result.
  class Model {
   public:
    using State = OrbitDynamics::State;
    explicit Model(OrbitDynamics dynamics) : dynamics_(std::move(dynamics)) {}
    State step(const State& from, SimTime, SimTime to);
    /// A look needs position and velocity only: the elements are left out.
    State interpolate(const State& a, SimTime, const State& b, SimTime, SimTime t) const {
      return State{.orbit = OrbitDynamics::interpolate(a, b, t)};
    }
    std::optional<SimTime> next_discontinuity(SimTime t) const {
      return dynamics_.next_discontinuity(t);
    }
    bool has_edges() const { return dynamics_.has_edges(); }
    std::optional<OrbitDynamics::Crossing> crossing(const State& a, SimTime, const State& b,
                                                    SimTime) const {
      return dynamics_.crossing(a, b);
    }
    State beyond(const State& at, const OrbitDynamics::Crossing& crossing) const {
      return dynamics_.beyond(at, crossing);
    }
    const OrbitDynamics& dynamics() const { return dynamics_; }
    OrbitDynamics& dynamics() { return dynamics_; }
    /// From the steps that were kept; empty before the first of them.
    std::optional<OrbitState> kept(SimTime t) const;

   private:
    struct Step {
      State from, to;
    };
    OrbitDynamics dynamics_;
    std::deque<Step> kept_;  // in order of time; the last may have been thrown away since
  };

  LazySystem<Model>& system();

  OrbitState initial_;
  SpacecraftOrbitOptions options_;
  std::optional<LazySystem<Model>> system_;  // from the first look on
  Thrust thrust_;
  PropulsionAccount account_;
};

}  // namespace orrery
