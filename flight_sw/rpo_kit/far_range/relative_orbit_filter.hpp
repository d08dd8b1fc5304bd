/// The relative orbit from directions, GNSS differences and places, one after the other.
///
/// One filter over the whole range: a hand-over from one sensor to the next is nothing but another
/// kind of measurement, and neither state nor covariance changes hands.
///
/// Method      Unscented Kalman filter (Julier & Uhlmann; kappa = 1, 13 points) on mean relative
///             elements, with the non-linear motion and directions of relative_orbit.hpp.
///             Burns of the observer move the state by what is known of them and widen it by what
///             is not. Residuals in the tangent plane of the measured direction: no angle has a
///             pole. Those of a second observer are seen from where it is, and the covariance of
///             that, over the range, is added to their noise.
/// Noise       Random relative acceleration, white, of one strength per axis of RTN, adapted to the
///             state's corrections (adaptive state noise compensation, Stacey & D'Amico, IEEE TAES
///             57(5), 2021) within given limits.
/// Accuracy    30 km to 2 km with burns known to 1 % and directions to 20 arcsec: see README.
/// Outliers    Squared normalised innovations beyond the 1 - 3e-4 quantile are not used.
/// Checked by  test_suites/unit/flight_sw/rpo_kit/relative_orbit_filter_test.cpp
#pragma once

#include "rpo_kit/far_range/relative_orbit.hpp"

namespace rpo_kit {

struct RelativeOrbitFilterOptions {
  double least_noise_m2ps3 = 1e-15, most_noise_m2ps3 = 1e-9;  ///< PSD of the acceleration
  double first_noise_m2ps3 = 1e-13;
  double memory = 40.0;  ///< corrections over which the noise is adapted
  double longest_step_s = 300.0;
};

/// Target less observer in ECI, as a pose shows it.
struct PlaceMeasurement {
  std::int64_t t_ns = 0;
  flight_support::Vec3 r_TO_ECI;  ///< [m]
  flight_support::Mat3 covariance;
};

/// Target less observer in ECI, as two GNSS receivers show it.
struct StateMeasurement {
  std::int64_t t_ns = 0;
  flight_support::Vec3 r_TO_ECI, v_TO_ECI;    ///< [m, m/s]
  double sigma_r_m = 0.0, sigma_v_mps = 0.0;  ///< 1-sigma per axis, of the difference
};

class RelativeOrbitFilter {
 public:
  explicit RelativeOrbitFilter(const RelativeOrbitFilterOptions& options = {})
      : options_(options) {}

  /// @param observer  At the time of the state.
  void start(const Observer& observer, const flight_support::RelativeElements& a_roe,
             const flight_support::Matrix6& covariance);
  bool started() const { return started_; }
  /// False since the covariance lost its positive definiteness; start() again.
  bool healthy() const { return healthy_; }

  /// To the time of `observer`, which is the best that is known of its orbit then; not backwards.
  void predict(const Observer& observer);
  /// A burn of the observer, not before the filter's time: predicted to first.
  /// @param before  The observer's orbit just before the burn, at its time.
  void burn(const Observer& before, const ObserverBurn& burn);
  /// @param observer  At the bearing's time. @return false: outside the gate, or not usable.
  bool update(const Bearing& bearing, const Observer& observer);
  bool update(const PlaceMeasurement& place, const Observer& observer);
  bool update(const StateMeasurement& state, const Observer& observer);

  const Observer& observer() const { return observer_; }
  const flight_support::RelativeElements& a_roe() const { return a_roe_; }
  const flight_support::Matrix6& covariance() const { return covariance_; }
  const flight_support::Vec3& noise_m2ps3() const { return noise_; }
  int updates() const { return updates_; }
  int outliers() const { return outliers_; }

 private:
  static constexpr int kPoints = 13;
  struct Points;

  bool points(Points* points);
  bool ready(std::int64_t t_ns, const Observer& observer);
  template <int M, class Residual>
  bool absorb(const Residual& residual, const flight_support::Matrix<M, M>& noise, double gate);
  void step(std::int64_t to_ns);
  void add_noise(const flight_support::OrbitElements& orbit, double dt_s);
  void adapt(const flight_support::Matrix6& predicted, const flight_support::Vector<6>& correction);

  RelativeOrbitFilterOptions options_;
  Observer observer_;
  flight_support::RelativeElements a_roe_;
  flight_support::Matrix6 covariance_;
  flight_support::Vec3 noise_;
  // Since the last update: noise that was added, and per unit of strength of each axis.
  flight_support::Matrix6 added_;
  flight_support::Matrix<6, 3> unit_;  // diagonals
  // Averages over the memory.
  flight_support::Vector<6> seen_;
  flight_support::Matrix<6, 3> expected_;
  double weight_ = 0.0;
  bool started_ = false, healthy_ = false;
  int updates_ = 0, outliers_ = 0;
};

}  // namespace rpo_kit
