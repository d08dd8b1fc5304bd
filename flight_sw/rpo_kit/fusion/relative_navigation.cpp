#include "rpo_kit/fusion/relative_navigation.hpp"

#include <algorithm>
#include <cmath>

#include "support/orbit/constants.hpp"

namespace rpo_kit {

using namespace flight_support;

namespace {

constexpr std::size_t kMostWaiting = 256, kMostSecond = 32, kMostBatch = 60;
constexpr int kOutliersToRestart = 30;
// Chi-square with one degree of freedom at 1 - 3e-4, as the filter's gates.
constexpr double kGate1 = 13.1;
// In sigma: lines of sight that are nearer to parallel tell too little of the range to start from.
constexpr double kLeastAngle = 10.0;
constexpr int kLeastSecond = 6;
// Of the batch, over 1-sigma: more, and the second observer sees something else.
constexpr double kMostResidual = 3.0;

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

void RelativeNavigation::second_bearing(const SecondBearing& bearing) {
  std::size_t waiting = 0;
  for (const Event& event : waiting_) {
    if (event.kind != Kind::kSecond) continue;
    ++waiting;
    if (event.t_ns == bearing.t_ns || waiting == kMostSecond) {
      ++dropped_;
      return;
    }
  }
  Event event;
  event.t_ns = bearing.t_ns;
  event.kind = Kind::kSecond;
  event.second = bearing;
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
    case Kind::kSecond:
      return use_second(event.second);
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

// The last own fix, moved to that instant. Its velocity's noise moves it, too.
bool RelativeNavigation::own_raw(std::int64_t t_ns, StateEci* own, double* sigma_r_m) const {
  const double apart_s = seconds(t_ns - raw_.t_ns);
  if (std::fabs(apart_s) > options_.pairing_s) return false;
  *own = raw_.state;
  if (apart_s != 0.0) {
    const Observer then = propagate(observer_from_state(raw_.t_ns, raw_.state), t_ns);
    *own = state_from_osculating(osculating_from_mean(then.mean));
  }
  *sigma_r_m = std::hypot(raw_.sigma_r_m, raw_.sigma_v_mps * apart_s);
  return true;
}

// Both fixes at the target's instant.
bool RelativeNavigation::difference(const EciFix& target, StateMeasurement* state) const {
  StateEci own;
  double sigma_r_m = 0.0;
  if (!own_raw(target.t_ns, &own, &sigma_r_m)) return false;
  state->t_ns = target.t_ns;
  state->r_TO_ECI = target.state.r_ECI - own.r_ECI;
  state->v_TO_ECI = target.state.v_ECI - own.v_ECI;
  state->sigma_r_m = std::hypot(sigma_r_m, target.sigma_r_m);
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
  collect(bearing);
}

void RelativeNavigation::use_second(const SecondBearing& second) {
  StateEci raw;
  double sigma_r_m = 0.0;
  if (!own_raw(second.t_ns, &raw, &sigma_r_m)) {
    ++dropped_;
    return;
  }
  own_ = propagate(own_, second.t_ns);
  Bearing bearing{second.t_ns, second.direction_ECI, second.sigma_rad, second.r_ECI - raw.r_ECI,
                  second.covariance_ECI + sigma_r_m * sigma_r_m * identity<3>()};
  if (!filter_.started() || !filter_.healthy()) {
    if (may_start_with(&bearing)) return collect(bearing);
    ++outliers_;
    return;
  }
  const bool accepted = filter_.update(bearing, own_);
  if (accepted || !filter_.healthy()) return count(accepted, Source::kSecond, second.t_ns);
  ++outliers_;
}

// The batch has no gate: there the own line of sight, turned with the orbit to the same instant,
// and the other one have to meet. Their place's noise becomes one of the direction.
bool RelativeNavigation::may_start_with(Bearing* bearing) const {
  const BatchMeasurement* own = nullptr;
  for (const BatchMeasurement& m : batch_) {
    const double apart_s = std::fabs(seconds(m.bearing.t_ns - bearing->t_ns));
    if (m.bearing.is_own() && apart_s <= options_.pairing_s) own = &m;
  }
  if (own == nullptr) return false;
  const auto axes = [](const Observer& at) {
    return eci_to_rtn(state_from_osculating(osculating_from_mean(at.mean)));
  };
  const Vec3 direction = transpose(axes(own_)) * (axes(own->observer) * own->bearing.direction_ECI);
  Intersection at;
  if (!intersect(direction, bearing->direction_ECI, bearing->r_SO_ECI, &at)) return false;
  if (at.sine < kLeastAngle * std::hypot(own->bearing.sigma_rad, bearing->sigma_rad)) return false;
  const double first = own->bearing.sigma_rad * at.first_m;
  const double second = bearing->sigma_rad * at.second_m;
  const double variance =
      first * first + second * second + dot(at.across, bearing->covariance_SO_ECI * at.across);
  if (!(at.first_m > 0.0 && at.second_m > 0.0) || !(at.miss_m * at.miss_m < kGate1 * variance)) {
    return false;
  }
  const Mat3& P = bearing->covariance_SO_ECI;
  const double place_m = std::sqrt((P(0, 0) + P(1, 1) + P(2, 2)) / 3.0);
  bearing->sigma_rad = std::hypot(bearing->sigma_rad, place_m / at.second_m);
  return true;
}

int RelativeNavigation::others_in_batch() const {
  return static_cast<int>(std::count_if(
      batch_.begin(), batch_.end(), [](const BatchMeasurement& m) { return !m.bearing.is_own(); }));
}

void RelativeNavigation::collect(const Bearing& bearing) {
  // When there is no more room every other one of each observer goes: the arc is what counts.
  if (batch_.size() == kMostBatch) {
    bool keep[2] = {false, false};
    std::size_t kept = 0;
    for (const BatchMeasurement& m : batch_) {
      bool& this_one = keep[m.bearing.is_own() ? 0 : 1];
      this_one = !this_one;
      if (this_one) batch_[kept++] = m;
    }
    batch_.resize(kept);
  }
  batch_.push_back({bearing, own_});
  const double arc_s = seconds(bearing.t_ns - batch_.front().bearing.t_ns);
  const double enough_s =
      others_in_batch() >= kLeastSecond ? options_.second_arc_s : options_.batch_arc_s;
  // Each time the arc has grown by an eighth, so that a hopeless one costs little.
  if (arc_s > enough_s && batch_.size() >= 12 && batch_.size() % 8 == 0) try_batch();
}

void RelativeNavigation::try_batch() {
  InitialOrbit initial;
  if (!solve_initial_orbit(batch_.data(), static_cast<int>(batch_.size()), batch_burns_.data(),
                           static_cast<int>(batch_burns_.size()), options_.batch, &initial)) {
    return;
  }
  if (initial.residual > kMostResidual && others_in_batch() > 0) {
    batch_.erase(std::remove_if(batch_.begin(), batch_.end(),
                                [](const BatchMeasurement& m) { return !m.bearing.is_own(); }),
                 batch_.end());
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
  const std::int64_t last_ns = *std::max_element(last_ns_, last_ns_ + kSources);
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
