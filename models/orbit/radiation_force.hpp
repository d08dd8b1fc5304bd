/// Pressure of sunlight on a sphere.
#pragma once

#include <orrery/models/orbit/force_model.hpp>
#include <orrery/models/orbit/shadow.hpp>

namespace orrery {

enum class ShadowModel {
  kConical,      // light falls with the covered part of the Sun's disc
  kThreeStates,  // 1, 1/2 or 0 in sunlight, penumbra and umbra
  kNone          // always in sunlight
};

struct RadiationForceOptions {
  double area_m2 = 0.06;  // 0 or more
  /// 1: absorbed, or reflected as a mirror ball does; 2: a mirror that faces the Sun. 0 or more.
  double radiation_coefficient = 1.8;
  ShadowModel shadow = ShadowModel::kConical;
};

/// a = nu P0 Cr A/m (au/d)^2 along the Sun's rays: Montenbruck & Gill, Satellite Orbits (2000),
/// 3.4. With nu from shadow.hpp; d from the Sun of Surroundings to the spacecraft. Its edges are
/// those of the penumbra.
class RadiationForce final : public ForceAlongOrbit {
 public:
  /// @throws std::invalid_argument  an area or coefficient that is negative or not finite.
  explicit RadiationForce(const RadiationForceOptions& options = {});

  std::string_view name() const override { return "radiation_pressure"; }
  Vec3 acceleration_ECI(const OrbitState& state, const Surroundings& around) const override;

  ForceMemory begin(const OrbitState& state, const Surroundings& around) const override;
  Vec3 acceleration_ECI(const OrbitState& state, const Surroundings& around,
                        const ForceMemory& memory) const override;
  bool has_edges() const override { return options_.shadow != ShadowModel::kNone; }
  double margin(const OrbitState& state, const Surroundings& around,
                const ForceMemory& memory) const override;
  ForceMemory crossed(const ForceMemory& memory, const OrbitState& state,
                      const Surroundings& around) const override;

 private:
  Vec3 in_sunlight_ECI(const OrbitState& state, const Surroundings& around) const;
  double light(const OrbitState& state, const Surroundings& around) const;

  RadiationForceOptions options_;
};

constexpr double kSunlightPressure_Pa = 4.56e-6;        // at 1 au; Montenbruck & Gill, 3.4
constexpr double kAstronomicalUnit_m = 1.495978707e11;  // IAU 2012 resolution B2

}  // namespace orrery
