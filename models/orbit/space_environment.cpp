#include <orrery/models/orbit/space_environment.hpp>
#include <orrery/models/orbit/sun_moon.hpp>

namespace orrery {

Surroundings EarthEnvironment::surroundings(SimTime t) const {
  const EarthAttitude earth = earth_.at(t);
  return {earth.R_EI, earth.omega_EI_ECEF, sun_position_ECI(t), moon_position_ECI(t)};
}

}  // namespace orrery
