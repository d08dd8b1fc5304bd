/// What a force on a spacecraft is. Derive from ForceModel to add one; the ready ones do the same.
#pragma once

#include <orrery/harness/kernel/time.hpp>
#include <orrery/models/frames/vector.hpp>

#include <array>
#include <limits>
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

/// What a force keeps along one orbit, from one grid point to the next: part of the integrator's
/// state, so that the force itself stays pure and may serve several orbits. A force uses of it what
/// it needs.
struct ForceMemory {
  int region = 0;  // e.g. sunlight, penumbra, umbra
  std::array<SimTime, 4> instants{};
  std::array<double, 9> numbers{};
};

/// A force with edges in space, where it jumps or has a kink as at the edge of a shadow, or one
/// that is interpolated along the orbit. The integrator ends a step where the orbit meets an edge,
/// root-found to the nanosecond, and holds the memory constant within a step. An edge that is met
/// and left again within one step is passed over.
///
/// The two-argument acceleration_ECI() of ForceModel is the force itself, without any memory.
class ForceAlongOrbit : public ForceModel {
 public:
  using ForceModel::acceleration_ECI;

  /// At the first grid point.
  virtual ForceMemory begin(const OrbitState&, const Surroundings&) const = 0;
  /// At each later grid point, for the step that begins there.
  virtual ForceMemory next(const ForceMemory& memory, const OrbitState&,
                           const Surroundings&) const {
    return memory;
  }
  /// When an impulse has just changed the orbit.
  virtual ForceMemory after_impulse(const ForceMemory& memory, const OrbitState&,
                                    const Surroundings&) const {
    return memory;
  }
  virtual Vec3 acceleration_ECI(const OrbitState&, const Surroundings&,
                                const ForceMemory&) const = 0;
  /// Whether margin() is ever to be asked. The same for the whole run.
  virtual bool has_edges() const { return false; }
  /// Positive inside the memory's region, zero on its edge, negative beyond; continuous along an
  /// orbit.
  virtual double margin(const OrbitState&, const Surroundings&, const ForceMemory&) const {
    return std::numeric_limits<double>::infinity();
  }
  /// The memory beyond the edge, at a state on it.
  virtual ForceMemory crossed(const ForceMemory& memory, const OrbitState&,
                              const Surroundings&) const {
    return memory;
  }
};

}  // namespace orrery
