/// What an atmosphere is to a drag force. Derive from AtmosphereModel to fly through another one.
#pragma once

#include <orrery/harness/kernel/time.hpp>
#include <orrery/models/frames/vector.hpp>

#include <optional>

namespace orrery {

/// Density of the air. Pure: same arguments, same bits, called any number of times at any instants
/// and from several threads.
class AtmosphereModel {
 public:
  virtual ~AtmosphereModel() = default;
  /// At `r_ECEF` [m].
  /// @throws std::domain_error, std::out_of_range  a place or an instant that the model does not
  /// cover.
  virtual double density_kgpm3(SimTime t, const Vec3& r_ECEF) const = 0;
  /// The first instant after `t` at which the density jumps everywhere, as where a table of solar
  /// flux steps; an interpolant or an integrator starts anew there.
  virtual std::optional<SimTime> next_discontinuity(SimTime t) const {
    (void)t;
    return {};
  }
};

}  // namespace orrery
