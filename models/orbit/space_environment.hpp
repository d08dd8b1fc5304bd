/// What surrounds all spacecraft of a run: the Earth's attitude, the Sun, the Moon.
#pragma once

#include <orrery/models/frames/earth_orientation.hpp>
#include <orrery/models/orbit/force_model.hpp>

#include <memory>

namespace orrery {

/// Surroundings as a function of time. Derive from it to fly in a simpler or another world.
class SpaceEnvironment {
 public:
  virtual ~SpaceEnvironment() = default;
  /// Pure: same instant, same bits, whatever was asked before; safe to call from several threads.
  virtual Surroundings surroundings(SimTime t) const = 0;
};

/// The Earth of earth_orientation.hpp with the Sun and Moon of sun_moon.hpp, in about 0.1 us.
///
/// Sun and Moon are cubics through the series' values an hour apart (error h^4/24 max|f''''|: 0.3 m
/// for the Moon, where the series itself errs by up to 800 km), at fixed instants like the Earth's.
/// Checked by test_suites/unit/models/orbit/space_environment_test.cpp
class EarthEnvironment final : public SpaceEnvironment {
 public:
  /// @param eop  UT1, polar motion, dPsi and dEps. Default: UT1 = UTC and the bare models.
  explicit EarthEnvironment(EarthOrientationTable eop = EarthOrientationTable::none());
  ~EarthEnvironment() override;

  /// @throws std::invalid_argument  `t` before 1980 or beyond 2200.
  /// @throws std::out_of_range      `t` outside the table of Earth orientation.
  Surroundings surroundings(SimTime t) const override;

 private:
  struct Kept;
  EarthOrientation earth_;
  std::unique_ptr<Kept> kept_;
};

}  // namespace orrery
