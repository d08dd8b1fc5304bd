// FormationFilter: single differences of phase, and what to do if they contradict the state.
#include <cmath>

#include "formation_gnc/navigation/filter_parts.hpp"

namespace formation_gnc {
namespace {

constexpr std::uint8_t kRejectionsToRestart = 2;
constexpr int kBadEpochsToReset = 2;
constexpr int kMostResets = 2;
constexpr int kGoodEpochsToTrust = 10;
// For a burn that was off by a few mm/s, and for anything else.
constexpr int kOpenings = 2;
constexpr double kOpened_r_m[kOpenings] = {0.1, 100.0}, kOpened_v_mps[kOpenings] = {0.005, 0.5};
constexpr double kContradiction_sigmas = 5.0;
// Memory of the slow test: 0.8 per epoch is five epochs.
constexpr double kMemory = 0.8;
constexpr double kSlow_sigmas = 7.0;

// chi2 of as many degrees of freedom beyond what happens once in 3 million epochs (Wilson &
// Hilferty 1931).
bool contradicts(const UpdateReport& report) {
  if (report.used + report.rejected < kFewestToJudge) return false;
  if (most_rejected(report)) return true;
  const double w = 2.0 / (9.0 * report.used);
  const double root = 1.0 - w + kContradiction_sigmas * std::sqrt(w);
  return report.chi2 > report.used * root * root * root;
}

// A burn of some 0.1 mm/s passes the test of each epoch and fails that of several: a fading sum of
// chi2, whose mean and variance are those of the degrees of freedom that went into it.
bool contradicts(const FadingChi2& sum) {
  return sum.chi2 > sum.mean + kSlow_sigmas * std::sqrt(sum.variance);
}

void add(const UpdateReport& report, FadingChi2* sum) {
  sum->chi2 = kMemory * sum->chi2 + report.chi2;
  sum->mean = kMemory * sum->mean + report.used;
  sum->variance = kMemory * kMemory * sum->variance + 2.0 * report.used;
}

}  // namespace

UpdateReport FormationFilter::sdcp_update(const GnssEpoch& self, const Quaternion& q_self,
                                          const GnssEpoch& other, const Quaternion& q_other,
                                          const SatelliteTable& satellites) {
  Sight a, b;
  look(kSelf, self, q_self, satellites, &a);
  look(kOther, other, q_other, satellites, &b);
  Differences all;
  for (int k = 0; k < a.count; ++k) {
    const int prn = a.observation[k]->prn, j = b.find(prn);
    // An ephemeris that came between both epochs' updates shows a satellite that has no arc yet.
    if (j < 0 || !arcs_[kSelf].seen(prn, t_ns_) || !arcs_[kOther].seen(prn, t_ns_)) continue;
    all.item[all.count++] =
        difference(*a.observation[k], a.predicted[k], *b.observation[j], b.predicted[j]);
  }
  sort_by_doubt(&all);
  const UdFactor before = ud_;
  UpdateReport report = take_all(&all);
  // Slips show in the lock times. When phases as a whole contradict the state nevertheless,
  // somebody burned whom nobody told, or not as told: the orbit is opened, ambiguities and integers
  // stay good.
  FadingChi2 sum = fading_;
  add(report, &sum);
  for (int size = 0; size < kOpenings && (contradicts(report) || contradicts(sum)); ++size) {
    ud_ = before;
    for (double& c : correction_) c = 0.0;
    open_relative_orbit(kOpened_r_m[size], kOpened_v_mps[size]);
    report = take_all(&all);
    sum = FadingChi2();
    ++openings_;
  }
  fading_ = sum;
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
        2.0 * square(options_.phase_floor_m) + square(unshared_ionosphere_m(p_other.line_of_sight));
  return d;
}

// Change of Lear's mapping function m(E) = 2.037 / (q + sin E), q^2 = sin^2 E + 0.076, over the
// angle at the Earth's centre between both.
double FormationFilter::unshared_ionosphere_m(const Vec3& line_of_sight) const {
  const double radius_m = norm(orbits_.r[kSelf]);
  const double sine = std::fmax(dot(line_of_sight, orbits_.r[kSelf]) / radius_m, 0.0);
  const double q = std::sqrt(sine * sine + 0.076);
  const double slope = 2.037 / ((q + sine) * q) * std::sqrt(1.0 - sine * sine);
  const double angle_rad = norm(orbits_.r[kOther] - orbits_.r[kSelf]) / radius_m;
  return options_.ionosphere_m * slope * angle_rad;
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

}  // namespace formation_gnc
