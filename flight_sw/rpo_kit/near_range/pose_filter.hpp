/// Where the target is, how it moves and how it tumbles: poses over time.
///
/// State       Order in state_order.hpp: relative position and velocity in the chaser's RTN,
///             attitude R_BI and rate of the target. The attitude is multiplicative (Lefferts,
///             Markley & Shuster 1982).
/// Motion      Clohessy & Wiltshire with white relative acceleration; Euler's equations without
///             torque for the given ratios of inertia, with white angular acceleration.
/// Flips       A pose whose place fits and whose attitude does not is taken for its place alone. If
///             `flips_to_believe` such in a row agree on one other attitude, and nothing spoke for
///             the filter's own meanwhile, it was the filter that had flipped: it starts again from
///             them. As long as no second pose has agreed with the first, it starts from the
///             newest.
/// Health      Whatever a pose says of itself, and the covariance after each correction, must have
///             a Cholesky factor; otherwise the filter is not healthy and stays as it was.
/// Valid for   ranges below 1 km, gaps of minutes; poses by ascending time.
/// Checked by  test_suites/unit/flight_sw/rpo_kit/near_range_test.cpp
#pragma once

#include <cstdint>

#include "rpo_kit/near_range/pose_estimator.hpp"
#include "rpo_kit/state_order.hpp"
#include "support/matrix.hpp"

namespace rpo_kit {

struct PoseFilterOptions {
  double inertia[3] = {1.0, 1.0, 1.0};  ///< principal, of B; their ratios count
  double acceleration_m2ps3 = 1e-11;    ///< PSD per axis
  double angular_rad2ps3 = 1e-10;       ///< PSD per axis
  double first_velocity_mps = 0.1, first_rate_radps = 0.05;  ///< 1-sigma at the start
  double gate = 22.5;  ///< squared normalised innovation: 0.1 % of 6, 5e-5 of 3 degrees of freedom
  double least_rotation_rad = 0.005;  ///< added to what a pose says of itself
  int flips_to_believe = 6;
  /// 1-sigma of a scale that images have in common: of the range, along the line of sight.
  double scale_error = 0.0;
};

/// Of the chaser, at the instant of an exposure.
struct ChaserFrame {
  std::int64_t t_ns = 0;  ///< GPS time
  double orbital_rate_radps = 0.0;
  flight_support::Mat3 R_CI, R_HI;  ///< camera and RTN
  double attitude_sigma_rad = 0.0;  ///< of R_CI, 1-sigma per axis
};

enum class PoseVerdict { kUsed, kPlaceOnly, kRejected, kRestarted };

class PoseFilter {
 public:
  explicit PoseFilter(const PoseFilterOptions& options = {}) : options_(options) {}

  bool started() const { return started_; }
  /// False since a covariance had no Cholesky factor: nothing of it is to be believed any more.
  bool healthy() const { return healthy_; }
  void start(const ChaserFrame& frame, const Pose& pose);
  /// From what other sensors know, attitude open until the first pose.
  void predict(std::int64_t t_ns, double orbital_rate_radps);
  /// @return what became of it; the first pose starts the filter.
  PoseVerdict update(const ChaserFrame& frame, const Pose& pose);
  /// A burn of the chaser, told with its covariance [m^2/s^2].
  void burn(const flight_support::Vec3& dv_RTN, const flight_support::Mat3& covariance_RTN);

  std::int64_t t_ns() const { return t_ns_; }
  const flight_support::Vec3& r_RTN() const { return r_; }  ///< target less chaser [m]
  const flight_support::Vec3& v_RTN() const { return v_; }
  const flight_support::Mat3& R_BI() const { return R_BI_; }
  const flight_support::Vec3& omega_BI_B() const { return omega_; }
  const flight_support::Matrix<kNearStates, kNearStates>& covariance() const { return P_; }
  int used() const { return used_; }
  int flips() const { return flips_; }
  int rejected() const { return rejected_; }

 private:
  void step(double dt_s, double orbital_rate_radps);
  void tumble(double dt_s);
  template <int M>
  void correct(const flight_support::Matrix<M, kNearStates>& H,
               const flight_support::Vector<M>& innovation, const flight_support::Matrix<M, M>& S);
  bool same_flip_again(const flight_support::Vec3& turn);

  PoseFilterOptions options_;
  std::int64_t t_ns_ = 0;
  flight_support::Vec3 r_, v_, omega_;
  flight_support::Mat3 R_BI_ = flight_support::identity<3>();
  flight_support::Matrix<kNearStates, kNearStates> P_;
  bool started_ = false, healthy_ = true;
  int used_ = 0, flips_ = 0, rejected_ = 0, flips_in_a_row_ = 0;
  int agreed_ = 0;                                             // poses used since the start
  flight_support::Mat3 flip_ = flight_support::identity<3>();  // of the last one, in B
};

}  // namespace rpo_kit
