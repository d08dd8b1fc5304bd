#include "rpo_kit/near_range/pose_filter.hpp"

#include <algorithm>
#include <cmath>

#include "support/orbit/constants.hpp"
#include "support/symmetric.hpp"

namespace rpo_kit {
namespace {

using namespace flight_support;
using Covariance = Matrix<kNearStates, kNearStates>;

constexpr double kStep_s = 1.0;

Mat3 hat(const Vec3& v) {
  return Mat3{{{0, -v[2], v[1]}, {v[2], 0, -v[0]}, {-v[1], v[0], 0}}};
}

// exp(-[d x]): the rotation of the axes by d.
Mat3 turn(const Vec3& d) {
  const double angle = norm(d);
  const Mat3 h = hat(d);
  if (angle < 1e-8) return identity<3>() - h + 0.5 * (h * h);
  const double s = std::sin(angle) / angle, c = (1.0 - std::cos(angle)) / (angle * angle);
  return identity<3>() - s * h + c * (h * h);
}

// The d of turn(d), up to pi.
Vec3 turn_vector(const Mat3& D) {
  const Vec3 axis = 0.5 * vec3(D(1, 2) - D(2, 1), D(2, 0) - D(0, 2), D(0, 1) - D(1, 0));
  const double s = norm(axis), c = 0.5 * (D(0, 0) + D(1, 1) + D(2, 2) - 1.0);
  const double angle = std::atan2(s, c);
  if (s > 1e-6) return (angle / s) * axis;
  if (c > 0.0) return axis;
  // Half a turn: the axis is the column of D + I that is longest.
  int longest = 0;
  for (int k = 1; k < 3; ++k) {
    if (D(k, k) > D(longest, longest)) longest = k;
  }
  Vec3 column;
  for (int k = 0; k < 3; ++k) column[k] = D(k, longest) + (k == longest ? 1.0 : 0.0);
  return (kPi / norm(column)) * column;
}

template <int N>
bool positive_definite(const Matrix<N, N>& P) {
  Matrix<N, N> L;
  return cholesky(P, &L);
}

void put(Covariance* P, int row, int column, const Mat3& block) {
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) (*P)(row + r, column + c) = block(r, c);
  }
}

// Pose covariance in the axes of the filter: place in RTN, turn in B; the camera's own attitude
// counts in both. A turn of R_CB about C is the opposite turn of R_BI about B.
Matrix<6, 6> measured_covariance(const ChaserFrame& frame, const Pose& pose,
                                 double least_rotation_rad, double scale_error) {
  const Mat3 R_HC = frame.R_HI * transpose(frame.R_CI);
  const Mat3 R_BC = transpose(pose.R_CB);
  Matrix<6, 6> T;
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) T(r, c) = R_HC(r, c), T(3 + r, 3 + c) = -R_BC(r, c);
  }
  Matrix<6, 6> own;
  const double variance = frame.attitude_sigma_rad * frame.attitude_sigma_rad;
  const Mat3 lever = hat(pose.r_BC_C);
  const Vec3 stretch = scale_error * pose.r_BC_C;
  const Mat3 place = variance * (lever * transpose(lever)) + stretch * transpose(stretch);
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) own(r, c) = place(r, c);
    own(3 + r, 3 + r) = variance + least_rotation_rad * least_rotation_rad;
  }
  return symmetric(T * (pose.covariance + own) * transpose(T));
}

#ifdef RPO_KIT_DEFECT_TWO_ORDERS
// For tests: the watch over flips with a state order of its own, turn before place. On the way back
// its blocks change places and the mixed one is not transposed: symmetric, with the right diagonal,
// and no covariance.
Pose after_flips(const Pose& pose) {
  Pose handed = pose;
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) {
      const double mixed = pose.covariance(kPoseRotation + r, kPosePosition + c);
      handed.covariance(kPosePosition + r, kPoseRotation + c) = mixed;
      handed.covariance(kPoseRotation + c, kPosePosition + r) = mixed;
    }
  }
  return handed;
}
#else
const Pose& after_flips(const Pose& pose) {
  return pose;
}
#endif

}  // namespace

