#include "formation_gnc/control/fine_alignment.hpp"

#include <cmath>
#include <initializer_list>

#include "support/orbit/constants.hpp"

namespace formation_gnc {

using namespace flight_support;

namespace {

// Responses to an impulse are differences of propagations; what a step of 30 s leaves cancels.
constexpr double kProbe_mps = 1e-3;
constexpr double kProbeStep_s = 30.0;
constexpr double kExposureHalf_s = 5.0;
// Of the cost: an impulse of the largest size weighs as an error of 3 % of a tolerance, which
// decides where nothing else does.
constexpr double kEffort = 0.03;

// Lines of sight: along the Sun and two across it, as rows.
Mat3 sun_axes(const Vec3& sun) {
  const int least = std::fabs(sun[0]) < std::fabs(sun[1])
                        ? (std::fabs(sun[0]) < std::fabs(sun[2]) ? 0 : 2)
                        : (std::fabs(sun[1]) < std::fabs(sun[2]) ? 1 : 2);
  Vec3 helper;
  helper[least] = 1.0;
  const Vec3 across = cross(sun, helper);
  const Vec3 first = (1.0 / norm(across)) * across, second = cross(sun, first);
  Mat3 axes;
  for (int k = 0; k < 3; ++k) {
    axes(0, k) = sun[k];
    axes(1, k) = first[k];
    axes(2, k) = second[k];
  }
  return axes;
}

Vector<6> stacked(const Vec3& r, const Vec3& v) {
  Vector<6> x;
  for (int k = 0; k < 3; ++k) {
    x[k] = r[k];
    x[3 + k] = v[k];
  }
  return x;
}

// Relative state at the observation less the target, in units of tolerances.
class Judge {
 public:
  Judge(const AlignmentOptions& options, const Vec3& sun_ECI)
      : axes_(sun_axes(sun_ECI)), target_ECI_(options.separation_m * sun_ECI) {
    // Along the Sun line a velocity matters by what it does in half an exposure.
    const double tolerance[6] = {options.longitudinal_m, options.lateral_m,
                                 options.lateral_m,      options.longitudinal_m / kExposureHalf_s,
                                 options.lateral_mps,    options.lateral_mps};
    for (int k = 0; k < 6; ++k) weight_[k] = 1.0 / tolerance[k];
  }

  AlignmentError error(const StateEci& detector, const StateEci& optics) const {
    AlignmentError e;
    e.dr_ECI = optics.r_ECI - detector.r_ECI - target_ECI_;
    const Vec3 dr = axes_ * e.dr_ECI, dv = axes_ * (optics.v_ECI - detector.v_ECI);
    e.longitudinal_m = dr[0];
    e.lateral_m = std::hypot(dr[1], dr[2]);
    e.lateral_mps = std::hypot(dv[1], dv[2]);
    return e;
  }
  Vector<6> weighted(const StateEci& detector, const StateEci& optics) const {
    return weighted(optics.r_ECI - detector.r_ECI - target_ECI_, optics.v_ECI - detector.v_ECI);
  }
  Vector<6> weighted(const Vec3& dr_ECI, const Vec3& dv_ECI) const {
    Vector<6> e = stacked(axes_ * dr_ECI, axes_ * dv_ECI);
    for (int k = 0; k < 6; ++k) e[k] *= weight_[k];
    return e;
  }

 private:
  Mat3 axes_;
  Vec3 target_ECI_;
  Vector<6> weight_;
};

// What an impulse at `t_ns` does to the weighted error at the observation, per m/s.
Matrix<6, 3> response(const GravityModel& gravity, const Judge& judge, const StateEci& burning,
                      std::int64_t t_ns, std::int64_t observation_ns, double sign) {
  const StateEci plain = propagate(gravity, burning, t_ns, observation_ns, kProbeStep_s);
  Matrix<6, 3> M;
  for (int axis = 0; axis < 3; ++axis) {
    StateEci pushed = burning;
    pushed.v_ECI[axis] += kProbe_mps;
    const StateEci then = propagate(gravity, pushed, t_ns, observation_ns, kProbeStep_s);
    const Vector<6> change = judge.weighted(then.r_ECI - plain.r_ECI, then.v_ECI - plain.v_ECI);
    for (int row = 0; row < 6; ++row) M(row, axis) = sign / kProbe_mps * change[row];
  }
  return M;
}

// The expected square of a weighted error by the execution of an impulse, per (m/s)^2: errors of
// all three axes taken alike.
double execution_weight(const Matrix<6, 3>& M, const ThrusterErrors& errors) {
  const double along2 = errors.scale * errors.scale + errors.shot_to_shot * errors.shot_to_shot;
  const double across2 = errors.misalignment_rad * errors.misalignment_rad;
  double sum = 0.0;
  for (int r = 0; r < 6; ++r) {
    for (int c = 0; c < 3; ++c) sum += M(r, c) * M(r, c);
  }
  return sum * (along2 + 2.0 * across2) / 3.0;
}

// min |e + sum M_k dv_k|^2 + sum penalty_k |dv_k|^2 over the impulses that are not held.
struct Trims {
  int count = 0;
  Matrix<6, 3> M[2];
  double penalty[2] = {0.0, 0.0};
  Vec3 dv[2];
  bool held[2] = {false, false};

