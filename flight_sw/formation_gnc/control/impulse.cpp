#include "formation_gnc/control/impulse.hpp"

#include <cmath>

namespace formation_gnc {

using namespace flight_support;

namespace {

constexpr double kGate_sigma = 5.0;

}  // namespace

Vec3 dv_eci_from_rtn(const StateEci& burning, const Vec3& dv_RTN) {
  return transpose(eci_to_rtn(burning)) * dv_RTN;
}

Vec3 dv_rtn_from_eci(const StateEci& burning, const Vec3& dv_ECI) {
  return eci_to_rtn(burning) * dv_ECI;
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

ThrusterScale::ThrusterScale(const ThrusterErrors& errors)
    : errors_(errors), variance_(errors.scale * errors.scale) {}

// The component along the command is scale |dv| (1 + shot) + noise; misalignment enters in second
// order only.
bool ThrusterScale::observe(const Vec3& commanded, const Vec3& observed,
                            double observed_sigma_mps) {
  const double size2 = dot(commanded, commanded);
  if (!(size2 > 0.0) || !(observed_sigma_mps > 0.0)) return false;
  const double z = dot(commanded, observed) / size2;
  const double shot = errors_.shot_to_shot * scale_;
  const double noise2 =
      (observed_sigma_mps * observed_sigma_mps + errors_.quantum_mps * errors_.quantum_mps / 12.0) /
          size2 +
      shot * shot;
  const double S = variance_ + noise2, innovation = z - scale_;
  // Written so that a NaN is refused.
  if (!(innovation * innovation <= kGate_sigma * kGate_sigma * S)) return false;
  scale_ += variance_ / S * innovation;
  variance_ *= noise2 / S;
  return true;
}

double ThrusterScale::sigma() const {
  return std::sqrt(variance_);
}

Vec3 ThrusterScale::command_for(const Vec3& wanted) const {
  return (1.0 / scale_) * wanted;
}

ThrusterErrors ThrusterScale::errors() const {
  ThrusterErrors left = errors_;
  left.scale = sigma();
  return left;
}

}  // namespace formation_gnc
