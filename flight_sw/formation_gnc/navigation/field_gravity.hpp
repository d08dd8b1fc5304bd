/// The filter's field as control's predictions take it.
#pragma once

#include "formation_gnc/control/orbit_prediction.hpp"
#include "formation_gnc/navigation/orbit_pair.hpp"

namespace formation_gnc {

/// GGM05S to the degree that the filter uses, turning with the Earth as in the filter.
class FieldGravity final : public GravityModel {
 public:
  explicit FieldGravity(const OrbitPairOptions& options = {}) : options_(options) {}
  Vec3 acceleration_ECI(std::int64_t t_ns, const Vec3& r_ECI) const override {
    const Vec3 r[2] = {r_ECI, r_ECI};
    Vec3 a[2];
    gravity_ECI(earth_.ecef_to_eci(t_ns, options_.earth_time), options_.gravity_degree, r, a);
    return a[0];
  }

 private:
  OrbitPairOptions options_;
  mutable EarthAttitude earth_;  // remembers; the value depends on the instant alone
};

}  // namespace formation_gnc