void PoseFilter::start(const ChaserFrame& frame, const Pose& pose) {
  const Matrix<6, 6> M =
      measured_covariance(frame, pose, options_.least_rotation_rad, options_.scale_error);
  t_ns_ = frame.t_ns;
  r_ = frame.R_HI * (transpose(frame.R_CI) * pose.r_BC_C);
  v_ = omega_ = Vec3();
  R_BI_ = transpose(pose.R_CB) * frame.R_CI;
  P_ = Covariance();
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) {
      P_(kNearPosition + r, kNearPosition + c) = M(r, c);
      P_(kNearPosition + r, kNearRotation + c) = M(r, 3 + c);
      P_(kNearRotation + r, kNearPosition + c) = M(3 + r, c);
      P_(kNearRotation + r, kNearRotation + c) = M(3 + r, 3 + c);
    }
    const double v = options_.first_velocity_mps, w = options_.first_rate_radps;
    P_(kNearVelocity + r, kNearVelocity + r) = v * v;
    P_(kNearRate + r, kNearRate + r) = w * w;
  }
  started_ = true;
  healthy_ = positive_definite(P_);
  flips_in_a_row_ = agreed_ = 0;
}

// Euler's equations by the midpoint rule: 1e-6 rad/s^2 of rates of a few deg/s at steps of 1 s.
void PoseFilter::tumble(double dt_s) {
  const auto derivative = [&](const Vec3& w) {
    const double* J = options_.inertia;
    return vec3((J[1] - J[2]) / J[0] * w[1] * w[2], (J[2] - J[0]) / J[1] * w[2] * w[0],
                (J[0] - J[1]) / J[2] * w[0] * w[1]);
  };
  const Vec3 middle = omega_ + 0.5 * dt_s * derivative(omega_);
  R_BI_ = turn(dt_s * middle) * R_BI_;
  omega_ = omega_ + dt_s * derivative(middle);
}

void PoseFilter::step(double dt_s, double n) {
  const double s = std::sin(n * dt_s), c = std::cos(n * dt_s), t = dt_s;
  // Clohessy-Wiltshire (Alfriend et al. (2010), eq. 5.21), x radial, y along the track.
  const Mat3 rr{{{4 - 3 * c, 0, 0}, {6 * (s - n * t), 1, 0}, {0, 0, c}}};
  const Mat3 rv{
      {{s / n, 2 * (1 - c) / n, 0}, {-2 * (1 - c) / n, (4 * s - 3 * n * t) / n, 0}, {0, 0, s / n}}};
  const Mat3 vr{{{3 * n * s, 0, 0}, {-6 * n * (1 - c), 0, 0}, {0, 0, -n * s}}};
  const Mat3 vv{{{c, 2 * s, 0}, {-2 * s, 4 * c - 3, 0}, {0, 0, c}}};
  const Vec3 r = rr * r_ + rv * v_;
  v_ = vr * r_ + vv * v_;
  r_ = r;
  Covariance Phi = identity<kNearStates>();
  put(&Phi, kNearPosition, kNearPosition, rr);
  put(&Phi, kNearPosition, kNearVelocity, rv);
  put(&Phi, kNearVelocity, kNearPosition, vr);
  put(&Phi, kNearVelocity, kNearVelocity, vv);
  const double* J = options_.inertia;
  const Vec3 w = omega_;
  const Mat3 by_rate{{{0, (J[1] - J[2]) / J[0] * w[2], (J[1] - J[2]) / J[0] * w[1]},
                      {(J[2] - J[0]) / J[1] * w[2], 0, (J[2] - J[0]) / J[1] * w[0]},
                      {(J[0] - J[1]) / J[2] * w[1], (J[0] - J[1]) / J[2] * w[0], 0}}};
  put(&Phi, kNearRotation, kNearRotation, turn(dt_s * w));
  put(&Phi, kNearRotation, kNearRate, dt_s * turn(0.5 * dt_s * w));
  put(&Phi, kNearRate, kNearRate, identity<3>() + dt_s * by_rate);
  tumble(dt_s);
  P_ = Phi * P_ * transpose(Phi);
  const double qa = options_.acceleration_m2ps3, qw = options_.angular_rad2ps3;
  const auto add = [&](int upper, int lower, double q) {
    for (int k = 0; k < 3; ++k) {
      P_(upper + k, upper + k) += q * t * t * t / 3.0;
      P_(upper + k, lower + k) += q * t * t / 2.0;
      P_(lower + k, upper + k) += q * t * t / 2.0;
      P_(lower + k, lower + k) += q * t;
    }
  };
  add(kNearPosition, kNearVelocity, qa);
  add(kNearRotation, kNearRate, qw);
  P_ = symmetric(P_);
}

void PoseFilter::predict(std::int64_t t_ns, double orbital_rate_radps) {
  if (!started_ || t_ns <= t_ns_) return;
  double left_s = seconds(t_ns - t_ns_);
  while (left_s > 0.0) {
    const double dt_s = std::min(left_s, kStep_s);
    step(dt_s, orbital_rate_radps);
    left_s -= dt_s;
  }
  t_ns_ = t_ns;
}

