/// Where the target is, from whatever sees it: GNSS of both, directions, poses.
///
/// Method      One filter on relative elements (far_range/relative_orbit_filter.hpp) takes every
///             kind of measurement, so sensors come and go without a hand-over of state. It starts
///             from a GNSS difference, or from directions alone by the batch. What arrives is
///             sorted by its own time for `lag_s` before it is used: late messages, transferred
///             images and burns then count in the order in which they happened.
/// Second      Directions that another spacecraft measured are seen from where it is: its GNSS
///             position less the own raw fix, so that what the model of the orbits leaves is in
///             neither. They start the filter, too, once two lines of sight that pass each other
///             agree. Outside the gate they are not used, and never restart the filter: to that
///             only the own sensors are trusted.
/// Own orbit   Mean elements, smoothed over GNSS fixes; differences of GNSS use the raw fixes.
/// Output      a_roe of the CHASER relative to the TARGET, as guidance wants it. Turning the
///             relation round changes the sign; what else it changes is a_roe/a of the covariance,
///             4e-3 at 30 km, and is left out.
/// Checked by  test_suites/unit/flight_sw/rpo_kit/relative_navigation_test.cpp
#pragma once

#include <cstdint>
#include <vector>

#include "rpo_kit/far_range/initial_orbit.hpp"
#include "rpo_kit/far_range/relative_orbit_filter.hpp"
#include "support/orbit/passive_safety.hpp"

namespace rpo_kit {

enum class Source { kGnss, kBearing, kPose, kSecond };
constexpr int kSources = 4;

struct NavigationOptions {
  RelativeOrbitFilterOptions filter = {};
  BatchOptions batch = {};
  double lag_s = 30.0;           ///< how late a message may be and still be used
  double pairing_s = 6.0;        ///< between the two fixes of a GNSS difference
  double batch_arc_s = 8000.0;   ///< of directions before the first solution is tried
  double second_arc_s = 1500.0;  ///< the same if a second observer's are among them
  double batch_accuracy = 0.3;   ///< 1-sigma of the range that is good enough to start
  double lost_s = 3600.0;        ///< without any measurement the estimate is none
  double burn_fraction = 0.02, burn_direction_rad = 0.01;  ///< 1-sigma of a burn's execution
  double own_memory = 30.0;  ///< fixes over which the own orbit is smoothed
};

/// A GNSS solution in ECI.
struct EciFix {
  std::int64_t t_ns = 0;
  flight_support::StateEci state;
  double sigma_r_m = 0.0, sigma_v_mps = 0.0;  ///< 1-sigma per axis
};

/// Where another spacecraft saw the target, and where that one was.
struct SecondBearing {
  std::int64_t t_ns = 0;
  flight_support::Vec3 direction_ECI;  ///< unit vector, geometric
  double sigma_rad = 0.0;              ///< 1-sigma per axis
  flight_support::Vec3 r_ECI;          ///< [m]
  flight_support::Mat3 covariance_ECI;
};

class RelativeNavigation {
 public:
  explicit RelativeNavigation(const NavigationOptions& options = {});

  void own_fix(const EciFix& fix);
  void target_fix(const EciFix& fix);
  void bearing(const Bearing& bearing);
  /// One per instant; those that wait are few, so that a flood drops itself alone.
  void second_bearing(const SecondBearing& bearing);
  void pose(const PlaceMeasurement& place);
  /// A start from a track of poses, where nothing else has started it; otherwise nothing happens.
  /// @param covariance_RTN  Of position and inertial velocity, in axes of RTN.
  void start_from_track(const StateMeasurement& state,
                        const flight_support::Matrix6& covariance_RTN);
  /// A burn of this spacecraft that will be, or was.
  void burn(std::int64_t t_ns, const flight_support::Vec3& dv_ECI);

  /// Uses what is older than the lag; @param now_ns  GPS time.
  void process(std::int64_t now_ns);

  /// The estimate at `t_ns` includes all burns told for before then. @return false: there is none.
  bool at(std::int64_t t_ns, flight_support::RelativeOrbit* chaser,
          flight_support::Matrix6* covariance) const;
  bool own_at(std::int64_t t_ns, Observer* own) const;

  bool started() const { return filter_.started() && filter_.healthy(); }
  std::int64_t last_used_ns(Source source) const { return last_ns_[static_cast<int>(source)]; }
  int used(Source source) const { return used_[static_cast<int>(source)]; }
  int outliers() const { return outliers_; }
  int restarts() const { return restarts_; }
  /// Too late, or not usable.
  int dropped() const { return dropped_; }

 private:
  enum class Kind { kBurn, kOwnFix, kTargetFix, kBearing, kPose, kSecond };
  struct Event {
    std::int64_t t_ns = 0;
    Kind kind = Kind::kOwnFix;
    EciFix fix;
    Bearing bearing;
    SecondBearing second;
    PlaceMeasurement place;
    flight_support::Vec3 dv_ECI;
  };

  void insert(const Event& event);
  void use(const Event& event);
  void use_own_fix(const EciFix& fix);
  void use_target_fix(const EciFix& fix);
  void use_bearing(const Bearing& bearing);
  void use_second(const SecondBearing& second);
  bool may_start_with(Bearing* bearing) const;
  void collect(const Bearing& bearing);
  int others_in_batch() const;
  void use_burn(const Event& event);
  void count(bool accepted, Source source, std::int64_t t_ns);
  bool own_raw(std::int64_t t_ns, flight_support::StateEci* own, double* sigma_r_m) const;
  bool difference(const EciFix& target, StateMeasurement* state) const;
  void start_from(const StateMeasurement& state, const EciFix& target, const Observer& own);
  void start_at(const Observer& own, const flight_support::StateEci& target,
                const StateMeasurement& state, const flight_support::Matrix6& covariance_RTN);
  void try_batch();

  NavigationOptions options_;
  std::vector<Event> waiting_;
  RelativeOrbitFilter filter_;
  Observer own_;
  EciFix raw_;  // the last own fix
  int own_fixes_ = 0;
  std::vector<BatchMeasurement> batch_;
  std::vector<ObserverBurn> batch_burns_;
  std::int64_t used_until_ns_ = 0;
  std::int64_t last_ns_[kSources] = {};
  int used_[kSources] = {};
  int outliers_ = 0, outliers_in_a_row_ = 0, restarts_ = 0, dropped_ = 0;
};

}  // namespace rpo_kit
