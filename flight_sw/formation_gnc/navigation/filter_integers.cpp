// FormationFilter: which ambiguities become integers.
#include "formation_gnc/navigation/filter_parts.hpp"
#include "support/orbit/constants.hpp"

namespace formation_gnc {

using flight_support::seconds;

namespace {

// sign * (channel less reference), in ascending order.
void add_difference(int first, int channel, int reference, double sign, SparseRow* h) {
  const bool in_order = channel < reference;
  h->add(first + (in_order ? channel : reference), in_order ? sign : -sign);
  h->add(first + (in_order ? reference : channel), in_order ? -sign : sign);
}

}  // namespace

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
  add_difference(kAmbiguitySelf, d.channel_self, reference.channel_self, -1.0, &h);
  add_difference(kAmbiguityOther, d.channel_other, reference.channel_other, 1.0, &h);
  double nu = innovation, gain[kStates];
  for (int k = 0; k < h.count; ++k) nu -= h.value[k] * correction_[h.state[k]];
  ud_.measure(ud_.project(h), square(options_.integers.hold_sigma_cycles), gain);
  for (int k = 0; k < kStates; ++k) correction_[k] += nu * gain[k];
}

}  // namespace formation_gnc
