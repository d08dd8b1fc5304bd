#include <orrery/models/atmosphere/nrlmsise00_atmosphere.hpp>
#include <orrery/models/orbit/earth_forces.hpp>
#include <orrery/models/orbit/third_body_force.hpp>

#include <utility>

namespace orrery {

EarthForces::EarthForces(EarthForcesOptions options) : options_(std::move(options)) {
  if (options_.gravity_degree != 0) {
    shared_.push_back(make_earth_gravity(options_.gravity_degree));
  }
  if (options_.sun_gravity) shared_.push_back(make_sun_gravity());
  if (options_.moon_gravity) shared_.push_back(make_moon_gravity());
  if (options_.drag) {
    atmosphere_ = std::make_shared<const Nrlmsise00Atmosphere>(
        Nrlmsise00AtmosphereOptions{.weather = options_.space_weather});
  }
}

OrbitDynamics::Forces EarthForces::on(const SpacecraftProperties& properties) const {
  OrbitDynamics::Forces forces = shared_;
  if (options_.drag) {
    forces.push_back(std::make_shared<const DragForce>(
        atmosphere_, DragForceOptions{.area_m2 = properties.drag_area_m2,
                                      .drag_coefficient = properties.drag_coefficient,
                                      .wind_ECEF = options_.wind_ECEF,
                                      .interpolate_density = options_.interpolate_density,
                                      .knot_spacing = options_.density_knot_spacing}));
  }
  if (options_.radiation_pressure) {
    forces.push_back(std::make_shared<const RadiationForce>(
        RadiationForceOptions{.area_m2 = properties.radiation_area_m2,
                              .radiation_coefficient = properties.radiation_coefficient,
                              .shadow = options_.shadow}));
  }
  return forces;
}

}  // namespace orrery