template <int M>
void PoseFilter::correct(const Matrix<M, kNearStates>& H, const Vector<M>& innovation,
                         const Matrix<M, M>& R) {
  const Matrix<M, M> S = symmetric(H * P_ * transpose(H) + R);
  Matrix<M, kNearStates> Kt;
  if (!solve(S, H * P_, &Kt)) return;
  const Matrix<kNearStates, M> K = transpose(Kt);
  const Vector<kNearStates> dx = K * innovation;
  // Joseph's form: stays positive whatever rounding does.
  const Covariance A = identity<kNearStates>() - K * H;
  P_ = symmetric(A * P_ * transpose(A) + K * R * Kt);
  healthy_ = healthy_ && positive_definite(P_);
  for (int k = 0; k < 3; ++k) {
    r_[k] += dx[kNearPosition + k];
    v_[k] += dx[kNearVelocity + k];
    omega_[k] += dx[kNearRate + k];
  }
  R_BI_ = turn(vec3(dx[kNearRotation], dx[kNearRotation + 1], dx[kNearRotation + 2])) * R_BI_;
}

// Whether this pose is turned from the filter's attitude as the one before was, within 15 deg.
bool PoseFilter::same_flip_again(const Vec3& d) {
  const Mat3 now = turn(d);
  const bool same = flips_in_a_row_ > 0 && norm(turn_vector(now * transpose(flip_))) < 0.26;
  flip_ = now;
  flips_in_a_row_ = same ? flips_in_a_row_ + 1 : 1;
  return flips_in_a_row_ >= options_.flips_to_believe;
}

PoseVerdict PoseFilter::update(const ChaserFrame& frame, const Pose& pose) {
  if (!started_) {
    start(frame, pose);
    return PoseVerdict::kRestarted;
  }
  if (frame.t_ns < t_ns_) return PoseVerdict::kRejected;
  predict(frame.t_ns, frame.orbital_rate_radps);
  const Matrix<6, 6> R =
      measured_covariance(frame, pose, options_.least_rotation_rad, options_.scale_error);
  healthy_ = healthy_ && positive_definite(R);
  if (!healthy_) return PoseVerdict::kRejected;
  const Vec3 place = frame.R_HI * (transpose(frame.R_CI) * pose.r_BC_C) - r_;
  const Mat3 R_BI = transpose(pose.R_CB) * frame.R_CI;
  const Vec3 rotation = turn_vector(R_BI * transpose(R_BI_));
  Vector<6> innovation;
  Matrix<6, kNearStates> H;
  for (int k = 0; k < 3; ++k) {
    innovation[k] = place[k];
    innovation[3 + k] = rotation[k];
    H(k, kNearPosition + k) = 1.0;
    H(3 + k, kNearRotation + k) = 1.0;
  }
  Matrix<6, 6> S = H * P_ * transpose(H) + R;
  if (squared_mahalanobis(S, innovation) < options_.gate && norm(rotation) < 0.8) {
    correct<6>(H, innovation, R);
    ++used_;
    ++agreed_;
    flips_in_a_row_ = 0;
    return PoseVerdict::kUsed;
  }
  Mat3 R_place, S_place;
  Matrix<3, kNearStates> H_place;
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) R_place(r, c) = R(r, c), S_place(r, c) = S(r, c);
    H_place(r, kNearPosition + r) = 1.0;
  }
  if (!(squared_mahalanobis(S_place, place) < options_.gate)) {
    ++rejected_;
    return PoseVerdict::kRejected;
  }
  ++flips_;
  // Of two that contradict each other the newer is as good; and as long as the rate is not known,
  // a flip of the first would never look the same twice.
  if (agreed_ == 0) {
    start(frame, pose);
    return PoseVerdict::kRestarted;
  }
  if (same_flip_again(rotation)) {
    start(frame, after_flips(pose));
    return PoseVerdict::kRestarted;
  }
  correct<3>(H_place, place, R_place);
  return PoseVerdict::kPlaceOnly;
}

void PoseFilter::burn(const Vec3& dv_RTN, const Mat3& covariance_RTN) {
  // The chaser burns: target less chaser changes the other way.
  v_ = v_ - dv_RTN;
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) P_(kNearVelocity + r, kNearVelocity + c) += covariance_RTN(r, c);
  }
}

}  // namespace rpo_kit
