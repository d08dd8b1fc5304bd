// Navigation::at(): the filter's state at any instant.
#include <cmath>

#include "formation_gnc/navigation/navigation.hpp"
#include "support/orbit/constants.hpp"

namespace formation_gnc {
namespace {

using flight_support::Matrix;
using flight_support::seconds;

constexpr double kLongestPrediction_s = 10800.0;
constexpr int kFewestFixed = 4;

// The twelve states that an estimate tells of, in the filter's order of numbers.
constexpr int kTold[4] = {kPositionSelf, kVelocitySelf, kPositionDifference, kVelocityDifference};

Matrix<12, 12> told_covariance(const UdFactor& ud) {
  Matrix<12, 12> P;
  for (int i = 0; i < 12; ++i) {
    for (int j = 0; j <= i; ++j) {
      P(i, j) = P(j, i) = ud.covariance(kTold[i / 3] + i % 3, kTold[j / 3] + j % 3);
    }
  }
  return P;
}

// Rows: R, T, N of r and of its derivative in the turning frame.
Matrix<6, 6> to_RTN(const Vec3& r, const Vec3& v) {
  const Mat3 R_HI = transpose(rtn_to_eci(r, v));
  const double rate_radps = norm(cross(r, v)) / dot(r, r);
  Matrix<6, 6> M;
  for (int c = 0; c < 3; ++c) {
    for (int row = 0; row < 3; ++row) M(row, c) = M(row + 3, c + 3) = R_HI(row, c);
    M(3, c) = rate_radps * R_HI(1, c);  // less omega x r, omega along N
    M(4, c) = -rate_radps * R_HI(0, c);
  }
  return M;
}

void fill_relative(FormationEstimate* e) {
  e->r_relative_ECI = e->r_other_ECI - e->r_self_ECI;
  e->v_relative_ECI = e->v_other_ECI - e->v_self_ECI;
  flight_support::Vector<6> x;
  for (int i = 0; i < 3; ++i) {
    x[i] = e->r_relative_ECI[i];
    x[i + 3] = e->v_relative_ECI[i];
  }
  const flight_support::Vector<6> y = to_RTN(e->r_self_ECI, e->v_self_ECI) * x;
  for (int i = 0; i < 3; ++i) {
    e->r_relative_RTN[i] = y[i];
    e->v_relative_RTN[i] = y[i + 3];
  }
}

void fill_relative_covariance(FormationEstimate* e) {
  Matrix<6, 6> P;
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < 6; ++j) P(i, j) = e->covariance(i + 6, j + 6);
  }
  const Matrix<6, 6> M = to_RTN(e->r_self_ECI, e->v_self_ECI);
  e->relative_covariance_RTN = symmetric(M * P * transpose(M));
}

void fill_orbits(const OrbitPair& orbits, FormationEstimate* e) {
  e->r_self_ECI = orbits.r[0];
  e->v_self_ECI = orbits.v[0];
  e->r_other_ECI = orbits.r[1];
  e->v_other_ECI = orbits.v[1];
  e->drag_difference_mps2 = orbits.empirical_RTN[1][1] - orbits.empirical_RTN[0][1];
  fill_relative(e);
}

}  // namespace

// The filter as it stood nearest before `t_ns`, if that is near enough.
const FormationFilter* Navigation::filter_for(std::int64_t t_ns) const {
  if (!filter_.started() || processed_ == 0) return nullptr;
  const FormationFilter* filter = &filter_;
  if (t_ns < filter_.t_ns()) {
    const int before = ring_.last_until(t_ns);
    if (before < 0) return nullptr;
    filter = &ring_[before].after_own;
  }
  const bool near = seconds(t_ns - filter->t_ns()) <= kLongestPrediction_s;
  return filter->started() && near ? filter : nullptr;
}

FormationEstimate Navigation::told_by(const FormationFilter& filter) const {
  FormationEstimate e;
  e.valid = filter.other_started() && !filter.lost();
  e.fixed_ambiguities = filter.integers().count();
  e.fixed = e.fixed_ambiguities >= kFewestFixed;
  e.last_own_ns = last_own_ns_;
  e.last_remote_ns = last_remote_ns_;
  return e;
}

FormationEstimate Navigation::at(std::int64_t t_ns) const {
  FormationEstimate e;
  if (const FormationFilter* filter = filter_for(t_ns)) {
    FormationFilter moved = *filter;
    moved.time_update(t_ns, maneuvers_);
    e = told_by(moved);
    fill_orbits(moved.orbits(), &e);
    e.covariance = told_covariance(moved.covariance());
    e.sigma_drag_difference_mps2 =
        std::sqrt(moved.covariance().variance(kAccelerationDifference + 1));
    fill_relative_covariance(&e);
  }
  e.t_ns = t_ns;
  return e;
}

FormationEstimate Navigation::state_at(std::int64_t t_ns) const {
  FormationEstimate e;
  if (const FormationFilter* filter = filter_for(t_ns)) {
    e = told_by(*filter);
    fill_orbits(filter->orbits_at(t_ns, maneuvers_), &e);
  }
  e.t_ns = t_ns;
  return e;
}

FormationEstimate seen_from_other(const FormationEstimate& estimate) {
  FormationEstimate e = estimate;
  e.r_self_ECI = estimate.r_other_ECI;
  e.v_self_ECI = estimate.v_other_ECI;
  e.r_other_ECI = estimate.r_self_ECI;
  e.v_other_ECI = estimate.v_self_ECI;
  e.last_own_ns = estimate.last_remote_ns;
  e.last_remote_ns = estimate.last_own_ns;
  e.drag_difference_mps2 = -estimate.drag_difference_mps2;
  fill_relative(&e);
  // (other, -difference) from (self, difference).
  Matrix<12, 12> M;
  for (int k = 0; k < 6; ++k) {
    M(k, k) = M(k, k + 6) = 1.0;
    M(k + 6, k + 6) = -1.0;
  }
  e.covariance = symmetric(M * estimate.covariance * transpose(M));
  fill_relative_covariance(&e);
  return e;
}

}  // namespace formation_gnc
