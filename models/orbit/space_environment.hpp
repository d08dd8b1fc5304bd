/// What surrounds all spacecraft of a run: the Earth's attitude, the Sun, the Moon.
#pragma once

#include <orrery/models/frames/earth_orientation.hpp>
#include <orrery/models/orbit/force_model.hpp>

namespace orrery {

/// Surroundings as a function of time. Derive from it to fly in a simpler or another world.
class SpaceEnvironment {
 public:
  virtual ~SpaceEnvironment() = default;
  /// Pure: same instant, same bits, whatever was asked before; safe to call from several threads.
  virtual Surroundings surroundings(SimTime t) const = 0;
};

/// The Earth of earth_orientation.hpp with the Sun and Moon of sun_moon.hpp. About 1 us per call.
class EarthEnvironment final : public SpaceEnvironment {
 public:
  /// @throws std::invalid_argument  `t` before 1980 or beyond 2200.
  Surroundings surroundings(SimTime t) const override;

 private:
  EarthOrientation earth_;
};

}  // namespace orrery
