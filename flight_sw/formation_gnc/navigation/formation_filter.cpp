#include "formation_gnc/navigation/formation_filter.hpp"

#include <cmath>

#include "support/orbit/constants.hpp"

namespace formation_gnc {
namespace {

using flight_support::seconds;

constexpr int kSelf = 0, kOther = 1;
constexpr std::uint8_t kRejectionsToRestart = 2;
constexpr int kBadEpochsToReset = 2;
constexpr int kMostResets = 2;
constexpr int kBadGraphicToRestart = 3;
constexpr int kGoodEpochsToTrust = 10;
constexpr int kFewestToJudge = 4;
constexpr std::int64_t kWalkStep_ns = 60 * flight_support::kSecond_ns;
// For a burn that was off by a few mm/s, and for anything else.
constexpr int kOpenings = 2;
constexpr double kOpened_r_m[kOpenings] = {0.1, 100.0}, kOpened_v_mps[kOpenings] = {0.005, 0.5};
constexpr double kContradiction_sigmas = 5.0;

double square(double x) {
  return x * x;
}

int first_ambiguity(int who) {
  return who == kSelf ? kAmbiguitySelf : kAmbiguityOther;
}

// Of an epoch: the state is wrong then, not the measurements.
bool most_rejected(const UpdateReport& report) {
  const int tried = report.used + report.rejected;
  return tried >= kFewestToJudge && 2 * report.rejected > tried;
}

// chi2 of as many degrees of freedom beyond what happens once in 3 million epochs (Wilson &
// Hilferty 1931).
bool contradicts(const UpdateReport& report) {
  if (report.used + report.rejected < kFewestToJudge) return false;
  if (most_rejected(report)) return true;
  const double w = 2.0 / (9.0 * report.used);
  const double root = 1.0 - w + kContradiction_sigmas * std::sqrt(w);
  return report.chi2 > report.used * root * root * root;
}

double median(double* x, int count) {
  for (int i = 1; i < count; ++i) {
    const double held = x[i];
    int j = i;
    for (; j > 0 && x[j - 1] > held; --j) x[j] = x[j - 1];
    x[j] = held;
  }
  return count % 2 == 1 ? x[count / 2] : 0.5 * (x[count / 2 - 1] + x[count / 2]);
}

double phase_m(const CarrierArc& arc, const Observation& o) {
  return kWavelength_m * (o.phase_cycles - arc.base_cycles);
}

}  // namespace

FormationFilter::FormationFilter(const FilterOptions& options) : options_(options) {}

void FormationFilter::start(std::int64_t t_ns, const Vec3& r_ECI, const Vec3& v_ECI,
                            double sigma_r_m, double sigma_v_mps) {
  *this = FormationFilter(options_);
  t_ns_ = walked_ns_ = t_ns;
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
    ud_.forget(kAccelerationDifference + k, square(relative_sigma_mps2()));
  }
  for (int channel = 0; channel < kChannels; ++channel) arcs_[kOther][channel] = CarrierArc();
  integers_.release_all();
  other_started_ = true;
}

double FormationFilter::relative_sigma_mps2() const {
  const double separation_m = norm(orbits_.r[kOther] - orbits_.r[kSelf]);
  return std::hypot(options_.relative_sigma_mps2, options_.relative_sigma_per_m * separation_m);
}

void FormationFilter::forget_clocks() {
  ud_.forget(kClockSelf, square(options_.clock_sigma_m));
  ud_.forget(kClockDifference, square(options_.clock_sigma_m));
}

void FormationFilter::time_update(std::int64_t t_ns, const ManeuverList& maneuvers) {
  if (!started_ || t_ns <= t_ns_) return;
  const std::int64_t from_ns = t_ns_;
  forget_clocks();
  // Shares of manoeuvres by the instant at which they act, each once.
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
    step_to(next_ns);
    if (next < 0) break;
    apply_maneuver(maneuvers[next], maneuvers.share(next, from_ns, t_ns));
    done[next] = true;
  }
  if (t_ns_ - walked_ns_ >= kWalkStep_ns) walk_ambiguities();
}

