#include <orrery/models/orbit/spacecraft_orbit.hpp>

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace orrery {
namespace {

constexpr Duration kRecent = 10min;

}  // namespace

OrbitDynamics::State SpacecraftOrbit::Model::step(const State& from, SimTime, SimTime to) {
  State end = dynamics_.step(from, to);
  // From the same point once more: something happened before the end of the step that was kept.
  while (!kept_.empty() && kept_.back().from.orbit.t >= from.orbit.t) kept_.pop_back();
  kept_.push_back({from, end});
  while (kept_.front().to.orbit.t < from.orbit.t - kRecent) kept_.pop_front();
  return end;
}

std::optional<OrbitState> SpacecraftOrbit::Model::kept(SimTime t) const {
  const auto starts_after = [](SimTime instant, const Step& step) {
    return instant < step.from.orbit.t;
  };
  const auto next = std::upper_bound(kept_.begin(), kept_.end(), t, starts_after);
  if (next == kept_.begin()) return {};
  const Step& step = *std::prev(next);
  if (t == step.from.orbit.t) return step.from.orbit;
  return OrbitDynamics::interpolate(step.from, step.to, t);
}

SpacecraftOrbit::SpacecraftOrbit(const OrbitState& initial, SpacecraftOrbitOptions options)
    : initial_(initial), options_(std::move(options)) {
  if (options_.step <= Duration::zero()) {
    throw std::invalid_argument("SpacecraftOrbit: step = " + to_string(options_.step) +
                                "; accepted: above 0");
  }
  // Everything that could be wrong shows here rather than at the first look.
  OrbitDynamics(options_.environment, options_.forces, {}, options_.variables).start(initial_);
}

void SpacecraftOrbit::add_force(std::shared_ptr<const ForceModel> force) {
  if (system_) throw std::logic_error("SpacecraftOrbit::add_force: the orbit has started");
  if (force == nullptr) throw std::invalid_argument("SpacecraftOrbit::add_force: null");
  options_.forces.push_back(std::move(force));
}

LazySystem<SpacecraftOrbit::Model>& SpacecraftOrbit::system() {
  if (!system_) {
    OrbitDynamics dynamics(options_.environment, options_.forces, options_.attitude,
                           options_.variables);
    const OrbitDynamics::State start = dynamics.start(initial_);
    system_.emplace(Model(std::move(dynamics)), start, initial_.t, options_.step);
  }
  return *system_;
}

OrbitState SpacecraftOrbit::at(SimTime t) {
  return system().at(t).orbit;
}

OrbitState SpacecraftOrbit::recent(SimTime t) {
  const SimTime passed = system().committed_time();
  if (t >= passed) return at(t);
  const SimTime earliest = std::max(initial_.t, passed - kRecent);
  const std::optional<OrbitState> state = t < earliest ? std::nullopt : system().model().kept(t);
  if (!state) {
    throw std::logic_error("SpacecraftOrbit::recent: t = " + to_string(t) + "; accepted: from " +
                           to_string(earliest) + " on");
  }
  return *state;
}

void SpacecraftOrbit::apply_impulse(SimTime t, const Vec3& dv_ECI) {
  LazySystem<Model>& orbit = system();
  orbit.discontinuity(t, [&](OrbitDynamics::State& state) {
    state = orbit.model().dynamics().after_impulse(state, dv_ECI);
    account_.impulse(norm(dv_ECI), state.orbit.mass_kg);
  });
}

void SpacecraftOrbit::set_thrust(SimTime t, const Thrust& thrust) {
  LazySystem<Model>& orbit = system();
  orbit.model().dynamics().check_thrust(thrust);  // before `t` becomes a grid point
  orbit.discontinuity(t, [&](OrbitDynamics::State& state) {
    orbit.model().dynamics().set_thrust(thrust);
    state = orbit.model().dynamics().under_new_thrust(state);
    account_.thrust(t, thrust, state.orbit.mass_kg);
    thrust_ = thrust;
  });
}

void SpacecraftOrbit::change_attitude(SimTime t, const std::function<void()>& change) {
  if (thrust_.force_B == Vec3{}) return change();
  LazySystem<Model>& orbit = system();
  orbit.discontinuity(t, [&](OrbitDynamics::State& state) {
    change();
    state = orbit.model().dynamics().under_new_thrust(state);
  });
}

}  // namespace orrery
