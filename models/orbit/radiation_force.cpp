#include <orrery/models/orbit/earth.hpp>
#include <orrery/models/orbit/radiation_force.hpp>

#include <cmath>
#include <stdexcept>
#include <string>

namespace orrery {
namespace {

void require_not_negative(const char* name, double value) {
  if (value >= 0 && std::isfinite(value)) return;
  throw std::invalid_argument(std::string("RadiationForce: ") + name + " = " +
                              std::to_string(value) + "; accepted: 0 or more");
}

// On the day side of the plane through the Earth's centre no angle needs to be computed.
bool is_on_day_side(const OrbitState& state, const Surroundings& around) {
  return dot(state.r_ECI, around.r_sun_ECI) > 0;
}

Illumination region_of(const ForceMemory& memory) {
  return static_cast<Illumination>(memory.region);
}

}  // namespace

RadiationForce::RadiationForce(const RadiationForceOptions& options) : options_(options) {
  require_not_negative("area_m2", options.area_m2);
  require_not_negative("radiation_coefficient", options.radiation_coefficient);
}

Vec3 RadiationForce::in_sunlight_ECI(const OrbitState& state, const Surroundings& around) const {
  const Vec3 from_sun = state.r_ECI - around.r_sun_ECI;
  const double d2 = dot(from_sun, from_sun);
  const double push = kSunlightPressure_Pa * options_.radiation_coefficient * options_.area_m2 *
                      (kAstronomicalUnit_m * kAstronomicalUnit_m);
  return push / (state.mass_kg * d2 * std::sqrt(d2)) * from_sun;
}

double RadiationForce::light(const OrbitState& state, const Surroundings& around) const {
  if (options_.shadow == ShadowModel::kNone || is_on_day_side(state, around)) return 1;
  const ShadowGeometry geometry = shadow_geometry(state.r_ECI, around.r_sun_ECI);
  if (options_.shadow == ShadowModel::kConical) return sunlit_fraction(geometry);
  return 0.5 * static_cast<int>(illumination(geometry));
}

Vec3 RadiationForce::acceleration_ECI(const OrbitState& state, const Surroundings& around) const {
  return light(state, around) * in_sunlight_ECI(state, around);
}

ForceMemory RadiationForce::begin(const OrbitState& state, const Surroundings& around) const {
  ForceMemory memory;
  const ShadowGeometry geometry = shadow_geometry(state.r_ECI, around.r_sun_ECI);
  memory.region = static_cast<int>(illumination(geometry));
  return memory;
}

Vec3 RadiationForce::acceleration_ECI(const OrbitState& state, const Surroundings& around,
                                      const ForceMemory& memory) const {
  if (options_.shadow == ShadowModel::kNone) return in_sunlight_ECI(state, around);
  switch (region_of(memory)) {
    case Illumination::kUmbra:
      return {};
    case Illumination::kSunlight:
      return in_sunlight_ECI(state, around);
    case Illumination::kPenumbra:
      break;
  }
  const double nu = options_.shadow == ShadowModel::kThreeStates ? 0.5 : light(state, around);
  return nu * in_sunlight_ECI(state, around);
}

double RadiationForce::margin(const OrbitState& state, const Surroundings& around,
                              const ForceMemory& memory) const {
  if (region_of(memory) == Illumination::kSunlight && is_on_day_side(state, around)) {
    return ForceAlongOrbit::margin(state, around, memory);
  }
  return margin_rad(shadow_geometry(state.r_ECI, around.r_sun_ECI), region_of(memory));
}

ForceMemory RadiationForce::crossed(const ForceMemory& memory, const OrbitState& state,
                                    const Surroundings& around) const {
  ForceMemory beyond = memory;
  Illumination next = Illumination::kPenumbra;
  if (region_of(memory) == Illumination::kPenumbra) {
    const ShadowGeometry geometry = shadow_geometry(state.r_ECI, around.r_sun_ECI);
    next = geometry.separation_rad > geometry.earth_rad ? Illumination::kSunlight
                                                        : Illumination::kUmbra;
  }
  beyond.region = static_cast<int>(next);
  return beyond;
}

}  // namespace orrery