// In steps that are short against the change of geometry, but not at every epoch: it costs 12
// additions of rank one.
void FormationFilter::walk_ambiguities() {
  const double sigma_cycles = options_.broadcast_walk_mps05 / (0.5 * kWavelength_m);
  const double variance = square(sigma_cycles) * seconds(t_ns_ - walked_ns_);
  walked_ns_ = t_ns_;
  for (int prn = 1; prn <= 32; ++prn) {
    const int at_self = arcs_[kSelf].find(prn), at_other = arcs_[kOther].find(prn);
    double g[kStates] = {};
    if (at_self >= 0) g[kAmbiguitySelf + at_self] = 1.0;
    if (at_other >= 0) g[kAmbiguityOther + at_other] = 1.0;
    const int last = at_other >= 0 ? kAmbiguityOther + at_other : kAmbiguitySelf + at_self;
    if (at_self >= 0 || at_other >= 0) ud_.add(variance, g, last);
  }
}

void FormationFilter::step_to(std::int64_t t_ns) {
  const std::int64_t span_ns = t_ns - t_ns_;
  const int steps = static_cast<int>(std::ceil(seconds(span_ns) / options_.orbit.longest_step_s));
  const std::int64_t begin_ns = t_ns_;
  for (int k = 1; k <= steps; ++k)
    step(begin_ns + span_ns / steps * k + (k == steps ? span_ns % steps : 0));
}

void FormationFilter::step(std::int64_t t_ns) {
  const double dt_s = seconds(t_ns - t_ns_);
  const OrbitPair before = orbits_;
  coast(&orbits_, t_ns_, dt_s, options_.orbit, &earth_);
  const Vec3 r_middle = 0.5 * (before.r[kSelf] + orbits_.r[kSelf]);
  const Vec3 v_middle = 0.5 * (before.v[kSelf] + orbits_.v[kSelf]);
  const OrbitTransition transition =
      orbit_transition(r_middle, v_middle, dt_s, options_.empirical_tau_s);
  for (int k = 0; k < 2; ++k) {
    orbits_.r[k] = orbits_.r[k] + transition.ra * orbits_.empirical_RTN[k];
    orbits_.v[k] = orbits_.v[k] + transition.va * orbits_.empirical_RTN[k];
    orbits_.empirical_RTN[k] = transition.aa * orbits_.empirical_RTN[k];
  }
  const Mat3 R_IH = rtn_to_eci(r_middle, v_middle);
  ud_.move_orbits(transition,
                  orbit_noise(R_IH, dt_s, options_.empirical_sigma_mps2, options_.empirical_tau_s),
                  orbit_noise(R_IH, dt_s, relative_sigma_mps2(), options_.empirical_tau_s));
  t_ns_ = t_ns;
}

void FormationFilter::apply_maneuver(const Maneuver& m, double share) {
  const int who = static_cast<int>(m.who);
  orbits_.v[who] = orbits_.v[who] + share * m.dv_ECI;
  const double variance = share * m.sigma_mps * m.sigma_mps;
  for (int k = 0; k < 3; ++k) {
    double g[kStates] = {};
    g[kVelocityDifference + k] = who == kSelf ? -1.0 : 1.0;
    if (who == kSelf) g[kVelocitySelf + k] = 1.0;
    ud_.add(variance, g, kVelocityDifference + k);
  }
}

AntennaState FormationFilter::antenna(int who, const Quaternion& q_BI) const {
  AntennaState a;
  a.r_ECI = orbits_.r[who] + transpose(rotation_of(q_BI)) * options_.lever_arm_B;
  a.v_ECI = orbits_.v[who];
  a.clock_m = clock_m_[who];
  return a;
}

struct FormationFilter::Sight {
  const Observation* observation[kChannels];
  Predicted predicted[kChannels];
  int count = 0;

  int find(int prn) const {
    int k = count - 1;
    while (k >= 0 && observation[k]->prn != prn) --k;
    return k;
  }
};

/// A scalar of sdcp_update(), and what it is made of.
struct FormationFilter::Difference {
  SparseRow h;
  double r = 0.0, innovation = 0.0;
  const Observation *self = nullptr, *other = nullptr;
  int at_self = 0, at_other = 0;  // channels
  bool rejected = false;
};
struct FormationFilter::Differences {
  int count = 0;
  Difference item[kChannels];
};

