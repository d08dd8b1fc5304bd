#include <orrery/harness/kernel/text.hpp>
#include <orrery/models/frames/frames.hpp>
#include <orrery/models/frames/geodetic.hpp>
#include <orrery/models/ground/ground_station.hpp>
#include <orrery/models/orbit/earth.hpp>

#include <cmath>
#include <stdexcept>

namespace orrery {
namespace {

constexpr double kLight_mps = 299792458;  // exact: 17th CGPM, 1983
constexpr double kRadPerDeg = 3.14159265358979323846 / 180;

// Kiruna and Kourou: ESA, ESTRACK Facilities Manual (DOPS-ESTR-OPS-MAN-1001). Svalbard and Troll:
// the stations of Kongsberg Satellite Services, from maps.
const std::vector<GroundStationOptions>& known() {
  static const std::vector<GroundStationOptions> kKnown = {
      {.name = "svalbard", .latitude_deg = 78.2298, .longitude_deg = 15.4078, .height_m = 500},
      {.name = "kiruna", .latitude_deg = 67.8571, .longitude_deg = 20.9643, .height_m = 402},
      {.name = "kourou", .latitude_deg = 5.2514, .longitude_deg = -52.8047, .height_m = -15},
      {.name = "troll", .latitude_deg = -72.0114, .longitude_deg = 2.5350, .height_m = 1290}};
  return kKnown;
}

void require(const GroundStationOptions& options, const char* option, double value, double low,
             double high) {
  if (value >= low && value <= high) return;  // NaN fails
  throw std::invalid_argument("GroundStation '" + options.name + "': " + option + " = " +
                              to_text(value) + "; accepted: " + to_text(low) + " to " +
                              to_text(high));
}

GroundStationOptions checked(const GroundStationOptions& options) {
  if (options.name.empty()) throw std::invalid_argument("GroundStation: the name is empty");
  require(options, "latitude_deg", options.latitude_deg, -90, 90);
  require(options, "longitude_deg", options.longitude_deg, -360, 360);
  require(options, "height_m", options.height_m, -1000, 10'000);
  require(options, "elevation_mask_deg", options.elevation_mask_deg, 0, 89);
  return options;
}

Vec3 moved_on(const OrbitState& s, double dt_s) {
  const double r = norm(s.r_ECI);
  const Vec3 gravity = (-kMuEarth_m3ps2 / (r * r * r)) * s.r_ECI;
  return s.r_ECI + dt_s * s.v_ECI + (0.5 * dt_s * dt_s) * gravity;
}

}  // namespace

std::vector<std::string> known_ground_stations() {
  std::vector<std::string> names;
  for (const GroundStationOptions& one : known()) names.push_back(one.name);
  return names;
}

GroundStationOptions known_ground_station(const std::string& name) {
  std::string names;
  for (const GroundStationOptions& one : known()) {
    if (one.name == name) return one;
    names += (names.empty() ? "" : ", ") + one.name;
  }
  throw std::invalid_argument("no ground station '" + name + "'; there are " + names);
}

GroundStation::GroundStation(const GroundStationOptions& options) : options_(checked(options)) {
  const double latitude = kRadPerDeg * options.latitude_deg;
  const double longitude = kRadPerDeg * options.longitude_deg;
  r_ECEF_ = to_ECEF({latitude, longitude, options.height_m});
  up_ECEF_ = {std::cos(latitude) * std::cos(longitude), std::cos(latitude) * std::sin(longitude),
              std::sin(latitude)};
  sin_mask_ = std::sin(kRadPerDeg * options.elevation_mask_deg);
}

GroundStation::View GroundStation::view(const OrbitState& spacecraft, const Surroundings& s) const {
  const EarthFixedState fixed =
      to_earth_fixed({spacecraft.r_ECI, spacecraft.v_ECI}, s.R_EI, s.omega_EI_ECEF);
  const Vec3 d = fixed.r_ECEF - r_ECEF_;
  View view;
  view.range_m = norm(d);
  view.sin_elevation = dot(up_ECEF_, d) / view.range_m;
  const double range_rate_mps = dot(d, fixed.v_ECEF) / view.range_m;
  view.sin_elevation_rate =
      (dot(up_ECEF_, fixed.v_ECEF) - view.sin_elevation * range_rate_mps) / view.range_m;
  return view;
}

double GroundStation::elevation_rad(const OrbitState& spacecraft, const Surroundings& s) const {
  const Vec3 d = s.R_EI * spacecraft.r_ECI - r_ECEF_;
  return std::atan2(dot(up_ECEF_, d), norm(cross(up_ECEF_, d)));
}

// Each iteration shortens the error by v/c, 2.5e-5: three leave none.
Duration GroundStation::light_time_up(const OrbitState& spacecraft,
                                      const SpaceEnvironment& environment) const {
  const Vec3 station_ECI = transpose(environment.surroundings(spacecraft.t).R_EI) * r_ECEF_;
  double delay_s = 0;
  for (int i = 0; i < 4; ++i) {
    delay_s = norm(moved_on(spacecraft, delay_s) - station_ECI) / kLight_mps;
  }
  return from_seconds(delay_s);
}

Duration GroundStation::light_time_down(const OrbitState& spacecraft,
                                        const SpaceEnvironment& environment) const {
  Duration delay{};
  for (int i = 0; i < 4; ++i) {
    const Mat3 R_EI = environment.surroundings(spacecraft.t + delay).R_EI;
    delay = from_seconds(norm(spacecraft.r_ECI - transpose(R_EI) * r_ECEF_) / kLight_mps);
  }
  return delay;
}

}  // namespace orrery
