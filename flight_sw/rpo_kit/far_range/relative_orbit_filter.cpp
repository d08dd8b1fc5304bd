#include "rpo_kit/far_range/relative_orbit_filter.hpp"

#include <algorithm>
#include <cmath>

#include "support/orbit/constants.hpp"
#include "support/symmetric.hpp"

namespace rpo_kit {

using namespace flight_support;

namespace {

constexpr double kKappa = 1.0;
// Quantiles of chi-square at 1 - 3e-4 for 2, 3 and 6 degrees of freedom.
constexpr double kGate2 = 16.2, kGate3 = 18.8, kGate6 = 25.1;
constexpr double kScale = 6.0 + kKappa;
constexpr double kCentre = kKappa / kScale, kOther = 0.5 / kScale;

double weight(int point) {
  return point == 0 ? kCentre : kOther;
}

// Strengths q >= 0 with G q near d, rows in units of their own size: by coordinate descent, which
// for three unknowns settles in a few rounds.
Vec3 non_negative_fit(const Matrix<6, 3>& G, const Vector<6>& d, const Vector<6>& size, Vec3 q) {
  for (int round = 0; round < 20; ++round) {
    for (int j = 0; j < 3; ++j) {
      double num = 0.0, den = 0.0;
      for (int k = 0; k < 6; ++k) {
        double rest = d[k];
        for (int i = 0; i < 3; ++i) rest -= i == j ? 0.0 : G(k, i) * q[i];
        const double w = 1.0 / (size[k] * size[k]);
        num += w * G(k, j) * rest;
        den += w * G(k, j) * G(k, j);
      }
      if (den > 0.0) q[j] = std::max(0.0, num / den);
    }
  }
  return q;
}

}  // namespace

struct RelativeOrbitFilter::Points {
  RelativeElements x[kPoints];
};

void RelativeOrbitFilter::start(const Observer& observer, const RelativeElements& a_roe,
                                const Matrix6& covariance) {
  observer_ = observer;
  a_roe_ = a_roe;
  covariance_ = symmetric(covariance);
  for (int k = 0; k < 3; ++k) noise_[k] = options_.first_noise_m2ps3;
  added_ = Matrix6();
  unit_ = expected_ = Matrix<6, 3>();
  seen_ = Vector<6>();
  weight_ = 0.0;
  updates_ = outliers_ = 0;
  started_ = healthy_ = true;
}

bool RelativeOrbitFilter::points(Points* points) {
  Matrix6 L;
  if (!healthy_ || !cholesky(covariance_, &L)) {
    healthy_ = false;
    return false;
  }
  const double spread = std::sqrt(kScale);
  points->x[0] = a_roe_;
  for (int column = 0; column < 6; ++column) {
    for (int row = 0; row < 6; ++row) {
      points->x[1 + column][row] = a_roe_[row] + spread * L(row, column);
      points->x[7 + column][row] = a_roe_[row] - spread * L(row, column);
    }
  }
  return true;
}

void RelativeOrbitFilter::add_noise(const OrbitElements& orbit, double dt_s) {
  const Matrix<6, 3> B = control_input(orbit);
  for (int axis = 0; axis < 3; ++axis) {
    for (int r = 0; r < 6; ++r) {
      unit_(r, axis) += dt_s * B(r, axis) * B(r, axis);
      for (int c = 0; c < 6; ++c) {
        const double q = noise_[axis] * dt_s * B(r, axis) * B(c, axis);
        covariance_(r, c) += q;
        added_(r, c) += q;
      }
    }
  }
}

void RelativeOrbitFilter::step(std::int64_t to_ns) {
  Points points;
  if (!this->points(&points)) return;
  const double dt_s = seconds(to_ns - observer_.t_ns);
  RelativeElements mean;
  for (int k = 0; k < kPoints; ++k) {
    points.x[k] = drift(observer_.mean, points.x[k], dt_s);
    mean = mean + weight(k) * points.x[k];
  }
  Matrix6 covariance;
  for (int k = 0; k < kPoints; ++k) {
    const RelativeElements d = points.x[k] - mean;
    covariance = covariance + weight(k) * (d * transpose(d));
  }
  const OrbitElements middle = propagate_mean(observer_.mean, 0.5 * dt_s);
  a_roe_ = mean;
  covariance_ = covariance;
  observer_ = propagate(observer_, to_ns);
  add_noise(middle, dt_s);
}

void RelativeOrbitFilter::predict(const Observer& observer) {
  if (!started_ || observer.t_ns < observer_.t_ns) return;
  const std::int64_t longest_ns = nanoseconds(options_.longest_step_s);
  while (healthy_ && observer_.t_ns < observer.t_ns) {
    step(std::min(observer.t_ns, observer_.t_ns + longest_ns));
  }
  observer_ = observer;
}

void RelativeOrbitFilter::burn(const Observer& before, const ObserverBurn& burn) {
  predict(before);
  if (!started_ || !healthy_) return;
  const OrbitElements after = after_burn(before.mean, burn.dv_RTN);
  a_roe_ = seen_from(before.mean, after, a_roe_);
  const Matrix<6, 3> B = control_input(before.mean);
  covariance_ = symmetric(covariance_ + B * burn.covariance_RTN * transpose(B));
  observer_.mean = after;
}

bool RelativeOrbitFilter::ready(std::int64_t t_ns, const Observer& observer) {
  if (!started_ || t_ns != observer.t_ns || t_ns < observer_.t_ns) return false;
  predict(observer);
  return healthy_;
}

// @param residual  Predicted less measured, of a_roe: zero is what was measured.
template <int M, class Residual>
bool RelativeOrbitFilter::absorb(const Residual& residual, const Matrix<M, M>& noise, double gate) {
  Points points;
  if (!this->points(&points)) return false;
  Vector<M> z[kPoints], mean;
  for (int k = 0; k < kPoints; ++k) {
    z[k] = residual(points.x[k]);
    mean = mean + weight(k) * z[k];
  }
  Matrix<M, M> S = noise;
  Matrix<6, M> C;
  for (int k = 0; k < kPoints; ++k) {
    const Vector<M> dz = z[k] - mean;
    S = S + weight(k) * (dz * transpose(dz));
    C = C + weight(k) * ((points.x[k] - a_roe_) * transpose(dz));
  }
  if (!(squared_mahalanobis(S, mean) < gate)) {
    ++outliers_;
    return false;
  }
  Matrix<M, 6> Kt;
  if (!solve(S, transpose(C), &Kt)) return false;
  const Vector<6> correction = -1.0 * (transpose(Kt) * mean);
  const Matrix6 predicted = covariance_;
  a_roe_ = a_roe_ + correction;
  covariance_ = symmetric(covariance_ - C * Kt);
  adapt(predicted, correction);
  ++updates_;
  return true;
}

bool RelativeOrbitFilter::update(const Bearing& bearing, const Observer& observer) {
  if (!(bearing.sigma_rad > 0.0) || !ready(bearing.t_ns, observer)) return false;
  const TangentPlane plane(bearing.direction_ECI);
  const Vec3 from = position_ECI(observer.mean) + bearing.r_SO_ECI;
  // Half the sky away, the points would scatter about the pole and seem uncertain enough.
  const Vec3 expected = target_position_ECI(observer.mean, from, a_roe_);
  if (!(dot(plane.normal, expected) > 0.7 * norm(expected))) {
    ++outliers_;
    return false;
  }
  return absorb<2>(
      [&](const RelativeElements& a_roe) {
        return plane.offset(target_position_ECI(observer.mean, from, a_roe));
      },
      bearing.sigma_rad * bearing.sigma_rad * identity<2>() +
          plane.spread(bearing.covariance_SO_ECI, norm(expected)),
      kGate2);
}

bool RelativeOrbitFilter::update(const PlaceMeasurement& place, const Observer& observer) {
  if (!is_finite(place.r_TO_ECI) || !ready(place.t_ns, observer)) return false;
  const Vec3 from = position_ECI(observer.mean);
  return absorb<3>(
      [&](const RelativeElements& a_roe) {
        return target_position_ECI(observer.mean, from, a_roe) - place.r_TO_ECI;
      },
      place.covariance, kGate3);
}

bool RelativeOrbitFilter::update(const StateMeasurement& state, const Observer& observer) {
  if (!(state.sigma_r_m > 0.0 && state.sigma_v_mps > 0.0)) return false;
  if (!ready(state.t_ns, observer)) return false;
  const StateEci from = state_from_osculating(osculating_from_mean(observer.mean));
  Matrix6 noise;
  for (int k = 0; k < 3; ++k) {
    noise(k, k) = state.sigma_r_m * state.sigma_r_m;
    noise(3 + k, 3 + k) = state.sigma_v_mps * state.sigma_v_mps;
  }
  return absorb<6>(
      [&](const RelativeElements& a_roe) {
        const OrbitElements target = apply_relative_elements(observer.mean, a_roe);
        const StateEci to = state_from_osculating(osculating_from_mean(target));
        Vector<6> z;
        for (int k = 0; k < 3; ++k) {
          z[k] = to.r_ECI[k] - from.r_ECI[k] - state.r_TO_ECI[k];
          z[3 + k] = to.v_ECI[k] - from.v_ECI[k] - state.v_TO_ECI[k];
        }
        return z;
      },
      noise, kGate6);
}

// What the corrections say of the noise since the last one, on average, in the elements' variances:
// dx dx^T + P after - (P before - noise that was added).
void RelativeOrbitFilter::adapt(const Matrix6& predicted, const Vector<6>& correction) {
  const double keep = weight_ > options_.memory ? 1.0 - 1.0 / options_.memory : 1.0;
  weight_ = keep * weight_ + 1.0;
  for (int k = 0; k < 6; ++k) {
    const double seen =
        correction[k] * correction[k] + covariance_(k, k) - predicted(k, k) + added_(k, k);
    seen_[k] = keep * seen_[k] + seen;
    for (int axis = 0; axis < 3; ++axis) {
      expected_(k, axis) = keep * expected_(k, axis) + unit_(k, axis);
    }
  }
  added_ = Matrix6();
  unit_ = Matrix<6, 3>();
  if (weight_ < 0.5 * options_.memory) return;
  Vector<6> size;
  for (int k = 0; k < 6; ++k) size[k] = predicted(k, k);
  const Vec3 fitted = non_negative_fit(expected_, seen_, size, noise_);
  for (int axis = 0; axis < 3; ++axis) {
    noise_[axis] = std::clamp(fitted[axis], options_.least_noise_m2ps3, options_.most_noise_m2ps3);
  }
}

}  // namespace rpo_kit