void FormationFilter::look(int who, const GnssEpoch& epoch, const Quaternion& q_BI,
                           const SatelliteTable& satellites, Sight* sight) const {
  const AntennaState a = antenna(who, q_BI);
  sight->count = 0;
  for (int k = 0; k < epoch.count; ++k) {
    if (!is_plausible(epoch.observation[k])) continue;
    const SatelliteState* satellite = satellites.find(epoch.observation[k].prn);
    if (satellite == nullptr) continue;
    sight->observation[sight->count] = &epoch.observation[k];
    sight->predicted[sight->count++] = predict(a, *satellite);
  }
}

// From the codes, so that a clock may do what it likes from epoch to epoch.
void FormationFilter::start_clock(int who, Sight* sight) {
  double residual_m[kChannels];
  for (int k = 0; k < sight->count; ++k) {
    residual_m[k] = sight->observation[k]->code_m - sight->predicted[k].range_m;
  }
  const double change_m = median(residual_m, sight->count);
  clock_m_[who] += change_m;
  for (int k = 0; k < sight->count; ++k) {
    sight->predicted[k].range_m += sight->predicted[k].clock_factor * change_m;
  }
}

void FormationFilter::start_ambiguity(int who, int channel, const Observation& o) {
  CarrierArc& arc = arcs_[who][channel];
  if (arc.prn != 0) release(arc.prn);
  arc = CarrierArc();
  arc.prn = o.prn;
  arc.half_cycle = o.half_cycle;
  arc.begin_ns = t_ns_;
  const double difference = o.phase_cycles - o.code_m / kWavelength_m;
  arc.base_cycles = std::nearbyint(difference);
  arc.ambiguity_cycles = difference - arc.base_cycles;
  arc.lock_s = o.lock_s;
  arc.last_ns = t_ns_;
  release(o.prn);
  const double sigma =
      std::hypot(options_.ambiguity_sigma_cycles,
                 2.0 * code_sigma_m(static_cast<double>(o.cn0_dBHz)) / kWavelength_m);
  const int state = first_ambiguity(who) + channel;
  ud_.forget(state, sigma * sigma);
  correction_[state] = 0.0;
}

void FormationFilter::track_arcs(int who, const Sight& sight) {
  CarrierArcs& arcs = arcs_[who];
  for (int k = 0; k < sight.count; ++k) {
    const Observation& o = *sight.observation[k];
    const int channel = arcs.channel_for(o.prn);
    const bool same = arcs[channel].prn == o.prn && arcs.continues(channel, o, t_ns_);
    if (!same) start_ambiguity(who, channel, o);
    arcs[channel].lock_s = o.lock_s;
    arcs[channel].last_ns = t_ns_;
  }
}

bool FormationFilter::take(const SparseRow& h, double r, double innovation, UpdateReport* report) {
  const Projection projection = ud_.project(h);
  const double s = projection.variance + r;
  double nu = innovation;
  for (int k = 0; k < h.count; ++k) nu -= h.value[k] * correction_[h.state[k]];
  // Written so that a NaN is rejected.
  if (!(nu * nu <= options_.gate * options_.gate * s)) {
    ++report->rejected;
    return false;
  }
  double gain[kStates];
  ud_.measure(projection, r, gain);
  for (int k = 0; k < kStates; ++k) correction_[k] += nu * gain[k];
  ++report->used;
  report->chi2 += nu * nu / s;
  return true;
}

void FormationFilter::settle() {
  clock_m_[kSelf] += correction_[kClockSelf];
  clock_m_[kOther] += correction_[kClockSelf] + correction_[kClockDifference];
  for (int k = 0; k < 3; ++k) {
    const double r = correction_[kPositionSelf + k], v = correction_[kVelocitySelf + k];
    const double a = correction_[kAccelerationSelf + k];
    orbits_.r[kSelf][k] += r;
    orbits_.v[kSelf][k] += v;
    orbits_.empirical_RTN[kSelf][k] += a;
    orbits_.r[kOther][k] += r + correction_[kPositionDifference + k];
    orbits_.v[kOther][k] += v + correction_[kVelocityDifference + k];
    orbits_.empirical_RTN[kOther][k] += a + correction_[kAccelerationDifference + k];
  }
  for (int channel = 0; channel < kChannels; ++channel) {
    arcs_[kSelf][channel].ambiguity_cycles += correction_[kAmbiguitySelf + channel];
    arcs_[kOther][channel].ambiguity_cycles += correction_[kAmbiguityOther + channel];
  }
  for (double& c : correction_) c = 0.0;
}

