/// The attitude that the bus said last, and what it is at other instants by a constant rate.
#pragma once

#include <cstdint>

#include "formation_gnc/navigation/signal_geometry.hpp"

namespace formation_gnc {

class BusAttitude {
 public:
  bool known() const { return t_ns_ != 0; }
  /// @param t_ns  GPS, not 0. @param omega_B  [rad/s] of the body against ECI.
  void take(std::int64_t t_ns, const Quaternion& q_BI, const flight_support::Vec3& omega_B);
  /// q_BI: components from ECI to body.
  Quaternion at(std::int64_t t_ns) const;

 private:
  std::int64_t t_ns_ = 0;
  Quaternion q_BI_;
  flight_support::Vec3 omega_B_;
};

}  // namespace formation_gnc
