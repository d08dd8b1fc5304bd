#include "formation_gnc/control/impulse.hpp"

#include <cmath>

namespace formation_gnc {

using namespace flight_support;

namespace {

constexpr double kGate_sigma = 5.0;
// Misalignment is a constant too, and so does not average out: two axes that each push as much as
// the one in question, with either of two nozzles, leave it, weighted by size 0.8 of it.
constexpr double kLasting = 0.8;
// A component of less says nothing.
constexpr double kLeast_quanta = 5.0;

int nozzle_of(int axis, double component) {
  return 2 * axis + (component < 0.0 ? 1 : 0);
}

}  // namespace

Vec3 dv_eci_from_rtn(const StateEci& burning, const Vec3& dv_RTN) {
  return transpose(eci_to_rtn(burning)) * dv_RTN;
}

Vec3 dv_rtn_from_eci(const StateEci& burning, const Vec3& dv_ECI) {
  return eci_to_rtn(burning) * dv_ECI;
}

Vec3 in_whole_on_times(const Vec3& dv_B, const ImpulseLimits& limits,
                       const ThrusterErrors& errors) {
  const double most_mps = limits.max_mps * (1.0 - 1e-12);  // what the thruster's own sum may reach
  const double size_mps = norm(dv_B);
  double share = size_mps > limits.max_mps ? limits.max_mps / size_mps : 1.0;
  Vec3 rounded;
  do {
    for (int axis = 0; axis < 3; ++axis) {
      const double size = share * std::fabs(dv_B[axis]);
      double on = errors.quantum_mps * std::round(size / errors.quantum_mps);
      if (size < limits.min_mps) on = size < 0.5 * limits.min_mps ? 0.0 : limits.min_mps;
      rounded[axis] = std::copysign(on, dv_B[axis]);
    }
    share *= 1.0 - errors.quantum_mps / limits.max_mps;
  } while (norm(rounded) > most_mps && share > 0.5);
  return rounded;
}

// Along dv the scale and the shot, across it the misalignment, and the rounding of on-times in all
// axes: uniform over a quantum, of three nozzles.
Mat3 maneuver_covariance(const Vec3& dv, const ThrusterErrors& errors) {
  const double along2 = errors.scale * errors.scale + errors.shot_to_shot * errors.shot_to_shot;
  const double across2 = errors.misalignment_rad * errors.misalignment_rad;
  const double rounding2 = errors.quantum_mps * errors.quantum_mps / 12.0;
  const Mat3 along = dv * transpose(dv);
  return (along2 - across2) * along + (across2 * dot(dv, dv) + rounding2) * identity<3>();
}

ThrusterScale::ThrusterScale(const ThrusterErrors& errors) : errors_(errors) {
  for (int nozzle = 0; nozzle < kNozzles; ++nozzle) {
    scale_[nozzle] = 1.0;
    variance_[nozzle] = errors.scale * errors.scale;
  }
}

// A component is scale c (1 + shot), what the others' misalignment adds, and noise. Its own enters
// in second order only.
bool ThrusterScale::observe(const Vec3& commanded_B, const Vec3& observed_B,
                            const Vec3& observed_sigma_B) {
  if (!is_finite(commanded_B) || !is_finite(observed_B)) return false;
  bool learnt = false;
  const double floor = kLasting * errors_.misalignment_rad, floor2 = floor * floor;
  for (int axis = 0; axis < 3; ++axis) {
    const double c = commanded_B[axis];
    const double sigma_mps = observed_sigma_B[axis];
    if (!(std::fabs(c) > kLeast_quanta * errors_.quantum_mps) || !(sigma_mps > 0.0)) continue;
    const int nozzle = nozzle_of(axis, c);
    const double across2 = dot(commanded_B, commanded_B) - c * c;
    const double shot = errors_.shot_to_shot * scale_[nozzle];
    const double noise2 =
        (sigma_mps * sigma_mps + errors_.quantum_mps * errors_.quantum_mps / 12.0 +
         errors_.misalignment_rad * errors_.misalignment_rad * across2) /
            (c * c) +
        shot * shot;
    const double S = variance_[nozzle] + noise2;
    const double innovation = observed_B[axis] / c - scale_[nozzle];
    if (!(innovation * innovation <= kGate_sigma * kGate_sigma * S)) continue;
    scale_[nozzle] += variance_[nozzle] / S * innovation;
    variance_[nozzle] = std::fmax(variance_[nozzle] * noise2 / S, floor2);
    learnt = true;
  }
  return learnt;
}

double ThrusterScale::sigma(int nozzle) const {
  return std::sqrt(variance_[nozzle]);
}

Vec3 ThrusterScale::command_for(const Vec3& wanted_B) const {
  Vec3 command_B;
  for (int axis = 0; axis < 3; ++axis) {
    command_B[axis] = wanted_B[axis] / scale_[nozzle_of(axis, wanted_B[axis])];
  }
  return command_B;
}

Vec3 ThrusterScale::delivered(const Vec3& commanded_B) const {
  Vec3 delivered_B;
  for (int axis = 0; axis < 3; ++axis) {
    delivered_B[axis] = commanded_B[axis] * scale_[nozzle_of(axis, commanded_B[axis])];
  }
  return delivered_B;
}

ThrusterErrors ThrusterScale::errors(const Vec3& dv_B) const {
  double sum = 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    const double c = dv_B[axis];
    sum += c * c * variance_[nozzle_of(axis, c)];
  }
  ThrusterErrors left = errors_;
  const double size2 = dot(dv_B, dv_B);
  if (size2 > 0.0) left.scale = std::sqrt(sum / size2);
  return left;
}

}  // namespace formation_gnc
