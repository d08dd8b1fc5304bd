#include "formation_gnc/navigation/navigation.hpp"

#include <cmath>

#include "support/orbit/constants.hpp"

namespace formation_gnc {
namespace {

using flight_support::kSecond_ns;
using flight_support::nanoseconds;

// Own epochs that step back come from a receiver that found another time, if they keep doing so.
constexpr int kStrangeTimesToRestart = 3;
// Beyond this the orbits are started anew from a fix rather than moved that far.
constexpr std::int64_t kLongestGap_ns = 3600 * kSecond_ns;
// A companion's epoch ahead of all own ones by more is no epoch.
constexpr std::int64_t kMostAhead_ns = 600 * kSecond_ns;

struct FixEci {
  Vec3 r, v;
};

// Of the centre of mass: the fix is that of the antenna.
FixEci fix_of(const GnssEpoch& epoch, const Quaternion& q_BI, const FilterOptions& options) {
  const flight_support::StateEci s = flight_support::eci_from_ecef(
      epoch.t_ns, epoch.r_ECEF, epoch.v_ECEF, options.orbit.earth_time);
  return {s.r_ECI - transpose(rotation_of(q_BI)) * options.lever_arm_B, s.v_ECI};
}

}  // namespace

Navigation::Navigation(const NavigationOptions& options)
    : options_(options), filter_(options.filter) {
  if (options_.replay_depth < 2) options_.replay_depth = 2;
  if (options_.replay_depth > EpochRing::kCapacity) options_.replay_depth = EpochRing::kCapacity;
}

void Navigation::reset() {
  filter_ = FormationFilter(options_.filter);
  ring_.clear();
  processed_ = 0;
  strange_times_ = 0;
  last_own_ns_ = last_remote_ns_ = 0;
}

void Navigation::ephemeris(const BroadcastEphemeris& ephemeris) {
  ephemerides_.add(ephemeris);
}

void Navigation::own_epoch(const GnssEpoch& epoch, const Quaternion& q_BI) {
  insert(Who::kSelf, epoch, q_BI);
}

void Navigation::remote_epoch(const GnssEpoch& epoch, const Quaternion& q_BI) {
  insert(Who::kOther, epoch, q_BI);
}

std::int64_t Navigation::newest_own_ns() const {
  for (int k = ring_.count() - 1; k >= 0; --k) {
    if (ring_[k].has_own) return ring_[k].t_ns;
  }
  return 0;
}

// Times that leap are those of a receiver or a companion that lost GPS time. A receiver that keeps
// to its new time is believed.
bool Navigation::accept_time(Who who, std::int64_t t_ns) {
  const std::int64_t newest_ns = newest_own_ns();
  if (newest_ns == 0) return true;
  if (who == Who::kOther) return t_ns - newest_ns <= kMostAhead_ns;
  const bool strange = t_ns < ring_[0].t_ns || t_ns - newest_ns > kLongestGap_ns;
  if (!strange) {
    strange_times_ = 0;
    return true;
  }
  if (++strange_times_ < kStrangeTimesToRestart) return false;
  reset();
  return true;
}

/// Where an epoch belongs.
struct Navigation::Place {
  int until = -1;        // latest entry not after it, or -1
  bool known = false;    // that entry has its time
  bool awaited = false;  // it is the companion's part of the epoch at which the filter stands
  bool late = false;     // the filter has passed it otherwise
};

Navigation::Place Navigation::place_of(bool own, std::int64_t t_ns) const {
  Place p;
  p.until = ring_.last_until(t_ns);
  p.known = p.until >= 0 && ring_[p.until].t_ns == t_ns;
  p.awaited = p.known && !own && processed_ == p.until + 1;
  p.late = !p.awaited && processed_ > (p.known ? p.until : p.until + 1);
  return p;
}

// Can the filter go back behind the last entry, or part of one, that stays as it is? Before the
// first one only if it had not started there.
bool Navigation::may_take(bool own, const Place& place) const {
  if (!place.late) return true;
  if (!own && options_.late != LatePolicy::kRewindReplay) return false;
  const int kept = place.known && own ? place.until - 1 : place.until;
  return kept >= 0 || !ring_[0].after_own.started();
}

int Navigation::make_entry(std::int64_t t_ns) {
  const bool full = ring_.count() >= options_.replay_depth;
  const int at = ring_.insert(t_ns, options_.replay_depth);
  if (at >= 0 && full && processed_ > 0) --processed_;
  return at;
}

void Navigation::insert(Who who, const GnssEpoch& epoch, const Quaternion& q_BI) {
  const bool own = who == Who::kSelf;
  if (!is_plausible(epoch) || !is_plausible(q_BI) || !accept_time(who, epoch.t_ns)) {
    ++statistics_.dropped;
    return;
  }
  const Place place = place_of(own, epoch.t_ns);
  if (place.known && (own ? ring_[place.until].has_own : ring_[place.until].has_remote)) {
    ++statistics_.duplicates;
    return;
  }
  int at = -1;
  if (may_take(own, place)) at = place.known ? place.until : make_entry(epoch.t_ns);
  if (at < 0) {
    ++statistics_.dropped;
    return;
  }
  EpochEntry& entry = ring_[at];
  (own ? entry.has_own : entry.has_remote) = true;
  (own ? entry.own : entry.remote) = epoch;
  (own ? entry.q_own : entry.q_remote) = q_BI;
  ++(own ? statistics_.own_epochs : statistics_.remote_epochs);
  if (place.awaited) {
    remote_phase(entry);
    return;
  }
  if (place.late) {
    ++statistics_.late;
    rewind_behind(place.known && !own ? at : at - 1);
  }
  process_from(processed_);
}

// From the snapshot that was taken before the companion's part of entry k.
void Navigation::rewind_behind(int k) {
  ++statistics_.replays;
  processed_ = k + 1;
  if (k < 0) {
    filter_ = FormationFilter(options_.filter);
    return;
  }
  filter_ = ring_[k].after_own;
  remote_phase(ring_[k]);
}

void Navigation::process_from(int first) {
  const std::int64_t limit_ns = options_.late == LatePolicy::kFusionDelay
                                    ? newest_own_ns() - nanoseconds(options_.fusion_delay_s)
                                    : INT64_MAX;
  for (int k = first; k < ring_.count() && ring_[k].t_ns <= limit_ns; ++k) {
    if (k < ring_.count() - 1) ++statistics_.replayed_epochs;
    own_phase(&ring_[k]);
    remote_phase(ring_[k]);
    processed_ = k + 1;
  }
}

void Navigation::own_phase(EpochEntry* entry) {
  filter_.time_update(entry->t_ns, maneuvers_);
  restart_if_lost(*entry);
  reports_ = UpdateReports();
  reports_.t_ns = entry->t_ns;
  if (entry->has_own && filter_.started()) {
    satellites_.prepare(entry->own, ephemerides_, options_.filter.orbit.earth_time, &earth_);
    reports_.graphic_self =
        filter_.graphic_update(Who::kSelf, entry->own, entry->q_own, satellites_);
    last_own_ns_ = entry->t_ns;
  }
  entry->after_own = filter_;
}

void Navigation::restart_if_lost(const EpochEntry& entry) {
  if (!entry.has_own || !entry.own.has_fix) return;
  if (filter_.started() && !filter_.lost()) return;
  const FixEci fix = fix_of(entry.own, entry.q_own, options_.filter);
  filter_.start(entry.t_ns, fix.r, fix.v, static_cast<double>(entry.own.sigma_r_m),
                static_cast<double>(entry.own.sigma_v_mps));
  ++statistics_.restarts;
}

void Navigation::remote_phase(const EpochEntry& entry) {
  if (!entry.has_remote || !filter_.started()) return;
  if (!filter_.other_started()) {
    if (!entry.remote.has_fix) return;
    const FixEci fix = fix_of(entry.remote, entry.q_remote, options_.filter);
    filter_.start_other(fix.r, fix.v, static_cast<double>(entry.remote.sigma_r_m),
                        static_cast<double>(entry.remote.sigma_v_mps));
  }
  satellites_.prepare(entry.remote, ephemerides_, options_.filter.orbit.earth_time, &earth_);
  reports_.graphic_other =
      filter_.graphic_update(Who::kOther, entry.remote, entry.q_remote, satellites_);
  last_remote_ns_ = entry.t_ns;
  if (!entry.has_own) return;
  satellites_.prepare(entry.own, ephemerides_, options_.filter.orbit.earth_time, &earth_);
  reports_.sdcp =
      filter_.sdcp_update(entry.own, entry.q_own, entry.remote, entry.q_remote, satellites_);
  reports_.integers = filter_.resolve_ambiguities();
}

void Navigation::maneuver(Who who, std::int64_t t_ns, const Vec3& dv_ECI, double sigma_mps) {
  Maneuver m;
  m.who = who;
  m.t_ns = t_ns;
  m.dv_ECI = dv_ECI;
  m.sigma_mps = sigma_mps;
  maneuver(m);
}

void Navigation::maneuver(const Maneuver& m) {
  if (!maneuvers_.add(m)) {
    ++statistics_.dropped;
    return;
  }
  const std::int64_t begin_ns = m.t_ns - nanoseconds(m.duration_s) / 2;
  if (!filter_.started() || begin_ns > filter_.t_ns()) return;
  const int behind = ring_.last_until(begin_ns - 1);
  if (behind < 0) {
    ++statistics_.dropped;  // further back than can be undone: measurements will tell
    return;
  }
  if (behind >= processed_ - 1) return;
  rewind_behind(behind);
  process_from(behind + 1);
}

}  // namespace formation_gnc
