#include "formation_gnc/mission/burn_observer.hpp"

#include <algorithm>
#include <cmath>

namespace formation_gnc {

using namespace flight_support;

namespace {

constexpr std::int64_t kLook_ns = 90'000'000'000;  // after a burn
// The partner's measurements of that time have come then.
constexpr std::int64_t kPatience_ns = 30'000'000'000;

// Of the relative velocity in ECI, along the axes of the body. In the turning frame it would have
// the error of the position in it.
Vec3 velocity_variances(const FormationEstimate& e, const Mat3& R_BI) {
  Mat3 P;
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) P(r, c) = e.covariance(9 + r, 9 + c);
  }
  P = R_BI * P * transpose(R_BI);
  return vec3(P(0, 0), P(1, 1), P(2, 2));
}

// As the filter adds it, by axis of the body.
Vec3 variances(const Maneuver& m, const Vec3& dv_B) {
  const double size2 = dot(dv_B, dv_B);
  const double along = size2 > 0.0 ? m.more_along_mps * m.more_along_mps / size2 : 0.0;
  Vec3 of;
  for (int k = 0; k < 3; ++k) of[k] = m.sigma_mps * m.sigma_mps + along * dv_B[k] * dv_B[k];
  return of;
}

}  // namespace

// What is alike in all axes across the burn, and what is more along it.
Maneuver BurnObserver::expected(std::int64_t t_ns, const Mat3& R_BI,
                                const Vec3& commanded_B) const {
  const Vec3 expected_B = scale_.delivered(commanded_B);
  const Mat3 P_B = scale_.covariance(commanded_B);
  Maneuver m;
  m.who = Who::kSelf;
  m.t_ns = t_ns;
  m.dv_ECI = transpose(R_BI) * expected_B;
  const double trace = P_B(0, 0) + P_B(1, 1) + P_B(2, 2), size2 = dot(expected_B, expected_B);
  const double along2 = size2 > 0.0 ? dot(expected_B, P_B * expected_B) / size2 : trace / 3.0;
  const double across2 = std::min(0.5 * (trace - along2), trace / 3.0);
  m.sigma_mps = std::sqrt(across2);
  m.more_along_mps = std::sqrt(std::max(0.0, along2 - across2));
  return m;
}

void BurnObserver::watch(const Maneuver& burn, const Mat3& R_BI, const Vec3& commanded_B,
                         const Navigation& navigation) {
  if (watched_.waiting) return;
  watched_.look_ns = burn.t_ns + kLook_ns;
  const FormationEstimate predicted = navigation.at(watched_.look_ns);
  watched_.waiting = predicted.valid;
  watched_.expected_B = R_BI * burn.dv_ECI;
  watched_.commanded_B = commanded_B;
  watched_.R_BI = R_BI;
  watched_.predicted_v = predicted.v_relative_ECI;
  watched_.predicted_variance_B = velocity_variances(predicted, R_BI);
  watched_.of_burn_B = variances(burn, watched_.expected_B);
}

void BurnObserver::learn(std::int64_t now_ns, const Navigation& navigation) {
  if (!watched_.waiting || now_ns < watched_.look_ns + kPatience_ns) return;
  watched_.waiting = false;
  const FormationEstimate found = navigation.at(watched_.look_ns);
  if (!found.valid || !found.fixed) return;
  const Vec3 after_B = velocity_variances(found, watched_.R_BI);
  Vec3 change_B = watched_.R_BI * (found.v_relative_ECI - watched_.predicted_v), sigma_B;
  for (int axis = 0; axis < 3; ++axis) {
    const double before = watched_.predicted_variance_B[axis];
    if (!(after_B[axis] < 0.9 * before)) return;
    const double gain = before / (before - after_B[axis]);
    change_B[axis] *= gain;
    sigma_B[axis] =
        std::sqrt(std::max(0.0, before - watched_.of_burn_B[axis]) + gain * after_B[axis]);
  }
  // Self burns, and the velocity is other less self.
  scale_.observe(watched_.commanded_B, watched_.expected_B - change_B, sigma_B);
}

}  // namespace formation_gnc
