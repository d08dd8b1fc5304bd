/// A station on the ground: where it stands, and how it sees a spacecraft.
#pragma once

#include <orrery/harness/kernel/time.hpp>
#include <orrery/models/orbit/force_model.hpp>
#include <orrery/models/orbit/space_environment.hpp>

#include <cstdint>
#include <string>
#include <vector>

namespace orrery {

struct GroundStationOptions {
  std::string name = {};
  double latitude_deg = 0;        // geodetic, WGS 84, north positive, -90 to 90
  double longitude_deg = 0;       // east positive, -360 to 360
  double height_m = 0;            // above the ellipsoid, -1000 to 10,000
  double elevation_mask_deg = 5;  // a spacecraft is in view from this elevation on, 0 to 89
  std::uint64_t uplink_bps = 0;   // 0: a frame takes no time on air
  std::uint64_t downlink_bps = 0;
  bool telemetry_waits = false;  // true: what is sent out of view is kept aboard for the next pass
};

/// Stations known by name: "svalbard", "kiruna", "kourou", "troll". Places to some hundred metres,
/// which move a pass by some hundredths of a second; give options of your own where that matters.
/// @throws std::invalid_argument  none of that name; lists them.
GroundStationOptions known_ground_station(const std::string& name);
std::vector<std::string> known_ground_stations();

/// Method  Straight lines: no refraction, which lifts a spacecraft at 5 degrees by 0.15 degrees, so
///         that it rises up to 3 s earlier. The horizon is normal to the WGS 84 ellipsoid. The
///         station turns with the Earth (Surroundings).
/// Checked by  test_suites/unit/models/ground/ground_station_test.cpp
class GroundStation {
 public:
  /// @throws std::invalid_argument  an option outside its range, an empty name.
  explicit GroundStation(const GroundStationOptions& options);

  const std::string& name() const { return options_.name; }
  const GroundStationOptions& options() const { return options_; }
  const Vec3& r_ECEF() const { return r_ECEF_; }
  const Vec3& up_ECEF() const { return up_ECEF_; }
  double sin_mask() const { return sin_mask_; }

  /// What the station sees of a spacecraft.
  struct View {
    double sin_elevation = 0;
    double sin_elevation_rate = 0;  // derivative by time [1/s]
    double range_m = 0;
  };
  /// @param s  The surroundings at spacecraft.t.
  View view(const OrbitState& spacecraft, const Surroundings& s) const;
  double elevation_rad(const OrbitState& spacecraft, const Surroundings& s) const;

  /// Time that a signal takes from here to the spacecraft, sent at spacecraft.t, or from there to
  /// here: range at the ends' own instants over the speed of light in vacuum, rounded to
  /// nanoseconds. The spacecraft goes on along its two-body parabola meanwhile: below 1e-15 s.
  Duration light_time_up(const OrbitState& spacecraft, const SpaceEnvironment& environment) const;
  Duration light_time_down(const OrbitState& spacecraft, const SpaceEnvironment& environment) const;

 private:
  GroundStationOptions options_;
  Vec3 r_ECEF_, up_ECEF_;
  double sin_mask_ = 0;
};

}  // namespace orrery
