/// All forces of the environment of low Earth orbit, for any number of spacecraft.
#pragma once

#include <orrery/models/atmosphere/space_weather.hpp>
#include <orrery/models/orbit/drag_force.hpp>
#include <orrery/models/orbit/gravity_force.hpp>
#include <orrery/models/orbit/orbit_dynamics.hpp>
#include <orrery/models/orbit/radiation_force.hpp>

#include <memory>

namespace orrery {

/// What the forces need to know of one spacecraft, a sphere; its mass is in OrbitState. The
/// reference mission's 6U CubeSat.
struct SpacecraftProperties {
  double drag_area_m2 = 0.06;
  double drag_coefficient = 2.2;
  double radiation_area_m2 = 0.06;
  double radiation_coefficient = 1.8;
};

/// Each force is there or not, whatever the others.
struct EarthForcesOptions {
  int gravity_degree = 60;  // GGM05S, 2 to 60; 0: the point mass alone
  bool drag = true;         // NRLMSISE-00
  bool radiation_pressure = true;
  bool sun_gravity = true;
  bool moon_gravity = true;
  SpaceWeather space_weather = SpaceWeather::constant({.ap_daily = 4});  // F10.7 = F10.7A = 150 sfu
  bool interpolate_density = true;
  Duration density_knot_spacing = 40s;
  ShadowModel shadow = ShadowModel::kConical;
  std::function<Vec3(SimTime, const Vec3& r_ECEF)> wind_ECEF = {};  // drag_force.hpp
};

/// Gravity field, atmosphere, Sun and Moon are shared by all spacecraft; drag and radiation
/// pressure are each one's own.
class EarthForces {
 public:
  /// @throws std::out_of_range  gravity_degree.
  explicit EarthForces(EarthForcesOptions options = {});
  /// @throws std::invalid_argument  a property that is negative or not finite.
  OrbitDynamics::Forces on(const SpacecraftProperties& properties) const;

 private:
  EarthForcesOptions options_;
  OrbitDynamics::Forces shared_;
  std::shared_ptr<const AtmosphereModel> atmosphere_;  // null without drag
};

}  // namespace orrery