UpdateReport FormationFilter::graphic_update(Who which, const GnssEpoch& epoch,
                                             const Quaternion& q_BI,
                                             const SatelliteTable& satellites) {
  UpdateReport report;
  const int who = static_cast<int>(which);
  Sight sight;
  look(who, epoch, q_BI, satellites, &sight);
  if (sight.count == 0) return report;
  start_clock(who, &sight);
  track_arcs(who, sight);
  for (int k = 0; k < sight.count; ++k) {
    const Observation& o = *sight.observation[k];
    const Predicted& p = sight.predicted[k];
    const int channel = arcs_[who].find(o.prn);
    const CarrierArc& arc = arcs_[who][channel];
    SparseRow h;
    h.add(kClockSelf, p.clock_factor);
    if (who == kOther) h.add(kClockDifference, p.clock_factor);
    for (int axis = 0; axis < 3; ++axis) h.add(kPositionSelf + axis, -p.line_of_sight[axis]);
    for (int axis = 0; axis < 3 && who == kOther; ++axis) {
      h.add(kPositionDifference + axis, -p.line_of_sight[axis]);
    }
    h.add(first_ambiguity(who) + channel, 0.5 * kWavelength_m);
    const double measured_m = 0.5 * (o.code_m + phase_m(arc, o));
    const double predicted_m = p.range_m + 0.5 * kWavelength_m * arc.ambiguity_cycles;
    const double r =
        square(0.5 * code_sigma_m(static_cast<double>(o.cn0_dBHz))) + square(options_.code_floor_m);
    take(h, r, measured_m - predicted_m, &report);
  }
  settle();
  judge_graphic(who, report);
  return report;
}

// Codes do not lie by many sigmas in most channels: then it is the orbit.
void FormationFilter::judge_graphic(int who, const UpdateReport& report) {
  bad_graphic_[who] =
      most_rejected(report) ? static_cast<std::uint8_t>(bad_graphic_[who] + 1) : std::uint8_t{0};
  if (bad_graphic_[who] < kBadGraphicToRestart) return;
  bad_graphic_[who] = 0;
  if (who == kSelf) lost_ = true;
  if (who == kOther) other_started_ = false;
}

UpdateReport FormationFilter::sdcp_update(const GnssEpoch& self, const Quaternion& q_self,
                                          const GnssEpoch& other, const Quaternion& q_other,
                                          const SatelliteTable& satellites) {
  Sight a, b;
  look(kSelf, self, q_self, satellites, &a);
  look(kOther, other, q_other, satellites, &b);
  Differences all;
  for (int k = 0; k < a.count; ++k) {
    const int j = b.find(a.observation[k]->prn);
    if (j < 0) continue;
    all.item[all.count++] =
        difference(*a.observation[k], a.predicted[k], *b.observation[j], b.predicted[j]);
  }
  sort_by_doubt(&all);
  const UdFactor before = ud_;
  UpdateReport report = take_all(&all);
  // Slips show in the lock times. When phases as a whole contradict the state nevertheless,
  // somebody burned whom nobody told, or not as told: the orbit is opened, ambiguities and integers
  // stay good.
  for (int size = 0; size < kOpenings && contradicts(report); ++size) {
    ud_ = before;
    for (double& c : correction_) c = 0.0;
    open_relative_orbit(kOpened_r_m[size], kOpened_v_mps[size]);
    report = take_all(&all);
    ++openings_;
  }
  settle();
  judge(report, all);
  return report;
}

// The one in the middle first: it alone says what the clocks differ by, and one that slipped must
// not.
void FormationFilter::sort_by_doubt(Differences* all) const {
  double innovation_m[kChannels];
  for (int k = 0; k < all->count; ++k) innovation_m[k] = all->item[k].innovation;
  const double middle_m = all->count > 0 ? median(innovation_m, all->count) : 0.0;
  for (int i = 1; i < all->count; ++i) {
    const Difference held = all->item[i];
    const double doubt = std::fabs(held.innovation - middle_m);
    int j = i;
    for (; j > 0 && std::fabs(all->item[j - 1].innovation - middle_m) > doubt; --j) {
      all->item[j] = all->item[j - 1];
    }
    all->item[j] = held;
  }
}

