#include "relative_navigation.hpp"

#include <cassert>
#include <cmath>
#include <cstdlib>

#include "support/orbit/constants.hpp"

namespace formation_keeping {

using namespace flight_support;

namespace {

using flight_support::Matrix;
using flight_support::Vec3;

// Between two updates the noise is added in steps short against the orbit.
constexpr double kMaxStep_s = 300.0;
// 1-sigma of a_roe's start in every axis when the state proves wrong for no known reason.
constexpr double kReopened_r_m = 50.0;
constexpr double kReopened_v_mps = 0.1;
constexpr int kOutliersToDistrust = 3;
// Opened so often in a row without a measurement that fits, it is beyond repair: a start on a fix
// that was wrong by kilometres, say. Then the filter starts anew.
constexpr int kReopeningsToRestart = 3;
// Own fixes that step back this far come from a receiver that found another time, and replace the
// old.
constexpr double kReceiverRestart_s = 60.0;
constexpr double kLongestPrediction_s = 86400.0;

// Noise of one state, position and velocity per axis, as noise of the elements [m^2].
Matrix6 element_covariance(double u_rad, double n_radps, double variance_r, double variance_v) {
  const Matrix6 M = relative_elements_from_inertial_rtn(u_rad, n_radps);
  flight_support::Vector<6> variance;
  for (int k = 0; k < 3; ++k) {
    variance[k] = variance_r;
    variance[k + 3] = variance_v;
  }
  return M * diagonal(variance) * transpose(M);
}

double square(double x) {
  return x * x;
}

Matrix6 acceleration_noise(const Matrix<6, 3>& B, double root_psd_mps15, double dt_s) {
  return (square(root_psd_mps15) * dt_s) * (B * transpose(B));
}

Matrix6 moved(const Matrix6& Phi, const Matrix6& P, const Matrix6& Q) {
  // Half of the noise before the move, half after: second order in the step.
  const Matrix6 half = 0.5 * Q;
  return symmetric(Phi * (P + half) * transpose(Phi) + half);
}

}  // namespace

RelativeNavigation::TimedElements RelativeNavigation::mean_of(const GnssFix& fix) const {
  const StateEci state = eci_from_ecef(fix.epoch_ns, fix.r_ECEF, fix.v_ECEF, options_.earth_time);
  return {fix.epoch_ns, mean_from_osculating(osculating_from_state(state)), fix.sigma_r_m,
          fix.sigma_v_mps};
}

bool RelativeNavigation::add_own_fix(const GnssFix& fix) {
  if (own_count_ > 0 && fix.epoch_ns <= own_[own_newest_].t_ns) {
    if (own_[own_newest_].t_ns - fix.epoch_ns < nanoseconds(kReceiverRestart_s)) return false;
    own_count_ = 0;
    own_newest_ = -1;
  }
  own_newest_ = (own_newest_ + 1) % kOwnFixes;
  own_[own_newest_] = mean_of(fix);
  if (own_count_ < kOwnFixes) ++own_count_;
  return true;
}

bool RelativeNavigation::add_chief_fix(const GnssFix& fix) {
  if (started_ && fix.epoch_ns <= state_.t_ns) return false;
  int at = chief_count_;
  while (at > 0 && chief_[at - 1].t_ns > fix.epoch_ns) --at;
  if (at > 0 && chief_[at - 1].t_ns == fix.epoch_ns) return false;
  if (chief_count_ == kChiefFixes) {
    if (at == 0) return false;
    take_oldest_chief_fix();
    --at;
  }
  for (int k = chief_count_; k > at; --k) chief_[k] = chief_[k - 1];
  chief_[at] = mean_of(fix);
  ++chief_count_;
  return true;
}

void RelativeNavigation::add_burn(const Burn& burn) {
  if (burn_count_ == kBurns) {
    advance(&state_, burns_[0].t_ns);
    forget_burns_before(state_.t_ns);
  }
  int at = burn_count_;
  while (at > 0 && burns_[at - 1].t_ns > burn.t_ns) --at;
  for (int k = burn_count_; k > at; --k) burns_[k] = burns_[k - 1];
  burns_[at] = burn;
  ++burn_count_;
}

void RelativeNavigation::process(std::int64_t now_ns) {
  const std::int64_t until_ns = now_ns - nanoseconds(options_.lag_s);
  while (chief_count_ > 0 && chief_[0].t_ns <= until_ns) take_oldest_chief_fix();
}

void RelativeNavigation::take_oldest_chief_fix() {
  const TimedElements chief = chief_[0];
  --chief_count_;
  for (int k = 0; k < chief_count_; ++k) chief_[k] = chief_[k + 1];
  const TimedElements* own = nearest_own(chief.t_ns);
  if (own != nullptr) update(chief, *own);
}

const RelativeNavigation::TimedElements* RelativeNavigation::nearest_own(std::int64_t t_ns) const {
  const TimedElements* nearest = nullptr;
  std::int64_t best_ns = nanoseconds(options_.pairing_tolerance_s);
  for (int k = 0; k < own_count_; ++k) {
    const std::int64_t apart_ns = std::llabs(own_[k].t_ns - t_ns);
    if (apart_ns <= best_ns) {
      best_ns = apart_ns;
      nearest = &own_[k];
    }
  }
  return nearest;
}

void RelativeNavigation::update(const TimedElements& chief, const TimedElements& own) {
  const OrbitElements own_then = propagate_mean(own.mean, seconds(chief.t_ns - own.t_ns));
  const RelativeElements z = relative_elements(chief.mean, own_then);
  const double u = chief.mean.u_rad, n = mean_motion_radps(chief.mean.a_m);
  const Matrix6 R = element_covariance(u, n, square(chief.sigma_r_m) + square(own.sigma_r_m),
                                       square(chief.sigma_v_mps) + square(own.sigma_v_mps));
  if (!started_) {
    start(chief, z, R);
    return;
  }
  advance(&state_, chief.t_ns);
  forget_burns_before(chief.t_ns);

  Gaussian offset{relative_elements(state_.chief, state_.chief), state_.chief_covariance};
  const Matrix6 R_chief =
      element_covariance(u, n, square(chief.sigma_r_m), square(chief.sigma_v_mps));
  // No gate: the chief's own orbit is only geometry here, and must follow whatever the chief does.
  if (measure(&offset, relative_elements(state_.chief, chief.mean), R_chief, INFINITY)) {
    state_.chief = apply_relative_elements(state_.chief, offset.mean);
    state_.chief_covariance = offset.covariance;
  }
  measure_relative(z, R, u, n);
  if (reopenings_in_a_row_ >= kReopeningsToRestart) start(chief, z, R);
}

void RelativeNavigation::start(const TimedElements& chief, const RelativeElements& z,
                               const Matrix6& R) {
  state_.t_ns = chief.t_ns;
  state_.chief = chief.mean;
  state_.chief_covariance = element_covariance(chief.mean.u_rad, mean_motion_radps(chief.mean.a_m),
                                               square(chief.sigma_r_m), square(chief.sigma_v_mps));
  state_.relative = {z, R};
  forget_burns_before(chief.t_ns);
  reopenings_in_a_row_ = 0;
  outliers_in_a_row_ = 0;
  started_ = true;
  ++updates_;
}

void RelativeNavigation::measure_relative(const RelativeElements& z, const Matrix6& R, double u_rad,
                                          double n_radps) {
  if (measure(&state_.relative, z, R, options_.gate)) {
    outliers_in_a_row_ = 0;
    reopenings_in_a_row_ = 0;
    ++updates_;
    return;
  }
  ++outliers_;
  ++outliers_in_a_row_;
  if (outliers_in_a_row_ < kOutliersToDistrust) return;
  const RelativeElements& g = state_.last_burn_effect;
  if (!burn_suspected_ && dot(g, g) > 0.0) {
    state_.relative.covariance = state_.relative.covariance + g * transpose(g);
    burn_suspected_ = true;
  } else {
    state_.relative.covariance =
        state_.relative.covariance +
        element_covariance(u_rad, n_radps, square(kReopened_r_m), square(kReopened_v_mps));
  }
  outliers_in_a_row_ = 0;
  ++reopenings_in_a_row_;
  if (!measure(&state_.relative, z, R, options_.gate)) return;
  ++updates_;
  reopenings_in_a_row_ = 0;
}

bool RelativeNavigation::can_predict(std::int64_t t_ns) const {
  return started_ && t_ns >= state_.t_ns && t_ns - state_.t_ns <= nanoseconds(kLongestPrediction_s);
}

FormationState RelativeNavigation::at(std::int64_t t_ns) const {
  assert(can_predict(t_ns));
  FormationState state = state_;
  advance(&state, t_ns);
  return state;
}

void RelativeNavigation::advance(FormationState* state, std::int64_t t_ns) const {
  for (int k = 0; k < burn_count_; ++k) {
    if (burns_[k].t_ns <= state->t_ns || burns_[k].t_ns > t_ns) continue;
    coast(state, burns_[k].t_ns);
    apply(state, burns_[k]);
  }
  coast(state, t_ns);
}

void RelativeNavigation::coast(FormationState* state, std::int64_t t_ns) const {
  while (state->t_ns < t_ns) {
    const double dt_s = std::fmin(seconds(t_ns - state->t_ns), kMaxStep_s);
    const Matrix6 Phi = state_transition(state->chief, dt_s);
    const Matrix<6, 3> B = control_input(state->chief);
    state->relative.mean = Phi * state->relative.mean;
    state->relative.covariance = moved(Phi, state->relative.covariance,
                                       acceleration_noise(B, options_.relative_noise_mps15, dt_s));
    state->chief_covariance = moved(Phi, state->chief_covariance,
                                    acceleration_noise(B, options_.absolute_noise_mps15, dt_s));
    state->last_burn_effect = Phi * state->last_burn_effect;
    state->chief = propagate_mean(state->chief, dt_s);
    state->t_ns = dt_s < kMaxStep_s ? t_ns : state->t_ns + nanoseconds(dt_s);
  }
}

void RelativeNavigation::apply(FormationState* state, const Burn& burn) const {
  const OrbitElements deputy = apply_relative_elements(state->chief, state->relative.mean);
  const Matrix<6, 3> B = control_input(deputy);
  const double sigma = options_.burn_error_fraction * norm(burn.dv_RTN);
  state->last_burn_effect = B * burn.dv_RTN;
  state->relative.mean = state->relative.mean + state->last_burn_effect;
  state->relative.covariance = state->relative.covariance + square(sigma) * (B * transpose(B));
}

// Burns that the filter's own state has passed are in it for good.
void RelativeNavigation::forget_burns_before(std::int64_t t_ns) {
  int kept = 0;
  for (int k = 0; k < burn_count_; ++k) {
    if (burns_[k].t_ns > t_ns) burns_[kept++] = burns_[k];
  }
  if (kept < burn_count_) burn_suspected_ = false;
  burn_count_ = kept;
}

}  // namespace formation_keeping
