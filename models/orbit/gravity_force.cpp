#include <orrery/models/orbit/earth.hpp>
#include <orrery/models/orbit/gravity_force.hpp>

#include <stdexcept>

namespace orrery {

GravityForce::GravityForce(std::shared_ptr<const HarmonicGravity> gravity)
    : gravity_(std::move(gravity)) {
  if (gravity_ == nullptr) throw std::invalid_argument("GravityForce: no field given");
}

Vec3 GravityForce::acceleration_ECI(const OrbitState& state, const Surroundings& around) const {
  const Vec3 a_ECEF = gravity_->perturbation_ECEF(around.R_EI * state.r_ECI);
  const Vec3 a_ECI = transpose(around.R_EI) * a_ECEF;
  const double mu_difference = gravity_->mu_m3ps2() - kMuEarth_m3ps2;
  if (mu_difference == 0) return a_ECI;
  const double r = norm(state.r_ECI);
  return a_ECI - mu_difference / (r * r * r) * state.r_ECI;
}

std::shared_ptr<const GravityForce> make_earth_gravity(int degree, std::optional<VectorPath> path) {
  return std::make_shared<GravityForce>(
      std::make_shared<HarmonicGravity>(GravityField::ggm05s(), degree, path));
}

}  // namespace orrery
