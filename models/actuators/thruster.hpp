/// What the ready thrusters have in common: the name, the record of burns, rejected commands.
#pragma once

#include <orrery/models/device/device.hpp>

#include <string>
#include <vector>

namespace orrery {

/// Device "thruster". Commands come from flight software, so what cannot be done is rejected,
/// counted and logged as a warning, never thrown.
class Thruster : public Device {
 public:
  struct Burn {
    SimTime t;             // middle of the burn
    Vec3 dv_ECI;           // commanded [m/s]
    bool executed = true;  // false: nothing came out, e.g. lost
  };

  std::string_view name() const final { return "thruster"; }

  /// Burns whose time has come, lost ones included.
  int burns() const { return static_cast<int>(burn_log_.size()); }
  const std::vector<Burn>& burn_log() const { return burn_log_; }
  /// Commands not accepted.
  int rejected() const { return rejected_; }

 protected:
  void reject(DeviceContext& io, const std::string& why);
  void log_burn(const Burn& burn) { burn_log_.push_back(burn); }

 private:
  std::vector<Burn> burn_log_;
  int rejected_ = 0;
};

}  // namespace orrery
