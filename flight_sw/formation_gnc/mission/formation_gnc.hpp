/// The package as a class: inputs are member functions, outputs a virtual interface (Bell &
/// D'Amico, figure 9). Usable as it is, without the flight ABI; flight_library.cpp puts it behind
/// that.
///
///     struct Bus : formation_gnc::Outputs { ... };
///     Bus bus;
///     formation_gnc::FormationGnc gnc(bus, configuration, {.now_ns = t, .boot_count = 0});
///     gnc.in_gnss(t, bytes, count);
///     gnc.in_tick(t);
///
/// Times       now_ns is the onboard clock; messages carry GPS ns, but manoeuvres and ticks the
///             onboard clock.
/// Memory      All of it with this object, but what the planner and its cone program take while
///             they run. No exceptions of its own, no globals, no threads, no clock.
#pragma once

#include <cstdint>

#include "formation_gnc/formation_gnc_messages.h"
#include "formation_gnc/mission/burn_observer.hpp"
#include "formation_gnc/mission/bus_attitude.hpp"
#include "formation_gnc/mission/configuration.hpp"
#include "formation_gnc/mission/crosslink_layer.hpp"
#include "formation_gnc/mission/onboard_clock.hpp"
#include "formation_gnc/navigation/field_gravity.hpp"
#include "formation_gnc/navigation/gnss_decoder.hpp"
#include "formation_gnc/navigation/navigation.hpp"

namespace formation_gnc {

enum class LogLevel : std::int32_t { kDebug = 0, kInfo = 1, kWarning = 2, kError = 3 };

/// The deputy's state relative to the chief, as the `estimate` port says it.
struct RelativeOutput {
  std::int64_t t_ns = 0;
  double r_DC_RTN[3] = {}, v_DC_RTN[3] = {};
  double sigma_r_m[3] = {}, sigma_v_mps[3] = {};
};

class Outputs {
 public:
  virtual ~Outputs() = default;
  virtual void out_crosslink(const unsigned char* packet, std::uint32_t bytes) = 0;
  /// @return false: the thruster did not take it.
  virtual bool out_maneuver(std::int64_t mid_burn_onboard_ns, const double dv_ECI[3]) = 0;
  virtual void out_observation(std::int64_t begin_ns, std::int64_t end_ns) = 0;
  virtual void out_mode(std::int64_t t_ns, std::uint32_t mode) = 0;
  virtual void out_estimate(const RelativeOutput& estimate) = 0;
  virtual void out_telemetry(const unsigned char* packet, std::uint32_t bytes) = 0;
  /// A command for the receiver, e.g. "LOG RANGEB ONTIME 10\r\n".
  virtual void out_gnss(const char* command) = 0;
  /// Replaces the one before.
  virtual void request_tick(std::int64_t onboard_ns) = 0;
  virtual void log(LogLevel level, const char* line) = 0;
  /// @return bytes, or below 0: nothing there.
  virtual std::int32_t load(std::uint32_t slot, unsigned char* to, std::uint32_t capacity) = 0;
  virtual void store(std::uint32_t slot, const unsigned char* from, std::uint32_t bytes) = 0;
};

struct Boot {
  std::int64_t now_ns = 0;  ///< onboard
  std::uint32_t boot_count = 0;
};

class FormationGnc {
 public:
  /// @param outputs  Outlives this object; is called from the constructor on.
  FormationGnc(Outputs& outputs, const Configuration& configuration, const Boot& boot);
  FormationGnc(const FormationGnc&) = delete;
  FormationGnc& operator=(const FormationGnc&) = delete;

  // Each false if the input was not usable; nothing else happens then.
  bool in_gnss(std::int64_t now_ns, const unsigned char* bytes, std::uint32_t count);
  bool in_bus(std::int64_t now_ns, const unsigned char* message, std::uint32_t bytes);
  bool in_crosslink(std::int64_t now_ns, const unsigned char* packet, std::uint32_t bytes);
  bool in_command(std::int64_t now_ns, const unsigned char* message, std::uint32_t bytes);
  void in_tick(std::int64_t now_ns);

  Mode mode() const { return mission_.mode(); }
  const Navigation& navigation() const { return navigation_; }
  const MissionManager& mission() const { return mission_; }

 private:
  /// Innovations since boot, of epochs processed in time; replays do not count again.
  struct Innovations {
    std::uint32_t degrees = 0, rejected = 0;
    double chi2 = 0.0;

    void add(const UpdateReport& report) {
      degrees += static_cast<std::uint32_t>(report.degrees);
      rejected += static_cast<std::uint32_t>(report.rejected);
      chi2 += report.chi2;
    }
    formation_gnc_innovations telemetry() const { return {degrees, rejected, chi2}; }
  };

  bool is_deputy() const { return configuration_.role == Role::kDeputy; }
  bool reject() {
    ++rejected_;
    return false;
  }
  void ask_receiver(std::int64_t now_GPS_ns);
  void handle_epoch(const GnssEpoch& epoch, std::int64_t now_ns);
  void send_measurement(const GnssEpoch& epoch, const Quaternion& q_BI);
  bool take_payload(const Payload& payload, std::int64_t now_ns);
  bool take_command(const unsigned char* message, std::uint32_t bytes);
  bool take_maneuver(const Payload& payload);

  void work_blindly(std::int64_t now_onboard_ns);
  void work(std::int64_t now_onboard_ns, const FormationEstimate* estimate);
  void settle(std::int64_t now_ns);
  void execute(const TransitionProtocol::Execution& execution, std::int64_t now_ns);
  void save();
  void watch_separation(const FormationEstimate& estimate);
  void place_observation(const FormationEstimate& estimate);
  void maneuver(const FormationEstimate& estimate);
  void command_burn(const Impulse& wanted);
  void send_due(std::int64_t now_ns);
  void schedule(std::int64_t now_ns, std::int64_t now_onboard_ns);
  Situation situation(const FormationEstimate& estimate) const;
  FormationEstimate from_chief(const FormationEstimate& estimate) const;
  void send_estimate(const FormationEstimate& estimate);
  void send_telemetry(std::int64_t now_ns, const FormationEstimate& estimate);
  void fill_integers(formation_gnc_telemetry* t) const;
  void say(LogLevel level, const char* format, ...);

  Outputs& out_;
  Configuration configuration_;
  std::uint32_t boot_count_;
  OnboardClock clock_;
  GnssDecoder decoder_;
  Navigation navigation_;
  FieldGravity gravity_;
  SeparationMonitor separation_;
  CrosslinkLayer crosslink_;
  MissionManager mission_;
  ManeuverManager maneuvers_;
  BurnObserver burn_observer_;
  BusAttitude attitude_;
  Innovations graphic_, sdcp_;
  SeparationForecast forecast_;

  std::int64_t last_epoch_ns_ = 0;
  std::int64_t last_range_ns_ = 0;  // GPS; of the receiver's epochs with observations
  std::int64_t asked_ns_ = 0;
  std::int64_t last_crosslink_slot_ = -1, last_telemetry_slot_ = -1, last_forecast_slot_ = -1;
  std::int64_t partner_heard_ns_ = 0;
  int unsafe_forecasts_ = 0;
  bool navigation_valid_ = false;
  double delta_v_mps_ = 0.0;
  std::uint32_t rejected_ = 0, burns_ = 0, observations_ = 0, skipped_ = 0;
  std::uint32_t measurements_sent_ = 0, measurements_heard_ = 0;
};

}  // namespace formation_gnc
