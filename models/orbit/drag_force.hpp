/// Drag of a sphere in an atmosphere that turns with the Earth.
#pragma once

#include <orrery/models/atmosphere/atmosphere_model.hpp>
#include <orrery/models/orbit/force_model.hpp>

#include <functional>
#include <memory>

namespace orrery {

struct DragForceOptions {
  double area_m2 = 0.06;  // 0 or more
  double drag_coefficient = 2.2;
  /// Velocity of the air over the ground [m/s], in ECEF axes; a pure function. Empty: calm.
  std::function<Vec3(SimTime, const Vec3& r_ECEF)> wind_ECEF = {};
  /// Along an orbit ask the atmosphere once in `knot_spacing` and interpolate in between.
  bool interpolate_density = true;
  Duration knot_spacing = 40s;  // above 0; not below the integrator's step
};

/// a = -1/2 rho Cd A/m |v_rel| v_rel, with v_rel = v - omega x r - wind.
///
/// Density   ln(rho) + h/H, with h a height and H the scale height at the first knot, is
///           interpolated through four knots of the orbit to come, the stage in the middle
///           interval; -h/H is added at the place itself, so that a place beside the predicted one
///           costs nothing. Knots lie on the orbit predicted in the Earth's field up to J2, some
///           0.1 m off after 80 s. They are set anew where the density jumps, and never reach
///           beyond.
/// Error     4e-6 of the density at 550 km, which averages out over an orbit; what that does to
///           orbits is in drag_interpolation_test.cpp.
/// Checked by test_suites/unit/models/orbit/drag_force_test.cpp,
///           test_suites/validation/models/orbit/drag_interpolation_test.cpp
class DragForce final : public ForceAlongOrbit {
 public:
  /// @throws std::invalid_argument  null atmosphere; an area or coefficient that is negative or not
  ///         finite; a spacing that is not above 0.
  explicit DragForce(std::shared_ptr<const AtmosphereModel> atmosphere,
                     DragForceOptions options = {});

  std::string_view name() const override { return "drag"; }
  /// With the atmosphere's own density. @throws what the atmosphere throws where it ends.
  Vec3 acceleration_ECI(const OrbitState& state, const Surroundings& around) const override;
  std::optional<SimTime> next_discontinuity(SimTime t) const override {
    return atmosphere_->next_discontinuity(t);
  }

  ForceMemory begin(const OrbitState& state, const Surroundings& around) const override;
  ForceMemory next(const ForceMemory& memory, const OrbitState& state,
                   const Surroundings& around) const override;
  /// Knots on the new orbit.
  ForceMemory after_impulse(const ForceMemory&, const OrbitState& state,
                            const Surroundings& around) const override {
    return begin(state, around);
  }
  /// With the interpolated density; beyond the knots with the atmosphere's own.
  Vec3 acceleration_ECI(const OrbitState& state, const Surroundings& around,
                        const ForceMemory& memory) const override;

  /// What the last function uses [kg/m^3].
  double density_kgpm3(const OrbitState& state, const Surroundings& around,
                       const ForceMemory& memory) const;

 private:
  Vec3 drag_ECI(const OrbitState& state, const Surroundings& around, double density_kgpm3) const;
  double scale_height_m(const OrbitState& state, const Surroundings& around) const;
  double knot(SimTime t, const OrbitState& state, const Surroundings& around,
              double scale_height_m) const;
  SimTime last_instant(SimTime t) const;

  std::shared_ptr<const AtmosphereModel> atmosphere_;
  DragForceOptions options_;
};

}  // namespace orrery
