#include <orrery/models/orbit/orbit_dynamics.hpp>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

namespace orrery {
namespace {

constexpr double kTwoPi = 6.283185307179586;

QuasiNonsingularElements plus(const QuasiNonsingularElements& x, double s,
                              const QuasiNonsingularElements& d) {
  return {x.a_m + s * d.a_m,           x.ex + s * d.ex,      x.ey + s * d.ey, x.i_rad + s * d.i_rad,
          x.raan_rad + s * d.raan_rad, x.u_rad + s * d.u_rad};
}

QuasiNonsingularElements weighted(const QuasiNonsingularElements& k1,
                                  const QuasiNonsingularElements& k2,
                                  const QuasiNonsingularElements& k3,
                                  const QuasiNonsingularElements& k4) {
  QuasiNonsingularElements sum = plus(k1, 2, k2);
  sum = plus(sum, 2, k3);
  return plus(sum, 1, k4);
}

// One turn less when a turn is complete, so that years lose no digits.
double unwound(double angle_rad) {
  return angle_rad >= kTwoPi ? angle_rad - kTwoPi : angle_rad;
}

std::string describe(const OrbitState& s) {
  const auto three = [](const Vec3& v) {
    return "(" + std::to_string(v.x) + ", " + std::to_string(v.y) + ", " + std::to_string(v.z) +
           ")";
  };
  return to_string(s.t) + ", r_ECI = " + three(s.r_ECI) + " m, v_ECI = " + three(s.v_ECI) + " m/s";
}

// The orbit's geometry at one instant.
struct Geometry {
  double p, h, eta, n;
  OrbitPoint point;
  double sin_i, cos_i;
  Vec3 R_ECI, T_ECI, N_ECI;
};

Geometry geometry(const QuasiNonsingularElements& x) {
  Geometry g;
  const double eta2 = 1 - x.ex * x.ex - x.ey * x.ey;
  g.eta = std::sqrt(eta2);
  g.p = x.a_m * eta2;
  g.h = std::sqrt(kMuEarth_m3ps2 * g.p);
  g.n = std::sqrt(kMuEarth_m3ps2 / x.a_m) / x.a_m;
  g.point = solve_kepler(x);
  g.sin_i = std::sin(x.i_rad), g.cos_i = std::cos(x.i_rad);
  const double cO = std::cos(x.raan_rad), sO = std::sin(x.raan_rad);
  const Vec3 node{cO, sO, 0}, ahead{-sO * g.cos_i, cO * g.cos_i, g.sin_i};
  g.R_ECI = g.point.cos_theta * node + g.point.sin_theta * ahead;
  g.T_ECI = -g.point.sin_theta * node + g.point.cos_theta * ahead;
  g.N_ECI = {sO * g.sin_i, -cO * g.sin_i, g.cos_i};
  return g;
}

InertialState inertial_state_at(const Geometry& g, const QuasiNonsingularElements& x) {
  const double c = g.point.cos_theta, s = g.point.sin_theta;
  const double mu_over_h = kMuEarth_m3ps2 / g.h;
  return {g.point.r_m * g.R_ECI,
          mu_over_h * ((x.ex * s - x.ey * c) * g.R_ECI + (1 + x.ex * c + x.ey * s) * g.T_ECI)};
}

// Battin's variational equations with (fR, fT, fN) the perturbing acceleration in RTN.
QuasiNonsingularElements gauss(const Geometry& g, const QuasiNonsingularElements& x,
                               const Vec3& f) {
  const double r = g.point.r_m, c = g.point.cos_theta, s = g.point.sin_theta;
  const double p = g.p, h = g.h;
  const double e_cos_f = p / r - 1, e_sin_f = x.ex * s - x.ey * c;
  const double normal = r * f.z / h;
  const double turn = s * g.cos_i / g.sin_i * normal;  // the node's motion seen in the plane
  return {2 * x.a_m * x.a_m / h * (e_sin_f * f.x + p / r * f.y),
          (p * s * f.x + ((p + r) * c + r * x.ex) * f.y) / h + x.ey * turn,
          (-p * c * f.x + ((p + r) * s + r * x.ey) * f.y) / h - x.ex * turn,
          c * normal,
          s * normal / g.sin_i,
          g.n - 2 * r * g.eta * f.x / h - turn +
              (-p * e_cos_f * f.x + (p + r) * e_sin_f * f.y) / (h * (1 + g.eta))};
}

Vec3 point_mass_ECI(const Vec3& r_ECI) {
  const double r = norm(r_ECI);
  return -kMuEarth_m3ps2 / (r * r * r) * r_ECI;
}

bool is_flyable(const QuasiNonsingularElements& x) {
  return x.a_m > 0 && std::isfinite(x.a_m) && x.ex * x.ex + x.ey * x.ey < 1 &&
         std::isfinite(x.i_rad) && std::isfinite(x.raan_rad) && std::isfinite(x.u_rad) &&
         std::sin(x.i_rad) > 1e-9;
}

// f(inside) > 0 >= f(beyond); the first of two neighbouring nanoseconds beyond the root between
// them. Secants, every third time halves.
template <class F>
SimTime narrowed_root(SimTime inside, double at_inside, SimTime beyond, double at_beyond,
                      const F& f) {
  for (int k = 1; beyond - inside > 1ns; ++k) {
    const Duration width = beyond - inside;
    const double share = k % 3 == 0 ? 0.5 : at_inside / (at_inside - at_beyond);
    Duration ahead = width / 2;
    if (share >= 0 && share <= 1) {
      ahead = Duration(static_cast<std::int64_t>(share * static_cast<double>(width.count())));
    }
    const SimTime t = inside + std::clamp(ahead, Duration(1ns), width - 1ns);
    const double here = f(t);
    if (here > 0) {
      inside = t, at_inside = here;
    } else {
      beyond = t, at_beyond = here;
    }
  }
  return beyond;
}

// The first instant after `from` at which f is no longer positive, to the nanosecond; f(to) is not.
// In parts of a sixteenth of the way, since the way may begin on an edge where f is zero.
template <class F>
SimTime first_root(SimTime from, SimTime to, const F& f) {
  SimTime inside = from;
  double at_inside = 0;
  for (int part = 1; part <= 16; ++part) {
    const SimTime t = part == 16 ? to : from + (to - from) / 16 * part;
    if (t <= from) continue;
    const double here = f(t);
    if (here > 0) {
      inside = t, at_inside = here;
    } else if (at_inside > 0 || part == 16) {
      return narrowed_root(inside, at_inside, t, here, f);
    }
  }
  return to;
}

}  // namespace

PropagationError::PropagationError(const std::string& what, const OrbitState& state)
    : std::runtime_error("propagation: " + what + "; last good state: " + describe(state)),
      state_(state) {}

struct OrbitDynamics::Point {
  QuasiNonsingularElements elements;
  Geometry geometry;
  OrbitState orbit;

