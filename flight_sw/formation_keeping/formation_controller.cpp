#include "formation_controller.hpp"

#include <cmath>

#include "support/orbit/constants.hpp"

namespace formation_keeping {

using namespace flight_support;

namespace {

constexpr double kMaxGoal_m = 5000.0;
constexpr double kMaxGoalDrift_m = 50.0;  // a*da: 3 pi times that per revolution
constexpr double kTrimming_rev = 2.6;     // the trims are planned in this last part
constexpr double kSettling_s = 900.0;     // after a burn, before the next plan
constexpr double kIdle_s = 600.0;
constexpr double kLastBurnBeforeEnd_s = 60.0;
// A change is planned when the estimate is good to this part of it.
constexpr double kKnownFraction = 0.05;

double revolution_s(const OrbitElements& orbit) {
  return kTwoPi / mean_motion_radps(orbit.a_m);
}

RelativeElements thresholds(double da_m, double dl_m, double de_di_m) {
  RelativeElements t;
  t[kDa] = da_m;
  t[kDl] = dl_m;
  for (int k = kDex; k <= kDiy; ++k) t[k] = de_di_m;
  return t;
}

}  // namespace

FormationController::Acceptance FormationController::accept(const Goal& goal, std::int64_t now_ns) {
  constexpr std::int64_t kLeast_ns = 6000 * kSecond_ns;
  if (!flight_support::is_finite(goal.a_roe)) return Acceptance::kOutOfRange;
  for (int k = 0; k < 6; ++k) {
    if (std::fabs(goal.a_roe[k]) > kMaxGoal_m) return Acceptance::kOutOfRange;
  }
  if (std::fabs(goal.a_roe[kDa]) > kMaxGoalDrift_m) return Acceptance::kOutOfRange;
  if (goal.end_ns < now_ns + kLeast_ns || goal.end_ns > now_ns + 10 * kWeek_ns) {
    return Acceptance::kOutOfRange;
  }
  if (minimum_radial_normal_m(goal.a_roe) < planner_options_.min_radial_normal_m) {
    return Acceptance::kNotSafe;
  }
  resume(goal);
  return Acceptance::kAccepted;
}

void FormationController::resume(const Goal& goal) {
  goal_ = goal;
  has_goal_ = true;
  correction_end_ns_ = 0;
}

void FormationController::halt() {
  has_goal_ = false;
}

bool FormationController::is_converged(const FormationState& now, double change_m) const {
  const Matrix6& P = now.relative.covariance;
  const double allowed_m = kKnownFraction * change_m;
  if (!(std::sqrt(P(kDa, kDa)) < std::fmax(control_.converged_da_m, allowed_m))) return false;
  for (int k = kDex; k <= kDiy; ++k) {
    if (!(std::sqrt(P(k, k)) < std::fmax(control_.converged_de_m, allowed_m))) return false;
  }
  return true;
}

void FormationController::choose_mode(const FormationState& now) {
  // Once acquired, the mode stays: after a burn the covariance is wide, and that is no loss of
  // navigation.
  if (mode_ == Mode::kAcquiring && !is_converged(now, 0.0)) return;
  if (!has_goal_) {
    mode_ = Mode::kStandby;
  } else {
    mode_ = now.t_ns < goal_.end_ns ? Mode::kReconfiguring : Mode::kKeeping;
  }
}

FormationController::Decision FormationController::decide(const FormationState& now) {
  choose_mode(now);
  Decision wait;
  wait.next_ns = now.t_ns + nanoseconds(kIdle_s);
  if (mode_ == Mode::kAcquiring || mode_ == Mode::kStandby) return wait;
  if (now.t_ns < settled_ns_) {
    wait.next_ns = settled_ns_;
    return wait;
  }
  if (mode_ == Mode::kReconfiguring) return plan(now, goal_);

  const std::int64_t horizon_ns =
      nanoseconds(control_.keeping_horizon_rev * revolution_s(now.chief));
  Goal ahead = goal_;
  ahead.end_ns = now.t_ns + horizon_ns;
  if (now.t_ns < correction_end_ns_) ahead.end_ns = correction_end_ns_;
  Decision decision = plan(now, ahead);
  if (decision.burn) correction_end_ns_ = ahead.end_ns;
  return decision;
}

RelativeElements FormationController::thresholds_m(const FormationState& now) const {
  if (mode_ == Mode::kKeeping && now.t_ns >= correction_end_ns_) {
    const double band = control_.keeping_deadband_m;
    return thresholds(0.25 * band, 5.0 * band, band);
  }
  const double left_rev = seconds(goal_.end_ns - now.t_ns) / revolution_s(now.chief);
  return left_rev < kTrimming_rev ? thresholds(0.3, 4.0, 1.0) : thresholds(5.0, 80.0, 8.0);
}

bool FormationController::is_worth_it(const FormationState& now, const Goal& goal,
                                      RelativeElements* miss) const {
  const RelativeElements threshold = thresholds_m(now);
  const Matrix6 Phi = state_transition(now.chief, seconds(goal.end_ns - now.t_ns));
  const Matrix6 P = Phi * now.relative.covariance * transpose(Phi);
  *miss = predicted_miss(now, goal);
  bool any = false;
  for (int k = 0; k < 6; ++k) {
    const double least = std::fmax(threshold[k], 2.0 * std::sqrt(P(k, k)));
    if (std::fabs((*miss)[k]) > least) any = true;
  }
  // A change of a*de or a*di below its threshold has a phase that is mostly noise: leave it.
  const int vectors[2][2] = {{kDex, kDey}, {kDix, kDiy}};
  for (const auto& v : vectors) {
    if (std::hypot((*miss)[v[0]], (*miss)[v[1]]) < threshold[v[0]]) {
      (*miss)[v[0]] = 0.0;
      (*miss)[v[1]] = 0.0;
    }
  }
  return any;
}

FormationController::Decision FormationController::plan(const FormationState& now,
                                                        const Goal& goal) {
  Decision decision;
  decision.next_ns = now.t_ns + nanoseconds(kIdle_s);
  RelativeElements miss;
  if (!is_worth_it(now, goal, &miss) || !is_converged(now, norm(miss))) return decision;

  const BurnWindow window{now.t_ns + nanoseconds(0.5 * control_.burn_lead_s),
                          goal.end_ns - nanoseconds(kLastBurnBeforeEnd_s)};
  Plan plan;
  if (!planner_.plan(now, goal, miss, window, &plan)) {
    // In the last half revolution there may simply be no opportunity left.
    const double left_s = seconds(window.last_ns - window.first_ns);
    if (left_s > 0.5 * revolution_s(now.chief)) {
      decision.trouble = "no safe plan within the impulse limit from here to the goal";
    }
    return decision;
  }
  if (plan.count == 0) return decision;
  const std::int64_t command_ns = plan.burns[0].t_ns - nanoseconds(control_.burn_lead_s);
  if (now.t_ns < command_ns) {
    if (command_ns < decision.next_ns) decision.next_ns = command_ns;  // and plan again then
    return decision;
  }
  decision.burn = true;
  decision.what = plan.burns[0];
  decision.next_ns = plan.burns[0].t_ns + nanoseconds(kSettling_s);
  return decision;
}

void FormationController::commanded(const Burn& burn) {
  settled_ns_ = burn.t_ns + nanoseconds(kSettling_s);
}

}  // namespace formation_keeping
