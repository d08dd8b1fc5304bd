/// The Earth's gravity field as a force: everything besides the point mass.
#pragma once

#include <orrery/models/orbit/force_model.hpp>
#include <orrery/models/orbit/gravity.hpp>

#include <memory>

namespace orrery {

/// Turns the position to ECEF, sums the harmonics from degree 2, turns the acceleration back.
///
/// A field with another mu than kMuEarth_m3ps2 also gives the difference of the central terms, so
/// the propagator's point mass plus this force is always the whole field.
class GravityForce final : public ForceModel {
 public:
  /// Several spacecraft may share one field. @throws std::invalid_argument  null.
  explicit GravityForce(std::shared_ptr<const HarmonicGravity> gravity);

  std::string_view name() const override { return "gravity"; }
  /// @throws std::domain_error  the position is below the field's reference radius, or not finite.
  Vec3 acceleration_ECI(const OrbitState& state, const Surroundings& surroundings) const override;

 private:
  std::shared_ptr<const HarmonicGravity> gravity_;
};

/// GGM05S to `degree` (2 to 60), compiled in. `path` as for HarmonicGravity.
/// @throws std::out_of_range  another degree.
std::shared_ptr<const GravityForce> make_earth_gravity(int degree = 60,
                                                       std::optional<VectorPath> path = {});

}  // namespace orrery