UpdateReport FormationFilter::take_all(Differences* all) {
  UpdateReport report;
  for (int k = 0; k < all->count; ++k) {
    Difference& d = all->item[k];
    d.rejected = !take(d.h, d.r, d.innovation, &report);
  }
  return report;
}

FormationFilter::Difference FormationFilter::difference(const Observation& o_self,
                                                        const Predicted& p_self,
                                                        const Observation& o_other,
                                                        const Predicted& p_other) {
  Difference d;
  d.self = &o_self;
  d.other = &o_other;
  d.at_self = arcs_[kSelf].find(o_self.prn);
  d.at_other = arcs_[kOther].find(o_other.prn);
  const CarrierArc &self = arcs_[kSelf][d.at_self], &other = arcs_[kOther][d.at_other];
  d.h.add(kClockSelf, p_other.clock_factor - p_self.clock_factor);
  d.h.add(kClockDifference, p_other.clock_factor);
  for (int k = 0; k < 3; ++k) {
    d.h.add(kPositionSelf + k, p_self.line_of_sight[k] - p_other.line_of_sight[k]);
  }
  for (int k = 0; k < 3; ++k) d.h.add(kPositionDifference + k, -p_other.line_of_sight[k]);
  d.h.add(kAmbiguitySelf + d.at_self, -kWavelength_m);
  d.h.add(kAmbiguityOther + d.at_other, kWavelength_m);
  d.innovation = phase_m(other, o_other) - phase_m(self, o_self) -
                 (p_other.range_m - p_self.range_m) -
                 kWavelength_m * (other.ambiguity_cycles - self.ambiguity_cycles);
  d.r = square(phase_sigma_m(static_cast<double>(o_self.cn0_dBHz))) +
        square(phase_sigma_m(static_cast<double>(o_other.cn0_dBHz))) +
        2.0 * square(options_.phase_floor_m);
  return d;
}

void FormationFilter::judge(const UpdateReport& report, const Differences& all) {
  if (most_rejected(report)) {
    good_epochs_ = 0;
    if (++bad_epochs_ < kBadEpochsToReset) return;
    bad_epochs_ = 0;
    reset_ambiguities();
    if (++resets_in_a_row_ > kMostResets) lost_ = true;
    return;
  }
  bad_epochs_ = 0;
  if (good_epochs_ < kGoodEpochsToTrust) ++good_epochs_;
  if (good_epochs_ == kGoodEpochsToTrust) resets_in_a_row_ = 0;
  for (int k = 0; k < all.count; ++k) {
    std::uint8_t& rejections = arcs_[kOther][all.item[k].at_other].rejections;
    rejections = all.item[k].rejected ? static_cast<std::uint8_t>(rejections + 1) : std::uint8_t{0};
    if (rejections >= kRejectionsToRestart) restart_ambiguities(all.item[k]);
  }
}

// Of both: which one slipped cannot be told from the difference.
void FormationFilter::restart_ambiguities(const Difference& d) {
  start_ambiguity(kSelf, d.at_self, *d.self);
  start_ambiguity(kOther, d.at_other, *d.other);
}

void FormationFilter::release(int prn) {
  integers_.release(prn);
  trials_.forget(prn);
}

void FormationFilter::reset_ambiguities() {
  for (CarrierArcs& arcs : arcs_) {
    for (int channel = 0; channel < kChannels; ++channel) arcs[channel] = CarrierArc();
  }
  integers_.release_all();
  trials_ = IntegerTrials();
}

void FormationFilter::open_relative_orbit(double sigma_r_m, double sigma_v_mps) {
  for (int k = 0; k < 3; ++k) {
    double g[kStates] = {};
    g[kPositionDifference + k] = 1.0;
    ud_.add(square(sigma_r_m), g, kPositionDifference + k);
    g[kPositionDifference + k] = 0.0;
    g[kVelocityDifference + k] = 1.0;
    ud_.add(square(sigma_v_mps), g, kVelocityDifference + k);
  }
}

