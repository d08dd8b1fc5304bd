#include "formation_gnc/control/impulse.hpp"

#include <cmath>

namespace formation_gnc {

using namespace flight_support;

namespace {

constexpr double kGate_sigma = 5.0;
// A burn of less says nothing.
constexpr double kLeast_quanta = 5.0;

int nozzle_of(int axis, double component) {
  return 2 * axis + (component < 0.0 ? 1 : 0);
}

// What each nozzle is asked for.
Vector<ThrusterScale::kNozzles> loads_of(const Vec3& commanded_B) {
  Vector<ThrusterScale::kNozzles> u;
  for (int axis = 0; axis < 3; ++axis) {
    u[nozzle_of(axis, commanded_B[axis])] = std::fabs(commanded_B[axis]);
  }
  return u;
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

ThrusterScale::ThrusterScale(const ThrusterErrors& errors) : errors_(errors) {
  for (int axis = 0; axis < 3; ++axis) {
    for (int nozzle = 0; nozzle < kNozzles; ++nozzle) {
      const bool along = nozzle / 2 == axis;
      const double sigma = along ? errors.scale : errors.misalignment_rad;
      push_[axis][nozzle] = !along ? 0.0 : nozzle % 2 == 0 ? 1.0 : -1.0;
      P_[axis](nozzle, nozzle) = sigma * sigma;
    }
  }
}

// Of shots, and of rounding: uniform over a quantum. Shots of the other nozzles enter by their
// misalignment, which is of second order.
double ThrusterScale::noise2(const Vec3& commanded_B, int axis) const {
  const double shot_mps = errors_.shot_to_shot * commanded_B[axis];
  return shot_mps * shot_mps + errors_.quantum_mps * errors_.quantum_mps / 12.0;
}

bool ThrusterScale::observe(const Vec3& commanded_B, const Vec3& observed_B,
                            const Vec3& observed_sigma_B) {
  if (!is_finite(commanded_B) || !is_finite(observed_B)) return false;
  if (!(norm(commanded_B) > kLeast_quanta * errors_.quantum_mps)) return false;
  const Vec6 u = loads_of(commanded_B);
  Vec6 gain[3];
  double innovation[3];
  for (int axis = 0; axis < 3; ++axis) {
    const double sigma_mps = observed_sigma_B[axis];
    if (!(sigma_mps > 0.0)) return false;
    const Vec6 Pu = P_[axis] * u;
    const double S = dot(u, Pu) + sigma_mps * sigma_mps + noise2(commanded_B, axis);
    innovation[axis] = observed_B[axis] - dot(u, push_[axis]);
    if (!(innovation[axis] * innovation[axis] <= kGate_sigma * kGate_sigma * S)) return false;
    gain[axis] = (1.0 / S) * Pu;
  }
  for (int axis = 0; axis < 3; ++axis) {
    const Vec6 Pu = P_[axis] * u;
    push_[axis] = push_[axis] + innovation[axis] * gain[axis];
    P_[axis] = symmetric(P_[axis] - gain[axis] * transpose(Pu));
  }
  return true;
}

double ThrusterScale::scale(int nozzle) const {
  return std::fabs(push_[nozzle / 2][nozzle]);
}

double ThrusterScale::sigma(int nozzle) const {
  return std::sqrt(P_[nozzle / 2](nozzle, nozzle));
}

// Which nozzles fire is for the command to say, so it is found by correcting it.
Vec3 ThrusterScale::command_for(const Vec3& wanted_B) const {
  Vec3 command_B;
  for (int axis = 0; axis < 3; ++axis) {
    command_B[axis] = wanted_B[axis] / scale(nozzle_of(axis, wanted_B[axis]));
  }
  for (int pass = 0; pass < 3; ++pass) {
    const Vec3 missing_B = wanted_B - delivered(command_B);
    command_B = command_B + missing_B;
  }
  return command_B;
}

Vec3 ThrusterScale::delivered(const Vec3& commanded_B) const {
  const Vec6 u = loads_of(commanded_B);
  return vec3(dot(u, push_[0]), dot(u, push_[1]), dot(u, push_[2]));
}

Mat3 ThrusterScale::covariance(const Vec3& commanded_B) const {
  const Vec6 u = loads_of(commanded_B);
  Vec3 variance;
  for (int axis = 0; axis < 3; ++axis) {
    variance[axis] = dot(u, P_[axis] * u) + noise2(commanded_B, axis);
  }
  return diagonal(variance);
}

}  // namespace formation_gnc
