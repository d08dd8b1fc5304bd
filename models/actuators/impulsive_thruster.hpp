/// A thruster whose burns are impulses: each changes the velocity at once, in the middle of the
/// burn.
#pragma once

#include <orrery/models/actuators/thruster.hpp>

namespace orrery {

struct ImpulsiveThrusterOptions {
  Duration minimum_lead = 20s;      // a command must be this much ahead of its burn; at least 0
  Duration maximum_lead = 24h * 7;  // and no more than this, at least minimum_lead
  double maximum_dv_mps = 1.0;      // of one burn, above 0
  double gain = 1;                  // delivered over commanded, 0 to 10
  /// Of what is delivered: turned by this much about the body axis u x Z (u x X where u is within
  /// 6 deg of Z), u being the commanded direction in body axes. -90 to 90.
  double misalignment_deg = 0;
};

/// Device "thruster". Takes the message `thruster` of orrery_messages.h: mid-burn epoch on the
/// onboard clock, delta-v in EME2000.
///
/// Burns     The epoch becomes truth with the clock as it is when the command arrives. Any number
///           may be pending. Losing power drops them.
/// Rejected  and logged as a warning, never thrown, since flight software wrote it: a wrong length,
///           a component that is not finite, a delta-v above the maximum, a lead out of range.
/// Fault     "lost": if it is not 0 at the burn, nothing happens, but the burn counts as due.
/// Errors    What is delivered is gain times the command, turned by the misalignment.
/// Channel   "dv_mps": magnitude delivered at each burn, 0 if lost.
class ImpulsiveThruster final : public Thruster {
 public:
  using Options = ImpulsiveThrusterOptions;

  /// @throws std::invalid_argument  an option outside its range.
  explicit ImpulsiveThruster(const Options& options = {});

  void start(DeviceContext& io) override { (void)io; }
  void from_flight(DeviceContext& io, Bytes bytes) override;

  /// Sum of |dv| delivered over the burns that were executed.
  double delta_v_mps() const { return delta_v_mps_; }

 private:
  void burn(DeviceContext& io, const Vec3& dv_ECI);
  Vec3 delivered_ECI(DeviceContext& io, const Vec3& dv_ECI) const;

  Options options_;
  double delta_v_mps_ = 0;
};

}  // namespace orrery
