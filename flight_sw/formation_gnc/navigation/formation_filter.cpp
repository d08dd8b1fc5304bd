#include <cmath>

#include "formation_gnc/navigation/filter_parts.hpp"
#include "formation_gnc/navigation/flight_gravity.hpp"
#include "support/orbit/constants.hpp"

namespace formation_gnc {
namespace {

using flight_support::seconds;

constexpr int kWalksPerUpdate = 2;

// Root mean squares, over a day at 550 km and 97.6 deg, of the gradient of what GGM05S has from
// degree 21 to 60 [1/s^2]: R, T, N of acceleration by R, T, N of separation. They change over
// 60 to 120 s.
constexpr double kOmittedGradient[3][3] = {
    {3.0e-11, 2.2e-11, 2.0e-11}, {2.2e-11, 1.9e-11, 0.9e-11}, {2.0e-11, 0.9e-11, 1.7e-11}};

}  // namespace

FormationFilter::FormationFilter(const FilterOptions& options) : options_(options) {
  OrbitPairOptions& orbit = options_.orbit;
  orbit.gravity_degree = orbit.gravity_degree < 2 ? 2 : orbit.gravity_degree;
  orbit.gravity_degree =
      orbit.gravity_degree > kGravityDegree ? kGravityDegree : orbit.gravity_degree;
  orbit.longest_step_s = std::fmin(std::fmax(orbit.longest_step_s, 1.0), 30.0);
  options_.empirical_tau_s = std::fmax(options_.empirical_tau_s, 4.0 * orbit.longest_step_s);
}

void FormationFilter::start(std::int64_t t_ns, const Vec3& r_ECI, const Vec3& v_ECI,
                            double sigma_r_m, double sigma_v_mps) {
  *this = FormationFilter(options_);
  t_ns_ = t_ns;
  started_ = true;
  const double r = std::fmax(sigma_r_m, options_.start_sigma_r_m);
  const double v = std::fmax(sigma_v_mps, options_.start_sigma_v_mps);
  for (int k = 0; k < 2; ++k) {
    orbits_.r[k] = r_ECI;
    orbits_.v[k] = v_ECI;
  }
  for (int k = 0; k < 3; ++k) {
    ud_.forget(kPositionSelf + k, r * r);
    ud_.forget(kVelocitySelf + k, v * v);
    ud_.forget(kAccelerationSelf + k, square(options_.empirical_sigma_mps2));
  }
  forget_clocks();
}

void FormationFilter::start_other(const Vec3& r_ECI, const Vec3& v_ECI, double sigma_r_m,
                                  double sigma_v_mps) {
  orbits_.r[kOther] = r_ECI;
  orbits_.v[kOther] = v_ECI;
  orbits_.empirical_RTN[kOther] = orbits_.empirical_RTN[kSelf];
  const double r = std::fmax(sigma_r_m, options_.start_sigma_relative_r_m);
  const double v = std::fmax(sigma_v_mps, options_.start_sigma_relative_v_mps);
  for (int k = 0; k < 3; ++k) {
    // Of the difference to self, whose own error is not the fix's.
    ud_.forget(kPositionDifference + k, r * r + ud_.variance(kPositionSelf + k));
    ud_.forget(kVelocityDifference + k, v * v + ud_.variance(kVelocitySelf + k));
    ud_.forget(kAccelerationDifference + k, square(empirical_difference().sigma_mps2[k]));
  }
  for (int channel = 0; channel < kChannels; ++channel) arcs_[kOther][channel] = CarrierArc();
  integers_.release_all();
  other_started_ = true;
}

EmpiricalAcceleration FormationFilter::empirical_self() const {
  const double sigma = options_.empirical_sigma_mps2, tau = options_.empirical_tau_s;
  EmpiricalAcceleration e;
  for (int k = 0; k < 3; ++k) {
    e.sigma_mps2[k] = sigma;
    e.tau_s[k] = tau;
  }
  return e;
}

// States are what lasts: drag along track, and radiation, which stands still in inertial space and
// so along the normal. Omitted gravity is white noise of the same effect.
EmpiricalAcceleration FormationFilter::empirical_difference() const {
  constexpr int kAlong = 1, kNormal = 2;
  const Mat3 R_IH = rtn_to_eci(orbits_.r[kSelf], orbits_.v[kSelf]);
  const Vec3 separation = transpose(R_IH) * (orbits_.r[kOther] - orbits_.r[kSelf]);
  EmpiricalAcceleration e;
  for (int k = 0; k < 3; ++k) {
    double gravity = 0.0;
    for (int j = 0; j < 3; ++j) {
      gravity += square(options_.omitted_gradient_factor * kOmittedGradient[k][j] * separation[j]);
    }
    e.white_m2ps3[k] = 2.0 * gravity * options_.empirical_tau_s;
    e.sigma_mps2[k] = options_.radiation_difference_mps2;
    e.tau_s[k] = k == kNormal ? options_.drag_tau_s : options_.radiation_tau_s;
  }
  e.sigma_mps2[kAlong] = std::hypot(e.sigma_mps2[kAlong], options_.drag_difference_mps2);
  e.tau_s[kAlong] = options_.drag_tau_s;
  return e;
}

void FormationFilter::forget_clocks() {
  ud_.forget(kClockSelf, square(options_.clock_sigma_m));
  ud_.forget(kClockDifference, square(options_.clock_sigma_m));
}

void FormationFilter::time_update(std::int64_t t_ns, const ManeuverList& maneuvers) {
  if (!started_ || t_ns <= t_ns_) return;
  forget_clocks();
  move_to(t_ns, maneuvers, What::kAll);
  walk_ambiguities();
}

OrbitPair FormationFilter::orbits_at(std::int64_t t_ns, const ManeuverList& maneuvers) const {
  FormationFilter moved = *this;
  moved.move_to(t_ns, maneuvers, What::kOrbitsOnly);
  return moved.orbits_;
}

// Shares of manoeuvres by the instant at which they act, each once.
void FormationFilter::move_to(std::int64_t t_ns, const ManeuverList& maneuvers, What what) {
  const std::int64_t from_ns = t_ns_;
  bool done[ManeuverList::kCapacity] = {};
  for (;;) {
    int next = -1;
    std::int64_t next_ns = t_ns;
    for (int k = 0; k < maneuvers.count(); ++k) {
      if (done[k] || !(maneuvers.share(k, from_ns, t_ns) > 0.0)) continue;
      const std::int64_t at_ns = maneuvers.middle_of_share(k, from_ns, t_ns);
      if (next < 0 || at_ns < next_ns) {
        next = k;
        next_ns = at_ns;
      }
    }
    step_to(next_ns, what);
    if (next < 0) return;
    apply_maneuver(maneuvers[next], maneuvers.share(next, from_ns, t_ns));
    done[next] = true;
  }
}

// Two satellites at each update, in turn: at 10 s each of twelve once a minute, which is short
// against the change of geometry. All at each would cost a quarter of the epoch.
void FormationFilter::walk_ambiguities() {
  const double sigma_cycles = options_.broadcast_walk_mps05 / (0.5 * kWavelength_m);
  for (int tried = 0, walked = 0; tried < 32 && walked < kWalksPerUpdate; ++tried) {
    walk_prn_ = static_cast<std::uint8_t>(walk_prn_ % 32 + 1);
    const int at_self = arcs_[kSelf].find(walk_prn_), at_other = arcs_[kOther].find(walk_prn_);
    if (at_self < 0 && at_other < 0) continue;
    CarrierArc& arc = at_self >= 0 ? arcs_[kSelf][at_self] : arcs_[kOther][at_other];
    double g[kStates] = {};
    if (at_self >= 0) g[kAmbiguitySelf + at_self] = 1.0;
    if (at_other >= 0) g[kAmbiguityOther + at_other] = 1.0;
    const int last = at_other >= 0 ? kAmbiguityOther + at_other : kAmbiguitySelf + at_self;
    ud_.add(square(sigma_cycles) * seconds(t_ns_ - arc.walked_ns), g, last);
    arc.walked_ns = t_ns_;
    ++walked;
  }
}

void FormationFilter::step_to(std::int64_t t_ns, What what) {
  const std::int64_t span_ns = t_ns - t_ns_;
  const int steps = static_cast<int>(std::ceil(seconds(span_ns) / options_.orbit.longest_step_s));
  const std::int64_t begin_ns = t_ns_;
  for (int k = 1; k <= steps; ++k)
    step(begin_ns + span_ns / steps * k + (k == steps ? span_ns % steps : 0), what);
}

void FormationFilter::step(std::int64_t t_ns, What what) {
  const double dt_s = seconds(t_ns - t_ns_);
  const OrbitPair before = orbits_;
  coast(&orbits_, t_ns_, dt_s, options_.orbit, &earth_);
  const Vec3 r_middle = 0.5 * (before.r[kSelf] + orbits_.r[kSelf]);
  const Vec3 v_middle = 0.5 * (before.v[kSelf] + orbits_.v[kSelf]);
  const Mat3 R_IH = rtn_to_eci(r_middle, v_middle);
  const EmpiricalAcceleration self = empirical_self(), difference = empirical_difference();
  const OrbitTransition own = orbit_transition(r_middle, v_middle, dt_s, self.tau_s);
  const OrbitTransition others = with_time_constants(own, R_IH, dt_s, difference.tau_s);
  push(own, others);
  t_ns_ = t_ns;
  if (what == What::kOrbitsOnly) return;
  ud_.move_orbits(own, others, orbit_noise(R_IH, dt_s, self), orbit_noise(R_IH, dt_s, difference));
}

// The companion's empirical acceleration is self's and the difference, each with its own time
// constants.
void FormationFilter::push(const OrbitTransition& self, const OrbitTransition& difference) {
  Vec3(&a)[2] = orbits_.empirical_RTN;
  const Vec3 more = a[kOther] - a[kSelf];
  const Vec3 dr = self.ra * a[kSelf], dv = self.va * a[kSelf];
  orbits_.r[kSelf] = orbits_.r[kSelf] + dr;
  orbits_.v[kSelf] = orbits_.v[kSelf] + dv;
  orbits_.r[kOther] = orbits_.r[kOther] + dr + difference.ra * more;
  orbits_.v[kOther] = orbits_.v[kOther] + dv + difference.va * more;
  for (int k = 0; k < 3; ++k) {
    a[kSelf][k] *= self.aa[k];
    a[kOther][k] = a[kSelf][k] + difference.aa[k] * more[k];
  }
}

void FormationFilter::apply_maneuver(const Maneuver& m, double share) {
  const int who = static_cast<int>(m.who);
  orbits_.v[who] = orbits_.v[who] + share * m.dv_ECI;
  const double of_other = who == kSelf ? -1.0 : 1.0;
  for (int k = 0; k < 3; ++k) {
    double g[kStates] = {};
    g[kVelocityDifference + k] = of_other;
    if (who == kSelf) g[kVelocitySelf + k] = 1.0;
    ud_.add(share * square(m.sigma_mps), g, kVelocityDifference + k);
  }
  const double size_mps = norm(m.dv_ECI);
  if (!(m.more_along_mps > 0.0) || !(size_mps > 0.0)) return;
  double g[kStates] = {};
  for (int k = 0; k < 3; ++k) {
    const double along = m.dv_ECI[k] / size_mps;
    g[kVelocityDifference + k] = of_other * along;
    if (who == kSelf) g[kVelocitySelf + k] = along;
  }
  ud_.add(share * square(m.more_along_mps), g, kVelocityDifference + 2);
}

}  // namespace formation_gnc