int FormationFilter::find_candidates(IntegerCandidate* candidates) const {
  int count = 0;
  for (int channel = 0; channel < kChannels; ++channel) {
    const CarrierArc& self = arcs_[kSelf][channel];
    const int at = self.prn != 0 ? arcs_[kOther].find(self.prn) : -1;
    if (at < 0) continue;
    const CarrierArc& other = arcs_[kOther][at];
    IntegerCandidate c;
    c.prn = self.prn;
    c.channel_self = channel;
    c.channel_other = at;
    c.cycles = other.ambiguity_cycles - self.ambiguity_cycles;
    const std::int64_t begin_ns = self.begin_ns > other.begin_ns ? self.begin_ns : other.begin_ns;
    c.lock_s = seconds(t_ns_ - begin_ns);
    c.held = integers_.holds(self.prn);
    const bool seen = self.last_ns == t_ns_ && other.last_ns == t_ns_;
    const bool sound = !self.half_cycle && !other.half_cycle && other.rejections == 0;
    if (seen && sound && c.lock_s >= static_cast<double>(options_.integers.lock_s)) {
      candidates[count++] = c;
    }
  }
  return count;
}

// One that is held, or was the reference before, or has been followed longest.
int FormationFilter::find_reference(const IntegerCandidate* candidates, int count) const {
  int best = 0;
  for (int k = 1; k < count; ++k) {
    const IntegerCandidate &a = candidates[k], &b = candidates[best];
    const bool a_before = a.prn == trials_.reference(), b_before = b.prn == trials_.reference();
    if (a.held != b.held ? a.held : (a_before != b_before ? a_before : a.lock_s > b.lock_s)) {
      best = k;
    }
  }
  return best;
}

IntegerReport FormationFilter::resolve_ambiguities() {
  IntegerReport report;
  if (!options_.integers.enabled) return report;
  IntegerCandidate candidates[kChannels];
  const int count = find_candidates(candidates);
  int held = 0;
  for (int k = 0; k < count; ++k) held += candidates[k].held ? 1 : 0;
  report.candidates = count - (held > 0 ? held : 1);
  if (report.candidates <= 0) return report;
  const int fewest = held > 0 ? 1 : options_.integers.fewest_satellites - 1;
  // Integers held of satellites out of sight now are of no help: a new set begins.
  if (held == 0 && count >= options_.integers.fewest_satellites) integers_.release_all();
  const IntegerCandidate& reference = candidates[find_reference(candidates, count)];
  const IntegerChoice choice =
      choose_integers(candidates, count, reference, ud_, fewest, options_.integers);
  report.tried = true;
  report.success_rate = choice.success_rate;
  report.ratio = choice.ratio;
  report.fixed = hold(choice, reference, fewest);
  return report;
}

int FormationFilter::hold(const IntegerChoice& choice, const IntegerCandidate& reference,
                          int fewest) {
  bool ripe[kChannels];
  int count = 0;
  for (int k = 0; k < choice.count; ++k) {
    const int streak = trials_.note(choice.difference[k].prn, reference.prn, choice.value[k]);
    ripe[k] = streak >= options_.integers.repetitions;
    count += ripe[k] ? 1 : 0;
  }
  trials_.end_attempt();
  if (count < fewest) return 0;
  const std::int32_t base = reference.held ? integers_.value(reference.prn) : 0;
  if (!reference.held) integers_.hold(reference.prn, 0);
  for (int k = 0; k < choice.count; ++k) {
    if (!ripe[k]) continue;
    const IntegerCandidate& d = choice.difference[k];
    integers_.hold(d.prn, base + choice.value[k]);
    constrain(d, reference, choice.value[k] - (d.cycles - reference.cycles));
  }
  settle();
  return count;
}

void FormationFilter::constrain(const IntegerCandidate& d, const IntegerCandidate& reference,
                                double innovation) {
  SparseRow h;
  h.add(kAmbiguitySelf + d.channel_self, -1.0);
  h.add(kAmbiguitySelf + reference.channel_self, 1.0);
  h.add(kAmbiguityOther + d.channel_other, 1.0);
  h.add(kAmbiguityOther + reference.channel_other, -1.0);
  double nu = innovation, gain[kStates];
  for (int k = 0; k < h.count; ++k) nu -= h.value[k] * correction_[h.state[k]];
  ud_.measure(ud_.project(h), square(options_.integers.hold_sigma_cycles), gain);
  for (int k = 0; k < kStates; ++k) correction_[k] += nu * gain[k];
}

}  // namespace formation_gnc
