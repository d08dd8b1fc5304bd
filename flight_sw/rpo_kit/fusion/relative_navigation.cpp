#include "rpo_kit/fusion/relative_navigation.hpp"

#include <algorithm>
#include <cmath>

#include "support/orbit/constants.hpp"

namespace rpo_kit {

using namespace flight_support;

namespace {

constexpr std::size_t kMostWaiting = 256, kMostBatch = 60;
constexpr int kOutliersToRestart = 30;

Vec3 dv_in_RTN(const OrbitElements& mean, const Vec3& dv_ECI) {
  return eci_to_rtn(state_from_osculating(osculating_from_mean(mean))) * dv_ECI;
}

}  // namespace

RelativeNavigation::RelativeNavigation(const NavigationOptions& options)
    : options_(options), filter_(options.filter) {
  waiting_.reserve(kMostWaiting);
  batch_.reserve(kMostBatch);
}

// By time; at one instant burns come first, then own fixes, then what is compared with them.
void RelativeNavigation::insert(const Event& event) {
  if (event.t_ns <= used_until_ns_) {
    ++dropped_;
    return;
  }
  if (waiting_.size() == kMostWaiting) {
    ++dropped_;
    return;
  }
  const auto before = [](const Event& a, const Event& b) {
    return a.t_ns != b.t_ns ? a.t_ns < b.t_ns : a.kind < b.kind;
  };
  waiting_.insert(std::upper_bound(waiting_.begin(), waiting_.end(), event, before), event);
}

void RelativeNavigation::own_fix(const EciFix& fix) {
  Event event;
  event.t_ns = fix.t_ns;
  event.kind = Kind::kOwnFix;
  event.fix = fix;
  insert(event);
}

void RelativeNavigation::target_fix(const EciFix& fix) {
  Event event;
  event.t_ns = fix.t_ns;
  event.kind = Kind::kTargetFix;
  event.fix = fix;
  insert(event);
}

void RelativeNavigation::bearing(const Bearing& bearing) {
  Event event;
  event.t_ns = bearing.t_ns;
  event.kind = Kind::kBearing;
  event.bearing = bearing;
  insert(event);
}

void RelativeNavigation::pose(const PlaceMeasurement& place) {
  Event event;
  event.t_ns = place.t_ns;
  event.kind = Kind::kPose;
  event.place = place;
  insert(event);
}

void RelativeNavigation::burn(std::int64_t t_ns, const Vec3& dv_ECI) {
  Event event;
  event.t_ns = t_ns;
  event.kind = Kind::kBurn;
  event.dv_ECI = dv_ECI;
  insert(event);
}

void RelativeNavigation::process(std::int64_t now_ns) {
  const std::int64_t until_ns = now_ns - nanoseconds(options_.lag_s);
  std::size_t done = 0;
  for (; done < waiting_.size() && waiting_[done].t_ns <= until_ns; ++done) use(waiting_[done]);
  waiting_.erase(waiting_.begin(), waiting_.begin() + static_cast<std::ptrdiff_t>(done));
  used_until_ns_ = std::max(used_until_ns_, until_ns);
}

void RelativeNavigation::use(const Event& event) {
  if (event.kind == Kind::kOwnFix) return use_own_fix(event.fix);
  if (own_fixes_ == 0) {
    ++dropped_;
    return;
  }
  switch (event.kind) {
    case Kind::kBurn:
      return use_burn(event);
    case Kind::kTargetFix:
      return use_target_fix(event.fix);
    case Kind::kBearing:
      return use_bearing(event.bearing);
    default:
      if (!filter_.started()) return;
      own_ = propagate(own_, event.t_ns);
      count(filter_.update(event.place, own_), Source::kPose, event.t_ns);
  }
}

void RelativeNavigation::use_own_fix(const EciFix& fix) {
  const Observer measured = observer_from_state(fix.t_ns, fix.state);
  raw_ = fix;
  ++own_fixes_;
  if (own_fixes_ == 1) {
    own_ = measured;
    return;
  }
  const double gain = std::max(1.0 / own_fixes_, 1.0 / options_.own_memory);
  const Observer predicted = propagate(own_, fix.t_ns);
  own_ = {fix.t_ns, apply_relative_elements(
                        predicted.mean, gain * relative_elements(predicted.mean, measured.mean))};
}

void RelativeNavigation::use_burn(const Event& event) {
  own_ = propagate(own_, event.t_ns);
  const Vec3 dv_RTN = dv_in_RTN(own_.mean, event.dv_ECI);
  const ObserverBurn burn{
      event.t_ns, dv_RTN,
      burn_covariance(dv_RTN, options_.burn_fraction, options_.burn_direction_rad)};
  if (filter_.started()) {
    filter_.burn(own_, burn);
  } else if (batch_burns_.size() < kMostBatchBurns) {
    batch_burns_.push_back(burn);
  } else {
    // More than the batch can solve for: it begins anew.
    batch_.clear();
    batch_burns_.clear();
  }
  own_.mean = after_burn(own_.mean, dv_RTN);
}

// Both fixes at the target's instant.
bool RelativeNavigation::difference(const EciFix& target, StateMeasurement* state) const {
  const double apart_s = seconds(target.t_ns - raw_.t_ns);
  if (std::fabs(apart_s) > options_.pairing_s) return false;
  StateEci own = raw_.state;
  if (apart_s != 0.0) {
    const Observer then = propagate(observer_from_state(raw_.t_ns, raw_.state), target.t_ns);
    own = state_from_osculating(osculating_from_mean(then.mean));
  }
  state->t_ns = target.t_ns;
  state->r_TO_ECI = target.state.r_ECI - own.r_ECI;
  state->v_TO_ECI = target.state.v_ECI - own.v_ECI;
  // The own velocity's noise moves the own position meanwhile.
  state->sigma_r_m =
      std::hypot(std::hypot(raw_.sigma_r_m, raw_.sigma_v_mps * apart_s), target.sigma_r_m);
  state->sigma_v_mps = std::hypot(raw_.sigma_v_mps, target.sigma_v_mps);
  return true;
}

void RelativeNavigation::use_target_fix(const EciFix& fix) {
  StateMeasurement state;
  if (!difference(fix, &state)) {
    ++dropped_;
    return;
  }
  own_ = propagate(own_, fix.t_ns);
  if (!filter_.started() || !filter_.healthy()) return start_from(state, fix, own_);
  count(filter_.update(state, own_), Source::kGnss, fix.t_ns);
}

void RelativeNavigation::start_from(const StateMeasurement& state, const EciFix& target,
                                    const Observer& own) {
  Matrix6 noise;
  for (int k = 0; k < 3; ++k) {
    noise(k, k) = state.sigma_r_m * state.sigma_r_m;
    noise(3 + k, 3 + k) = state.sigma_v_mps * state.sigma_v_mps;
  }
  start_at(own, target.state, state, noise);
  count(true, Source::kGnss, target.t_ns);
}

void RelativeNavigation::start_at(const Observer& own, const StateEci& target,
                                  const StateMeasurement& state, const Matrix6& covariance_RTN) {
  const StateEci other{target.r_ECI - state.r_TO_ECI, target.v_ECI - state.v_TO_ECI};
  const RelativeElements a_roe = relative_elements(observer_from_state(state.t_ns, other).mean,
                                                   observer_from_state(state.t_ns, target).mean);
  const Matrix6 T =
      relative_elements_from_inertial_rtn(own.mean.u_rad, mean_motion_radps(own.mean.a_m));
  filter_.start(own, a_roe, T * covariance_RTN * transpose(T));
}

void RelativeNavigation::start_from_track(const StateMeasurement& state,
                                          const Matrix6& covariance_RTN) {
  Observer own;
  if (started() || !own_at(state.t_ns, &own)) return;
  // A burn that waits would count twice: the track knows of it.
  for (const Event& event : waiting_) {
    if (event.kind == Kind::kBurn && event.t_ns <= state.t_ns) return;
  }
  const StateEci at = state_from_osculating(osculating_from_mean(own.mean));
  start_at(own, {at.r_ECI + state.r_TO_ECI, at.v_ECI + state.v_TO_ECI}, state, covariance_RTN);
  used_until_ns_ = std::max(used_until_ns_, state.t_ns);
  count(true, Source::kPose, state.t_ns);
}

void RelativeNavigation::use_bearing(const Bearing& bearing) {
  own_ = propagate(own_, bearing.t_ns);
  if (filter_.started() && filter_.healthy()) {
    return count(filter_.update(bearing, own_), Source::kBearing, bearing.t_ns);
  }
  // When there is no more room every other one goes: the arc is what counts.
  if (batch_.size() == kMostBatch) {
    for (std::size_t k = 1; 2 * k < kMostBatch; ++k) batch_[k] = batch_[2 * k];
    batch_.resize(kMostBatch / 2);
  }
  batch_.push_back({bearing, own_});
  const double arc_s = seconds(bearing.t_ns - batch_.front().bearing.t_ns);
  // Each time the arc has grown by an eighth, so that a hopeless one costs little.
  if (arc_s > options_.batch_arc_s && batch_.size() >= 12 && batch_.size() % 8 == 0) try_batch();
}

void RelativeNavigation::try_batch() {
  InitialOrbit initial;
  if (!solve_initial_orbit(batch_.data(), static_cast<int>(batch_.size()), batch_burns_.data(),
                           static_cast<int>(batch_burns_.size()), options_.batch, &initial)) {
    return;
  }
  const double sigma = std::sqrt(initial.covariance(kDl, kDl));
  if (!(sigma < options_.batch_accuracy * std::fabs(initial.a_roe[kDl]))) return;
  filter_.start(batch_.back().observer, initial.a_roe, initial.covariance);
  count(true, Source::kBearing, initial.t_ns);
  batch_.clear();
  batch_burns_.clear();
}

void RelativeNavigation::count(bool accepted, Source source, std::int64_t t_ns) {
  if (accepted) {
    last_ns_[static_cast<int>(source)] = t_ns;
    ++used_[static_cast<int>(source)];
    outliers_in_a_row_ = 0;
    return;
  }
  ++outliers_;
  if (++outliers_in_a_row_ < kOutliersToRestart && filter_.healthy()) return;
  // Nothing fits any more: what the filter believes is wrong, not all sensors at once.
  filter_ = RelativeOrbitFilter(options_.filter);
  outliers_in_a_row_ = 0;
  ++restarts_;
}

bool RelativeNavigation::own_at(std::int64_t t_ns, Observer* own) const {
  if (own_fixes_ == 0) return false;
  *own = own_;
  for (const Event& event : waiting_) {
    if (event.kind != Kind::kBurn || event.t_ns > t_ns) continue;
    *own = propagate(*own, event.t_ns);
    own->mean = after_burn(own->mean, dv_in_RTN(own->mean, event.dv_ECI));
  }
  *own = propagate(*own, t_ns);
  return true;
}

bool RelativeNavigation::at(std::int64_t t_ns, RelativeOrbit* chaser, Matrix6* covariance) const {
  if (!started()) return false;
  const std::int64_t last_ns = std::max({last_ns_[0], last_ns_[1], last_ns_[2]});
  if (seconds(t_ns - last_ns) > options_.lost_s) return false;
  RelativeOrbitFilter ahead = filter_;
  Observer own = own_.t_ns >= ahead.observer().t_ns ? own_ : ahead.observer();
  for (const Event& event : waiting_) {
    if (event.kind != Kind::kBurn || event.t_ns > t_ns) continue;
    own = propagate(own, event.t_ns);
    const Vec3 dv_RTN = dv_in_RTN(own.mean, event.dv_ECI);
    ahead.burn(own, {event.t_ns, dv_RTN,
                     burn_covariance(dv_RTN, options_.burn_fraction, options_.burn_direction_rad)});
    own.mean = after_burn(own.mean, dv_RTN);
  }
  own = propagate(own, t_ns);
  ahead.predict(own);
  if (!ahead.healthy()) return false;
  const OrbitElements target = apply_relative_elements(own.mean, ahead.a_roe());
  *chaser = {t_ns, target, relative_elements(target, own.mean)};
  *covariance = ahead.covariance();
  return true;
}

}  // namespace rpo_kit