  void solve(const Vector<6>& error) {
    Vector<6> e = error;
    Matrix6 H = identity<6>();
    Vector<6> right, x;
    for (int k = 0; k < count; ++k) {
      if (held[k]) e = e + M[k] * dv[k];
    }
    for (int k = 0; k < count; ++k) {
      if (held[k]) continue;
      const Vec3 pull = transpose(M[k]) * e;
      for (int r = 0; r < 3; ++r) {
        right[3 * k + r] = -pull[r];
        for (int j = 0; j < count; ++j) {
          if (held[j]) continue;
          const Mat3 block = transpose(M[k]) * M[j];
          for (int c = 0; c < 3; ++c) H(3 * k + r, 3 * j + c) = block(r, c);
        }
        H(3 * k + r, 3 * k + r) += penalty[k];
      }
    }
    if (!flight_support::solve(H, right, &x)) return;
    for (int k = 0; k < count; ++k) {
      for (int r = 0; r < 3 && !held[k]; ++r) dv[k][r] = x[3 * k + r];
    }
  }

  // Cuts what is too large and leaves out what is too small, the earlier one first; what is left
  // free makes the best of it.
  bool obey(const ImpulseLimits& limits, const Vector<6>& error) {
    bool within = true;
    solve(error);
    for (int k = 0; k < count; ++k) {
      const double size = norm(dv[k]);
      if (!(size >= limits.min_mps)) {
        dv[k] = Vec3();
      } else if (size > limits.max_mps) {
        dv[k] = (limits.max_mps / size) * dv[k];
        within = false;
      } else {
        continue;
      }
      held[k] = true;
      solve(error);
    }
    return within;
  }
};

}  // namespace

FineAlignment::FineAlignment(const GravityModel& gravity, const AlignmentOptions& options)
    : gravity_(gravity), options_(options) {}

AlignmentError FineAlignment::predict(const AlignmentState& now, std::int64_t observation_ns,
                                      const Vec3& sun_ECI) const {
  return Judge(options_, sun_ECI)
      .error(propagate(gravity_, now.detector, now.t_ns, observation_ns),
             propagate(gravity_, now.optics, now.t_ns, observation_ns));
}

TrimPlan FineAlignment::plan(const AlignmentState& now, std::int64_t earliest_ns,
                             std::int64_t observation_ns, const Vec3& sun_ECI,
                             bool optics_burns) const {
  const Judge judge(options_, sun_ECI);
  const double sign = optics_burns ? 1.0 : -1.0;
  StateEci burning = optics_burns ? now.optics : now.detector;
  const StateEci other = optics_burns ? now.detector : now.optics;
  const StateEci other_then = propagate(gravity_, other, now.t_ns, observation_ns);

  TrimPlan plan;
  Trims trims;
  std::int64_t t_ns = now.t_ns, at_ns[2] = {};
  const std::int64_t earliest = earliest_ns > now.t_ns ? earliest_ns : now.t_ns;
  for (const double before_s :
       {options_.first_trim_before_s, options_.middle_trim_before_s, options_.last_trim_before_s}) {
    const std::int64_t slot_ns = observation_ns - nanoseconds(before_s);
    if (!(before_s > 0.0) || slot_ns < earliest || trims.count == 2) continue;
    burning = propagate(gravity_, burning, t_ns, slot_ns);
    t_ns = at_ns[trims.count] = slot_ns;
    trims.M[trims.count++] = response(gravity_, judge, burning, slot_ns, observation_ns, sign);
  }
  const StateEci burning_then = propagate(gravity_, burning, t_ns, observation_ns);
  const StateEci& detector = optics_burns ? other_then : burning_then;
  const StateEci& optics = optics_burns ? burning_then : other_then;
  plan.before = plan.after = judge.error(detector, optics);
  if (trims.count == 0) return plan;

  const double effort = kEffort / options_.limits.max_mps;
  for (int k = 0; k < trims.count; ++k) {
    trims.penalty[k] = effort * effort;
    if (k == trims.count - 1) trims.penalty[k] += execution_weight(trims.M[k], options_.errors);
  }
  plan.within_limits = trims.obey(options_.limits, judge.weighted(detector, optics));

  // The same trajectory once more, with the trims in it.
  StateEci trimmed = optics_burns ? now.optics : now.detector;
  t_ns = now.t_ns;
  for (int k = 0; k < trims.count; ++k) {
    if (!(norm(trims.dv[k]) > 0.0)) continue;
    trimmed = propagate(gravity_, trimmed, t_ns, at_ns[k]);
    trimmed.v_ECI = trimmed.v_ECI + trims.dv[k];
    t_ns = at_ns[k];
    plan.impulse[plan.count++] = {at_ns[k], trims.dv[k]};
  }
  trimmed = propagate(gravity_, trimmed, t_ns, observation_ns);
  plan.after = optics_burns ? judge.error(other_then, trimmed) : judge.error(trimmed, other_then);
  return plan;
}

}  // namespace formation_gnc
