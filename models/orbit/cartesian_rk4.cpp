#include <orrery/models/orbit/cartesian_rk4.hpp>

#include <string>

namespace orrery {
namespace {

void require_above_ground(const Vec3& r_ECI, const OrbitState& last_good) {
  // Before the forces see it: a field need not converge below the ground.
  if (!(norm(r_ECI) >= kRadiusEarth_m))
    throw PropagationError("the orbit went below the ground", last_good);
}

}  // namespace

Vec3 acceleration_ECI(const OrbitDynamics::Forces& forces, const OrbitState& state,
                      const Surroundings& around) {
  Vec3 a_ECI;
  for (const auto& force : forces) a_ECI += force->acceleration_ECI(state, around);
  const double r = norm(state.r_ECI);
  return a_ECI - kMuEarth_m3ps2 / (r * r * r) * state.r_ECI;
}

std::optional<SimTime> next_discontinuity(const OrbitDynamics::Forces& forces, SimTime t) {
  std::optional<SimTime> first;
  for (const auto& force : forces) {
    const std::optional<SimTime> next = force->next_discontinuity(t);
    if (next && (!first || *next < *first)) first = next;
  }
  return first;
}

CartesianRk4::CartesianRk4(std::shared_ptr<const SpaceEnvironment> environment,
                           OrbitDynamics::Forces forces)
    : environment_(std::move(environment)), forces_(std::move(forces)) {
  if (environment_ == nullptr) throw std::invalid_argument("CartesianRk4: no environment given");
  for (const auto& force : forces_) {
    if (force == nullptr) throw std::invalid_argument("CartesianRk4: a force is null");
  }
}

CartesianRk4::State CartesianRk4::start(const OrbitState& initial) const {
  if (!(initial.mass_kg > 0)) {
    throw std::invalid_argument("CartesianRk4::start: mass_kg = " +
                                std::to_string(initial.mass_kg) + "; accepted: above 0");
  }
  if (!is_finite(initial.r_ECI) || !is_finite(initial.v_ECI))
    throw std::invalid_argument("CartesianRk4::start: a state that is not finite");
  if (norm(initial.r_ECI) < kRadiusEarth_m) {
    throw std::invalid_argument(
        "CartesianRk4::start: |r_ECI| = " + std::to_string(norm(initial.r_ECI)) +
        " m; accepted: from " + std::to_string(kRadiusEarth_m) + " m, the ground");
  }
  const Vec3 a_ECI = acceleration_ECI(forces_, initial, environment_->surroundings(initial.t));
  return {.orbit = initial, .a_ECI = a_ECI, .a_before_ECI = a_ECI};
}

CartesianRk4::State CartesianRk4::step(const State& from, SimTime, SimTime to) const {
  const Duration span = to - from.orbit.t;
  const double h = to_seconds(span), mass_kg = from.orbit.mass_kg;
  const SimTime middle = from.orbit.t + span / 2;
  // A force that is switched at `to` still has its old value on the way there.
  const SimTime just_before = to - 1ns;
  const Vec3 &r = from.orbit.r_ECI, &v = from.orbit.v_ECI;
  const auto a = [&](SimTime t, const Vec3& r_ECI, const Vec3& v_ECI, const Surroundings& around) {
    require_above_ground(r_ECI, from.orbit);
    return acceleration_ECI(forces_, {t, r_ECI, v_ECI, mass_kg}, around);
  };
  const Surroundings in_middle = environment_->surroundings(middle);
  const Surroundings at_end = environment_->surroundings(to);
  const Vec3 a1 = from.a_ECI;
  const Vec3 v2 = v + (h / 2) * a1;
  const Vec3 a2 = a(middle, r + (h / 2) * v, v2, in_middle);
  const Vec3 v3 = v + (h / 2) * a2;
  const Vec3 a3 = a(middle, r + (h / 2) * v2, v3, in_middle);
  const Vec3 v4 = v + h * a3;
  const Vec3 a4 = a(just_before, r + h * v3, v4, at_end);

  State end;
  end.orbit = {to, r + (h / 6) * (v + 2 * (v2 + v3) + v4), v + (h / 6) * (a1 + 2 * (a2 + a3) + a4),
               mass_kg};
  require_above_ground(end.orbit.r_ECI, from.orbit);
  end.a_ECI = end.a_before_ECI = acceleration_ECI(forces_, end.orbit, at_end);
  if (next_discontinuity(from.orbit.t) == to) {
    OrbitState before = end.orbit;
    before.t = just_before;
    end.a_before_ECI = acceleration_ECI(forces_, before, at_end);
  }
  return end;
}

CartesianRk4::State CartesianRk4::after_impulse(const State& at, const Vec3& dv_ECI) const {
  if (!is_finite(dv_ECI))
    throw std::domain_error("CartesianRk4::after_impulse: dv_ECI is not finite");
  State kicked = at;
  kicked.orbit.v_ECI += dv_ECI;
  kicked.a_ECI = kicked.a_before_ECI =
      acceleration_ECI(forces_, kicked.orbit, environment_->surroundings(at.orbit.t));
  return kicked;
}

}  // namespace orrery
