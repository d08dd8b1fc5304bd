/// Estimates where the deputy is relative to the chief, from GNSS fixes of both.
///
/// State       a_roe [m] of the deputy (mean elements), and the chief's own mean orbit, each a
///             Gaussian.
/// Dynamics    J2 state transition; noise of the relative (and absolute) acceleration, white; own
///             burns enter at mid-burn through the control input matrix, with an execution error.
/// Measuring   Both fixes of one epoch become mean elements; their difference measures a_roe
///             directly. What the two share (Earth orientation, lever arm, broadcast orbits)
///             cancels. The lever arm of (0.05, 0, 0.10) m is not taken off: two spacecraft that
///             point at the zenith carry it alike, to 1e-4 of it.
/// Lateness    The filter stays `lag_s` behind and takes measurements in the order of their epochs,
///             so messages that overtake each other on the way do not matter. Its answer for the
///             present is the filtered state moved forward over burns and drift.
/// Trust       An update whose innovation is impossible is left out. Three in a row mean that the
///             state is wrong: first a burn that did not happen (or not fully) is suspected and the
///             covariance opened in the direction of its effect, then everything.
/// Memory      Fixed arrays; no allocation.
/// Checked by  test_suites/unit/flight_sw/relative_navigation_test.cpp
#pragma once

#include <cstdint>

#include "gaussian.hpp"
#include "support/gnss_fix.hpp"
#include "support/orbit/burn.hpp"
#include "support/orbit/relative_elements.hpp"

namespace formation_keeping {

using flight_support::Burn;
using flight_support::EarthTime;
using flight_support::GnssFix;

struct NavigationOptions {
  EarthTime earth_time;
  double lag_s = 30.0;  ///< log-normal delay of median 1 s: 5e-6 of the messages are later
  double pairing_tolerance_s = 6.0;  ///< own fix and chief's fix may be this far apart
  /// Root power spectral density of the acceleration that the J2 model leaves out [m/s^1.5].
  double relative_noise_mps15 = 1.5e-7;
  double absolute_noise_mps15 = 3e-4;
  double burn_error_fraction = 0.02;  ///< 1-sigma per axis, of the commanded delta-v
  double gate = 33.0;                 ///< see measure()
};

/// The estimate at one instant.
struct FormationState {
  std::int64_t t_ns = 0;
  OrbitElements chief;                ///< mean
  Matrix6 chief_covariance;           ///< of the chief as relative_elements() to the truth [m^2]
  Gaussian relative;                  ///< a_roe [m]
  RelativeElements last_burn_effect;  ///< what the last burn changed in a_roe, by now [m]
};

class RelativeNavigation {
 public:
  explicit RelativeNavigation(const NavigationOptions& options) : options_(options) {}

  /// Takes a fix of this spacecraft. @return false if it is no newer than the last one (but a step
  /// back of a minute or more is a receiver that starts anew, and taken).
  bool add_own_fix(const GnssFix& fix);
  /// Takes a fix of the chief, in any order.
  /// @return false if it is too old to be of use, or has been taken before.
  bool add_chief_fix(const GnssFix& fix);
  /// Notes a commanded burn, in the future or in the recent past.
  void add_burn(const Burn& burn);
  /// Works off the measurements that are `lag_s` old at `now_ns`.
  void process(std::int64_t now_ns);

  bool has_started() const { return started_; }
  /// Is at() possible: has the filter started, and is `t_ns` between its epoch and a day later?
  /// Beyond that an estimate means nothing, and a clock that jumped must not cost hours of
  /// computing.
  bool can_predict(std::int64_t t_ns) const;
  /// The state at `t_ns`, with known burns up to then. Requires can_predict(t_ns).
  FormationState at(std::int64_t t_ns) const;
  /// Epoch of the last measurement used.
  std::int64_t epoch_ns() const { return state_.t_ns; }

  std::uint32_t updates() const { return updates_; }
  std::uint32_t outliers() const { return outliers_; }

 private:
  static constexpr int kOwnFixes = 64;  // a minute at 1 Hz
  static constexpr int kChiefFixes = 16;
  static constexpr int kBurns = 8;

  struct TimedElements {
    std::int64_t t_ns = 0;
    OrbitElements mean;
    double sigma_r_m = 0.0, sigma_v_mps = 0.0;
  };

  TimedElements mean_of(const GnssFix& fix) const;
  const TimedElements* nearest_own(std::int64_t t_ns) const;
  void take_oldest_chief_fix();
  void update(const TimedElements& chief, const TimedElements& own);
  void start(const TimedElements& chief, const RelativeElements& z, const Matrix6& R);
  void measure_relative(const RelativeElements& z, const Matrix6& R, double u_rad, double n_radps);
  void advance(FormationState* state, std::int64_t t_ns) const;
  void coast(FormationState* state, std::int64_t t_ns) const;
  void apply(FormationState* state, const Burn& burn) const;
  void forget_burns_before(std::int64_t t_ns);

  NavigationOptions options_;
  TimedElements own_[kOwnFixes];  // ring
  int own_count_ = 0, own_newest_ = -1;
  TimedElements chief_[kChiefFixes];  // by ascending epoch
  int chief_count_ = 0;
  Burn burns_[kBurns];  // by ascending time, those after state_.t_ns
  int burn_count_ = 0;
  bool started_ = false;
  FormationState state_;
  int outliers_in_a_row_ = 0, reopenings_in_a_row_ = 0;
  bool burn_suspected_ = false;
  std::uint32_t updates_ = 0, outliers_ = 0;
};

}  // namespace formation_keeping
