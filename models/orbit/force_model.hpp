/// What a force on a spacecraft is. Derive from ForceModel to add one; the ready ones do the same.
#pragma once

#include <orrery/harness/kernel/time.hpp>
#include <orrery/models/frames/vector.hpp>

#include <optional>
#include <string_view>

namespace orrery {

/// A spacecraft's state at one instant, ECI = EME2000 (frames.hpp).
struct OrbitState {
  SimTime t;
  Vec3 r_ECI;  // [m]
  Vec3 v_ECI;  // [m/s]
  double mass_kg = 0;
};

/// What surrounds every spacecraft at one instant; evaluated once and shared by all forces.
struct Surroundings {
  Mat3 R_EI;           // ECI -> ECEF
  Vec3 omega_EI_ECEF;  // Earth's angular velocity relative to ECI [rad/s]
  Vec3 r_sun_ECI;      // geocentric [m]
  Vec3 r_moon_ECI;     // geocentric [m]
};

/// A force. Pure: same arguments, same bits, called any number of times at any instants.
class ForceModel {
 public:
  virtual ~ForceModel() = default;
  virtual std::string_view name() const = 0;
  /// Acceleration [m/s^2] besides the Earth's point-mass attraction -mu r/|r|^3, which the
  /// propagator carries itself.
  virtual Vec3 acceleration_ECI(const OrbitState&, const Surroundings&) const = 0;
  /// The first instant after `t` at which the acceleration jumps; from that instant on the new
  /// value holds. The integrator ends a step there and sees the old value up to it.
  virtual std::optional<SimTime> next_discontinuity(SimTime t) const {
    (void)t;
    return {};
  }
};

}  // namespace orrery