  QuasiNonsingularElements rate(const Vec3& perturbation_ECI) const {
    const Vec3& f = perturbation_ECI;
    return gauss(geometry, elements,
                 {dot(geometry.R_ECI, f), dot(geometry.T_ECI, f), dot(geometry.N_ECI, f)});
  }
};

OrbitDynamics::OrbitDynamics(std::shared_ptr<const SpaceEnvironment> environment, Forces forces,
                             std::shared_ptr<const AttitudeLaw> attitude, OrbitVariables variables)
    : environment_(std::move(environment)), attitude_(std::move(attitude)), variables_(variables) {
  if (environment_ == nullptr) throw std::invalid_argument("OrbitDynamics: no environment given");
  std::size_t slots = 0;
  for (auto& model : forces) {
    if (model == nullptr) throw std::invalid_argument("OrbitDynamics: a force is null");
    Force force{std::move(model)};
    force.along_orbit = dynamic_cast<const ForceAlongOrbit*>(force.model.get());
    if (force.along_orbit != nullptr) {
      force.slot = slots++;
      has_edges_ = has_edges_ || force.along_orbit->has_edges();
    }
    forces_.push_back(std::move(force));
  }
  if (slots > kMostForcesAlongOrbit) {
    throw std::invalid_argument("OrbitDynamics: " + std::to_string(slots) +
                                " forces with a memory along the orbit; accepted: up to " +
                                std::to_string(kMostForcesAlongOrbit));
  }
}

OrbitDynamics::Point OrbitDynamics::point(SimTime t, const QuasiNonsingularElements& x,
                                          double mass_kg) {
  const Geometry g = geometry(x);
  const InertialState s = inertial_state_at(g, x);
  return {x, g, {t, s.r_ECI, s.v_ECI, mass_kg}};
}

OrbitDynamics::Point OrbitDynamics::checked_point(SimTime t, const QuasiNonsingularElements& x,
                                                  double mass_kg, const State& from) {
  // Before the forces see it: a field need not converge below the ground.
  if (!is_flyable(x)) throw PropagationError("the orbit is no longer an ellipse", from.orbit);
  const Point at = point(t, x, mass_kg);
  if (at.geometry.point.r_m < kRadiusEarth_m) {
    throw PropagationError("the orbit went below the ground", from.orbit);
  }
  return at;
}

Vec3 OrbitDynamics::perturbation_ECI(const Point& at, const Surroundings& around,
                                     const Memories& memories) const {
  Vec3 sum_ECI;
  for (const Force& force : forces_) {
    sum_ECI += force.along_orbit != nullptr
                   ? force.along_orbit->acceleration_ECI(at.orbit, around, memories[force.slot])
                   : force.model->acceleration_ECI(at.orbit, around);
  }
  if (!thrust_.is_off()) sum_ECI += thrust_acceleration_ECI(at.orbit);
  return sum_ECI;
}

Vec3 OrbitDynamics::thrust_acceleration_ECI(const OrbitState& orbit) const {
  Vec3 force_ECI = thrust_.force_ECI;
  if (thrust_.force_B != Vec3{}) {
    force_ECI += transpose(attitude_->R_BI(orbit.t, inertial_state(orbit))) * thrust_.force_B;
  }
  return force_ECI / orbit.mass_kg;
}

OrbitDynamics::State OrbitDynamics::completed(const Point& at, const Surroundings& around,
                                              const Memories& memories) const {
  const Vec3 f_ECI = perturbation_ECI(at, around, memories);
  const Vec3 a_ECI = f_ECI + point_mass_ECI(at.orbit.r_ECI);
  if (variables_ == OrbitVariables::kCartesian) return {at.orbit, {}, {}, a_ECI, a_ECI, memories};
  return {at.orbit, at.elements, at.rate(f_ECI), a_ECI, a_ECI, memories};
}

OrbitDynamics::Point OrbitDynamics::grid_point(const State& at) const {
  if (variables_ == OrbitVariables::kCartesian) return {{}, {}, at.orbit};
  return point(at.orbit.t, at.elements, at.orbit.mass_kg);
}

OrbitDynamics::Point OrbitDynamics::start_point(const OrbitState& initial) const {
  if (variables_ == OrbitVariables::kElements) {
    const QuasiNonsingularElements x = to_quasi_nonsingular(inertial_state(initial));
    require_above_ground(x, "OrbitDynamics::start");
    return point(initial.t, x, initial.mass_kg);
  }
  if (!(norm(initial.r_ECI) >= kRadiusEarth_m) || !is_finite(initial.r_ECI) ||
      !is_finite(initial.v_ECI)) {
    throw std::invalid_argument("OrbitDynamics::start: " + describe(initial) +
                                "; accepted: finite, |r_ECI| from " +
                                std::to_string(kRadiusEarth_m) + " m, the ground");
  }
  return {{}, {}, initial};
}

OrbitDynamics::State OrbitDynamics::start(const OrbitState& initial) const {
  if (!(initial.mass_kg > 0)) {
    throw std::invalid_argument("OrbitDynamics::start: mass_kg = " +
                                std::to_string(initial.mass_kg) + "; accepted: above 0");
  }
  const Point at = start_point(initial);
  const Surroundings around = environment_->surroundings(initial.t);
  Memories memories;
  for (const Force& force : forces_) {
    if (force.along_orbit == nullptr) continue;
    memories[force.slot] = force.along_orbit->begin(at.orbit, around);
  }
  return completed(at, around, memories);
}

OrbitDynamics::State OrbitDynamics::step(const State& from, SimTime to) const {
  try {
    return stepped(from, to);
  } catch (const std::logic_error& error) {
    throw PropagationError(error.what(), from.orbit);
  }
}

double OrbitDynamics::mass_kg(const State& from, SimTime t) const {
  return from.orbit.mass_kg - thrust_.mass_flow_kgps * to_seconds(t - from.orbit.t);
}

OrbitDynamics::Point OrbitDynamics::stepped_elements(const State& from, SimTime to,
                                                     const Surroundings& at_end) const {
  const Duration span = to - from.orbit.t;
  const double dt_s = to_seconds(span);
  const double mass_in_middle_kg = from.orbit.mass_kg - thrust_.mass_flow_kgps * (dt_s / 2);
  const double mass_at_end_kg = mass_kg(from, to);
  const SimTime middle = from.orbit.t + span / 2;
  // A force that is switched at `to` still has its old value on the way there.
  const SimTime just_before = to - 1ns;
  const auto rate_at = [&](SimTime t, const QuasiNonsingularElements& x, double mass,
                           const Surroundings& around) {
    const Point at = checked_point(t, x, mass, from);
    return at.rate(perturbation_ECI(at, around, from.memories));
  };
  const Surroundings in_middle = environment_->surroundings(middle);
  const QuasiNonsingularElements& x = from.elements;
  const QuasiNonsingularElements& k1 = from.rate;
  const QuasiNonsingularElements k2 =
      rate_at(middle, plus(x, dt_s / 2, k1), mass_in_middle_kg, in_middle);
  const QuasiNonsingularElements k3 =
      rate_at(middle, plus(x, dt_s / 2, k2), mass_in_middle_kg, in_middle);
  const QuasiNonsingularElements k4 =
      rate_at(just_before, plus(x, dt_s, k3), mass_at_end_kg, at_end);
  QuasiNonsingularElements next = plus(x, dt_s / 6, weighted(k1, k2, k3, k4));
  next.u_rad = unwound(next.u_rad);
  return checked_point(to, next, mass_at_end_kg, from);
}

OrbitDynamics::Point OrbitDynamics::stepped_cartesian(const State& from, SimTime to,
                                                      const Surroundings& at_end) const {
  const Duration span = to - from.orbit.t;
  const double h = to_seconds(span);
  const SimTime middle = from.orbit.t + span / 2;
  const auto checked = [&](SimTime t, const Vec3& r_ECI, const Vec3& v_ECI, double mass) -> Point {
    if (!(norm(r_ECI) >= kRadiusEarth_m))
      throw PropagationError("the orbit went below the ground", from.orbit);
    return {{}, {}, {t, r_ECI, v_ECI, mass}};
  };
  const auto acceleration_at = [&](SimTime t, const Vec3& r_ECI, const Vec3& v_ECI,
                                   const Surroundings& around) {
    const Point at = checked(t, r_ECI, v_ECI, mass_kg(from, t));
    return perturbation_ECI(at, around, from.memories) + point_mass_ECI(r_ECI);
  };
  const Surroundings in_middle = environment_->surroundings(middle);
  const Vec3 &r = from.orbit.r_ECI, &v = from.orbit.v_ECI, &a1 = from.a_ECI;
  const Vec3 v2 = v + (h / 2) * a1;
  const Vec3 a2 = acceleration_at(middle, r + (h / 2) * v, v2, in_middle);
  const Vec3 v3 = v + (h / 2) * a2;
  const Vec3 a3 = acceleration_at(middle, r + (h / 2) * v2, v3, in_middle);
  const Vec3 v4 = v + h * a3;
  // A force that is switched at `to` still has its old value on the way there.
  const Vec3 a4 = acceleration_at(to - 1ns, r + h * v3, v4, at_end);
  return checked(to, r + (h / 6) * (v + 2 * (v2 + v3) + v4),
                 v + (h / 6) * (a1 + 2 * (a2 + a3) + a4), mass_kg(from, to));
}

OrbitDynamics::State OrbitDynamics::stepped(const State& from, SimTime to) const {
  if (!(mass_kg(from, to) > 0)) throw PropagationError("a thrust used up all mass", from.orbit);
  const Surroundings at_end = environment_->surroundings(to);
  Point end = variables_ == OrbitVariables::kCartesian ? stepped_cartesian(from, to, at_end)
                                                       : stepped_elements(from, to, at_end);
  Memories memories = from.memories;
  for (const Force& force : forces_) {
    if (force.along_orbit == nullptr) continue;
    memories[force.slot] = force.along_orbit->next(from.memories[force.slot], end.orbit, at_end);
  }
  State state = completed(end, at_end, memories);
  if (next_discontinuity(from.orbit.t) == to) {
    end.orbit.t = to - 1ns;
    state.a_before_ECI =
        perturbation_ECI(end, at_end, from.memories) + point_mass_ECI(end.orbit.r_ECI);
  }
  return state;
}

std::optional<OrbitDynamics::Crossing> OrbitDynamics::crossing(const State& a,
                                                               const State& b) const {
  std::optional<Crossing> first;
  for (std::size_t k = 0; k < forces_.size(); ++k) {
    if (forces_[k].along_orbit == nullptr || !forces_[k].along_orbit->has_edges()) continue;
    const std::optional<SimTime> t = edge_of(forces_[k], a, b);
    if (t && (!first || *t < first->t)) first = Crossing{*t, k};
  }
  return first;
}

std::optional<SimTime> OrbitDynamics::edge_of(const Force& force, const State& a,
                                              const State& b) const {
  const ForceMemory& memory = a.memories[force.slot];
  const auto margin = [&](const OrbitState& state) {
    return force.along_orbit->margin(state, environment_->surroundings(state.t), memory);
  };
  const double at_end = margin(b.orbit);
  if (at_end > 0) return {};
  const auto margin_at = [&](SimTime t) {
    return t == b.orbit.t ? at_end : margin(interpolate(a, b, t));
  };
  return first_root(a.orbit.t, b.orbit.t, margin_at);
}

OrbitDynamics::State OrbitDynamics::beyond(const State& at, const Crossing& crossing) const {
  const Force& force = forces_[crossing.force];
  const Surroundings around = environment_->surroundings(at.orbit.t);
  Memories memories = at.memories;
  memories[force.slot] = force.along_orbit->crossed(at.memories[force.slot], at.orbit, around);
  State next = completed(grid_point(at), around, memories);
  next.a_before_ECI = at.a_before_ECI;
  return next;
}

OrbitDynamics::State OrbitDynamics::after_impulse(const State& at, const Vec3& dv_ECI) const {
  if (!is_finite(dv_ECI))
    throw std::domain_error("OrbitDynamics::after_impulse: dv_ECI is not finite");
  const InertialState kicked{at.orbit.r_ECI, at.orbit.v_ECI + dv_ECI};
  Point after{{}, {}, {at.orbit.t, kicked.r_ECI, kicked.v_ECI, at.orbit.mass_kg}};
  if (variables_ == OrbitVariables::kElements) {
    try {
      after = point(at.orbit.t, to_quasi_nonsingular(kicked), at.orbit.mass_kg);
    } catch (const std::invalid_argument& error) {
      throw PropagationError(std::string("impulse: ") + error.what(), at.orbit);
    }
  }
  const Surroundings around = environment_->surroundings(at.orbit.t);
  Memories memories = at.memories;
  for (const Force& force : forces_) {
    if (force.along_orbit == nullptr) continue;
    memories[force.slot] =
        force.along_orbit->after_impulse(at.memories[force.slot], after.orbit, around);
  }
  State next = completed(after, around, memories);
  // To the bit what the caller added: the detour over the elements rounds.
  next.orbit.v_ECI = kicked.v_ECI;
  next.orbit.r_ECI = kicked.r_ECI;
  return next;
}

void OrbitDynamics::check_thrust(const Thrust& thrust) const {
  if (!is_finite(thrust.force_B) || !is_finite(thrust.force_ECI) ||
      !std::isfinite(thrust.nozzle_N)) {
    throw std::invalid_argument("OrbitDynamics::set_thrust: a force that is not finite");
  }
  if (!(thrust.mass_flow_kgps >= 0 && std::isfinite(thrust.mass_flow_kgps))) {
    throw std::invalid_argument(
        "OrbitDynamics::set_thrust: mass_flow_kgps = " + std::to_string(thrust.mass_flow_kgps) +
        " kg/s; accepted: 0 or more");
  }
  if (thrust.force_B != Vec3{} && attitude_ == nullptr) {
    throw std::invalid_argument("OrbitDynamics::set_thrust: a body-fixed force needs an attitude");
  }
}

void OrbitDynamics::set_thrust(const Thrust& thrust) {
  check_thrust(thrust);
  thrust_ = thrust;
}

OrbitDynamics::State OrbitDynamics::under_new_thrust(const State& at) const {
  State next = completed(grid_point(at), environment_->surroundings(at.orbit.t), at.memories);
  next.orbit = at.orbit;  // to the bit, after an impulse too
  next.a_before_ECI = at.a_before_ECI;
  return next;
}

namespace {

// r = r_a + v_a dt + a_a dt^2/2 + s^3 (c3 + c4 s + c5 s^2), s = dt/h: the c match position,
// velocity and acceleration at b.
InertialState quintic(const OrbitDynamics::State& a, const OrbitDynamics::State& b, double h,
                      double dt) {
  const double s = dt / h;
  const Vec3 dr = b.orbit.r_ECI - a.orbit.r_ECI - h * a.orbit.v_ECI - (0.5 * h * h) * a.a_ECI;
  const Vec3 dv = h * (b.orbit.v_ECI - a.orbit.v_ECI - h * a.a_ECI);
  const Vec3 da = (h * h) * (b.a_before_ECI - a.a_ECI);
  const Vec3 c3 = 10 * dr - 4 * dv + 0.5 * da;
  const Vec3 c4 = -15 * dr + 7 * dv - da;
  const Vec3 c5 = 6 * dr - 3 * dv + 0.5 * da;
  return {a.orbit.r_ECI + dt * a.orbit.v_ECI + (0.5 * dt * dt) * a.a_ECI +
              (s * s * s) * (c3 + s * (c4 + s * c5)),
          a.orbit.v_ECI + dt * a.a_ECI + (s * s / h) * (3 * c3 + s * (4 * c4 + (5 * s) * c5))};
}

// v = v_a + a_a dt + s^2 (c2 + c3 s): the c match velocity and acceleration at b; r its integral.
InertialState cubic_in_velocity(const OrbitDynamics::State& a, const OrbitDynamics::State& b,
                                double h, double dt) {
  const double s = dt / h;
  const Vec3 dv = b.orbit.v_ECI - a.orbit.v_ECI - h * a.a_ECI;
  const Vec3 da = h * (b.a_before_ECI - a.a_ECI);
  const Vec3 c2 = 3 * dv - da;
  const Vec3 c3 = da - 2 * dv;
  return {a.orbit.r_ECI + dt * a.orbit.v_ECI + (0.5 * dt * dt) * a.a_ECI +
              (dt * s * s) * (c2 / 3 + (s / 4) * c3),
          a.orbit.v_ECI + dt * a.a_ECI + (s * s) * (c2 + s * c3)};
}

}  // namespace

OrbitState OrbitDynamics::interpolate(const State& a, const State& b, SimTime t) {
  constexpr double kShort_s = 2;
  const double h = to_seconds(b.orbit.t - a.orbit.t);
  const double dt = to_seconds(t - a.orbit.t);
  const InertialState at = h < kShort_s ? cubic_in_velocity(a, b, h, dt) : quintic(a, b, h, dt);
  const double lost_kg = b.orbit.mass_kg - a.orbit.mass_kg;
  return {t, at.r_ECI, at.v_ECI, a.orbit.mass_kg + (dt / h) * lost_kg};
}

std::optional<SimTime> OrbitDynamics::next_discontinuity(SimTime t) const {
  std::optional<SimTime> first;
  for (const Force& force : forces_) {
    const std::optional<SimTime> next = force.model->next_discontinuity(t);
    if (next && (!first || *next < *first)) first = next;
  }
  if (thrust_.force_B != Vec3{}) {
    const std::optional<SimTime> next = attitude_->next_discontinuity(t);
    if (next && (!first || *next < *first)) first = next;
  }
  return first;
}

}  // namespace orrery
