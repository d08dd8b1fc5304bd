/// What the spacecraft bus tells flight software: attitude, clock, commanded on-times.
#pragma once

#include <orrery/models/device/device.hpp>

#include <array>
#include <functional>

namespace orrery {

struct BusOptions {
  Duration period = 1s;               // above 0
  double knowledge_sigma_deg = 0.01;  // of the attitude, 1 sigma about each body axis [C]; 0 to 10
};

/// Device "bus". Sends the message `bus` of orrery_messages.h at power-on and every `period`: the
/// time on the onboard clock, q_BI with an error of knowledge drawn afresh for each message (stream
/// "knowledge"), the angular velocity without error, and the on-times that were commanded. Never
/// what came out of a nozzle.
class Bus final : public Device {
 public:
  using Options = BusOptions;
  /// Commanded on-times per nozzle since boot [s].
  using OnTimes = std::function<std::array<double, 6>()>;

  /// @param on_times  Empty: zeros. @throws std::invalid_argument  an option outside its range.
  explicit Bus(const Options& options = {}, OnTimes on_times = {});

  std::string_view name() const override { return "bus"; }
  void start(DeviceContext& io) override;

 private:
  void report(DeviceContext& io);

  Options options_;
  OnTimes on_times_;
};

}  // namespace orrery
