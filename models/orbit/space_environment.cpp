#include <orrery/models/frames/interval_cache.hpp>
#include <orrery/models/orbit/space_environment.hpp>
#include <orrery/models/orbit/sun_moon.hpp>

#include <utility>

namespace orrery {
namespace {

struct SunAndMoon {
  CubicVec3 r_sun_ECI, r_moon_ECI;
};

SunAndMoon make_sun_and_moon(std::int64_t index) {
  std::array<Vec3, 4> sun, moon;
  for (int k = 0; k < 4; ++k) {
    const SimTime t = interval_begin(index) + k * kKnotSpacing;
    sun[k] = sun_position_ECI(t);
    moon[k] = moon_position_ECI(t);
  }
  return {CubicVec3::through(sun), CubicVec3::through(moon)};
}

}  // namespace

struct EarthEnvironment::Kept {
  IntervalCache<SunAndMoon> intervals;
};

EarthEnvironment::EarthEnvironment(EarthOrientationTable eop)
    : earth_(std::move(eop)), kept_(std::make_unique<Kept>()) {}

EarthEnvironment::~EarthEnvironment() = default;

Surroundings EarthEnvironment::surroundings(SimTime t) const {
  const EarthAttitude earth = earth_.at(t);
  const std::int64_t index = interval_index(t);
  const double s = interval_place(index, t);
  return kept_->intervals.use(index, make_sun_and_moon, [&](const SunAndMoon& at) -> Surroundings {
    return {earth.R_EI, earth.omega_EI_ECEF, at.r_sun_ECI.at(s), at.r_moon_ECI.at(s)};
  });
}

}  // namespace orrery
