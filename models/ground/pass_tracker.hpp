/// Passes of a spacecraft over a ground station, found along a truth that must not be looked at
/// ahead of time.
#pragma once

#include <orrery/models/ground/ground_station.hpp>

#include <memory>
#include <optional>
#include <vector>

namespace orrery {

struct Pass {
  SimTime rise;                             // or the first look, if it was in view then
  std::optional<SimTime> culmination = {};  // of highest elevation; the rise, if it only falls
  double highest_rad = 0;                   // elevation there; before it, that of the rise
  std::optional<SimTime> set = {};          // empty: still in view
};

/// Told the state at one instant, it says at which it needs to be told the next: a root finder
/// whose function values are the truth itself, in order of time.
///
/// Method   From each state an orbit of Kepler is laid ahead, and around it the room in which the
///          truth may be: 2 k dt^2, k bounding all that is not a point mass (J2 at the perigee,
///          twice over for the rest of the field, thrust, 1 mm/s^2 for everything else); the
///          Clohessy-Wiltshire equations give at most 1.5 k dt^2 along track and k dt^2 across.
///          The next look is at the earliest instant at which the truth may cross the mask, at most
///          20 min ahead. The room shrinks with dt^2: three or four looks end within a nanosecond.
///          Passes that a whole search ahead sees below the mask cost one look per 20 min.
/// Accuracy rise and set to the nanosecond of the truth given; culmination to 1 ms, its elevation
///          to 1e-10 rad.
/// Misses   nothing that lasts longer than a nanosecond while the bound k holds. After an impulse,
///          tell the state at that instant; a crossing found too late counts from the look.
/// Checked by  test_suites/unit/models/ground/pass_tracker_test.cpp,
///             test_suites/validation/models/ground/passes_test.cpp
class PassTracker {
 public:
  /// @throws std::invalid_argument  no environment.
  PassTracker(const GroundStation& station, std::shared_ptr<const SpaceEnvironment> environment);

  /// @param truth        Not before the last one.
  /// @param thrust_mps2  Acceleration by thrust from now on, until told otherwise.
  /// @returns the instant of the next look, after truth.t.
  /// @throws std::logic_error  before the last look. std::invalid_argument  not an ellipse.
  SimTime look(const OrbitState& truth, double thrust_mps2 = 0);

  /// As of the last look.
  bool in_view() const { return in_view_; }
  /// The last one may be going on.
  const std::vector<Pass>& passes() const { return passes_; }

 private:
  class Ahead;
  void cross(const OrbitState& truth, double elevation_rad);
  std::optional<SimTime> find_culmination(const Ahead& ahead);

  GroundStation station_;
  std::shared_ptr<const SpaceEnvironment> environment_;
  std::vector<Pass> passes_;
  bool in_view_ = false;
  std::optional<SimTime> last_;
};

}  // namespace orrery
