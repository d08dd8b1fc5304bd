#include <orrery/models/orbit/earth.hpp>
#include <orrery/models/orbit/shadow.hpp>
#include <orrery/models/reference/orbit_events.hpp>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace orrery {
namespace {

constexpr double kHalfPi = 1.5707963267948966;

const Vec3& position(const std::vector<OrbitState>& states, std::size_t spacecraft) {
  if (spacecraft >= states.size())
    throw std::out_of_range("EventFunction: spacecraft " + std::to_string(spacecraft) +
                            "; accepted: below " + std::to_string(states.size()));
  return states[spacecraft].r_ECI;
}

/// Shortest distance from the Earth's centre to the straight line between two points.
double distance_of_line(const Vec3& a, const Vec3& b) {
  const Vec3 ab = b - a;
  const double length2 = dot(ab, ab);
  const double part = length2 > 0 ? std::clamp(-dot(a, ab) / length2, 0.0, 1.0) : 0;
  return norm(a + part * ab);
}

}  // namespace

EventFunction full_sunlight(std::size_t spacecraft) {
  return {"sunlight of " + std::to_string(spacecraft),
          [=](const std::vector<OrbitState>& states, const Surroundings& around) {
            return margin_rad(shadow_geometry(position(states, spacecraft), around.r_sun_ECI),
                              Illumination::kSunlight);
          }};
}

EventFunction umbra(std::size_t spacecraft) {
  return {"umbra of " + std::to_string(spacecraft),
          [=](const std::vector<OrbitState>& states, const Surroundings& around) {
            return margin_rad(shadow_geometry(position(states, spacecraft), around.r_sun_ECI),
                              Illumination::kUmbra);
          }};
}

EventFunction line_of_sight(std::size_t from, std::size_t to, double grazing_height_m) {
  if (!(grazing_height_m >= 0 && std::isfinite(grazing_height_m)))
    throw std::invalid_argument("line_of_sight: grazing_height_m = " +
                                std::to_string(grazing_height_m) + " m; accepted: 0 or more");
  return {"sight from " + std::to_string(from) + " to " + std::to_string(to),
          [=](const std::vector<OrbitState>& states, const Surroundings&) {
            return distance_of_line(position(states, from), position(states, to)) -
                   (kRadiusEarth_m + grazing_height_m);
          }};
}

EventFunction pass(std::size_t spacecraft, std::string station, const Geodetic& place,
                   double mask_rad) {
  if (!(std::abs(mask_rad) <= kHalfPi))
    throw std::invalid_argument("pass: mask_rad = " + std::to_string(mask_rad) +
                                " rad; accepted: -pi/2 to pi/2");
  const Vec3 r_station_ECEF = to_ECEF(place);
  const double c = std::cos(place.latitude_rad);
  const Vec3 up_ECEF{c * std::cos(place.longitude_rad), c * std::sin(place.longitude_rad),
                     std::sin(place.latitude_rad)};
  return {"pass of " + std::to_string(spacecraft) + " over " + std::move(station),
          [=](const std::vector<OrbitState>& states, const Surroundings& around) {
            const Vec3 line = around.R_EI * position(states, spacecraft) - r_station_ECEF;
            return std::asin(std::clamp(dot(unit(line), up_ECEF), -1.0, 1.0)) - mask_rad;
          }};
}

}  // namespace orrery
