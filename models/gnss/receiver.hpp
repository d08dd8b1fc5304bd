/// A GNSS receiver: the antenna's true position and velocity plus noise, as NovAtel BESTXYZ logs.
#pragma once

#include <orrery/models/device/device.hpp>

namespace orrery {

struct GnssReceiverOptions {
  Duration period = 10s;             // whole milliseconds, 100 ms to 60 s
  double sigma_position_m = 1.5;     // per axis, 0 to 10 km; Table 2 of Bell and D'Amico
  double sigma_velocity_mps = 0.03;  // per axis, 0 to 1 km/s; same table
  Vec3 lever_arm_B{0.05, 0, 0.10};   // antenna relative to the centre of mass, at most 100 m
};

/// Device "gnss". At each epoch one BESTXYZ frame (novatel.hpp) goes to flight software, at the
/// instant it speaks of. Epochs are the integer multiples of the period in GPS time, so receivers
/// of all spacecraft measure together and a restart returns to the same grid.
///
/// Method  r = R_EI (r_ECI + R_BI^T l_B), v = R_EI v_ECI - omega_EI x r, both in ECEF, with white
///         noise from the streams "position_noise" and "velocity_noise". The motion of the antenna
///         about the centre of mass is left out: 0.12 mm/s with 0.11 m at the rate of the orbit.
/// Fault   "outage": while it is not 0, nothing is sent. Noise is drawn all the same, so that after
///         the outage it is what it would have been without.
class GnssReceiver final : public Device {
 public:
  using Options = GnssReceiverOptions;

  /// @throws std::invalid_argument  an option outside its range.
  explicit GnssReceiver(const Options& options = {});

  std::string_view name() const override { return "gnss"; }
  void start(DeviceContext& io) override;

 private:
  void measure(DeviceContext& io);

  Options options_;
  ByteBuffer frame_;  // kept, so that a frame costs no allocation
};

}  // namespace orrery
