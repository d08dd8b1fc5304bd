/// Learns what the nozzles of the own thruster do: the relative velocity that was predicted with a
/// burn, against what navigation finds a minute and a half later.
///
/// Method      What is found rests on the prediction too; what measurements alone say of the burn
/// is
///             further off by before / (before - after), the variances of the velocity, and as
///             uncertain as their information makes it. One burn at a time: the thruster's are
///             further apart.
/// Frames      Burns and velocities in ECI, nozzles in body axes; SI.
#pragma once

#include "formation_gnc/control/impulse.hpp"
#include "formation_gnc/navigation/navigation.hpp"

namespace formation_gnc {

class BurnObserver {
 public:
  explicit BurnObserver(const ThrusterErrors& errors) : scale_(errors) {}

  const ThrusterScale& scale() const { return scale_; }
  /// What comes of a command, as filters are told of it, with what is not known of it.
  Maneuver expected(std::int64_t t_ns, const flight_support::Mat3& R_BI,
                    const flight_support::Vec3& commanded_B) const;
  /// @param burn  That `navigation` has heard of.
  void watch(const Maneuver& burn, const flight_support::Mat3& R_BI,
             const flight_support::Vec3& commanded_B, const Navigation& navigation);
  /// To be called now and then; does something once after each watched burn.
  void learn(std::int64_t now_ns, const Navigation& navigation);

 private:
  struct Watched {
    bool waiting = false;
    std::int64_t look_ns = 0;
    flight_support::Vec3 commanded_B, expected_B;
    flight_support::Vec3 predicted_v;           // of other less self, ECI
    flight_support::Mat3 R_BI;                  // in the middle of the burn
    flight_support::Vec3 predicted_variance_B;  // of that velocity, burn included
    flight_support::Vec3 of_burn_B;             // variance of its execution, as the filter has it
  };

  ThrusterScale scale_;
  Watched watched_;
};

}  // namespace formation_gnc
