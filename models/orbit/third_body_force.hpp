/// Gravity of the Sun and the Moon.
#pragma once

#include <orrery/models/orbit/force_model.hpp>

#include <memory>

namespace orrery {

// DE440: Park, Folkner, Williams, Boggs, Astron. J. 161:105, 2021.
constexpr double kMuSun_m3ps2 = 1.32712440041279419e20;
constexpr double kMuMoon_m3ps2 = 4.902800118e12;

/// Attraction of a spacecraft at `r` by a body at `s`, less that of the Earth's centre [m/s^2]:
/// mu ((s - r)/|s - r|^3 - s/|s|^3), both geocentric in one frame.
///
/// Method   Battin, An Introduction to the Mathematics and Methods of Astrodynamics (1999), 8.4:
///          -mu/|s - r|^3 (r + F(q) s), without the difference of nearly equal vectors, which would
///          cost the Sun's term five digits.
Vec3 third_body_acceleration(const Vec3& r, const Vec3& s, double mu_m3ps2);

/// The Sun or the Moon of Surroundings as a point mass.
class ThirdBodyForce final : public ForceModel {
 public:
  enum class Body { kSun, kMoon };
  explicit ThirdBodyForce(Body body) : body_(body) {}
  std::string_view name() const override {
    return body_ == Body::kSun ? "sun_gravity" : "moon_gravity";
  }
  Vec3 acceleration_ECI(const OrbitState& state, const Surroundings& around) const override;

 private:
  Body body_;
};

inline std::shared_ptr<const ThirdBodyForce> make_sun_gravity() {
  return std::make_shared<const ThirdBodyForce>(ThirdBodyForce::Body::kSun);
}
inline std::shared_ptr<const ThirdBodyForce> make_moon_gravity() {
  return std::make_shared<const ThirdBodyForce>(ThirdBodyForce::Body::kMoon);
}

}  // namespace orrery
