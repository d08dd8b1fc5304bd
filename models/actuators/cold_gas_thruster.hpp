/// A cold gas thruster of six nozzles whose burns take their time: valves, quanta, errors, a tank.
#pragma once

#include <orrery/models/actuators/thruster.hpp>

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace orrery {

/// `cold_gas_6` of the reference mission [C].
struct ColdGasThrusterOptions {
  double force_N = 0.025;  // of each nozzle, above 0
  double isp_s = 45;       // above 0
  Duration on_time_quantum = 1ms;
  Duration minimum_on_time = 10ms;      // a multiple of the quantum: 0.25 mN s
  double maximum_impulse_Ns = 0.033;    // of a firing, as a vector: 3 mm/s at 11 kg
  Duration minimum_interval = 120s;     // from the end of a firing to the begin of another
  Duration minimum_lead = 20s;          // a command must be this much ahead
  Duration maximum_lead = weeks(1);     // and no more than this
  Duration opening_delay = 10ms;        // valve command to thrust
  Duration closing_delay = 7ms;         // valve command to no thrust; at most minimum_on_time
  double scale_sigma = 0.02;            // of a nozzle's force, constant per run
  double misalignment_sigma_deg = 0.5;  // of a nozzle about each transverse axis, constant per run
  double shot_sigma = 0.01;             // of a nozzle's force, from firing to firing
  double gain = 1;                      // of all nozzles' forces on top, 0.01 to 10
  double misalignment_deg = 0;          // of each about its first transverse axis on top, -30 to 30
  double propellant_kg = 0.5;           // part of the spacecraft's mass
  /// Mass with which flight commands are converted, at the start; empty: the true one then.
  std::optional<double> commanded_mass_kg = {};
};

/// Six nozzles through the centre of mass: nozzle 0 pushes the spacecraft along +X, 1 -X, 2 +Y,
/// 3 -Y, 4 +Z, 5 -Z (body axes). Their forces are body-fixed and follow the attitude during a burn.
///
/// Commands    `thruster` of orrery_messages.h, {mid-burn epoch on the onboard clock, delta-v in
///             EME2000}, becomes on-times just before the burn, with the commanded mass and the
///             attitude that the body then has at mid-burn: per axis |m dv| / force, to the nearest
///             quantum; below half the minimum none, from there to the minimum the minimum. Each
///             on-time has the epoch in its middle. `thruster_on_time`, {begin of thrust, nozzle,
///             duration}: one nozzle as it is; those that overlap in time are one firing.
/// Edges       On-times are those of thrust: the valve is told to open `opening_delay` before it
///             begins, and to close `closing_delay` before it ends, each to the nanosecond.
/// Truth       Force and flow are nominal * gain (1 + scale error) (1 + shot error), directions
/// tilted
///             by the misalignment. Flow = force / (g0 Isp). When the tank is empty, thrust ends
///             to the nanosecond and never comes back; commands are still accepted and valves move.
/// Rejected    A wrong length or nozzle, a number that is not finite, an impulse above the maximum
///             or below half the minimum, a lead out of range, less than the interval to another
///             firing; at the burn: no nozzle that reaches its minimum, a clock that has stepped
///             over the burn.
/// Telemetry   commanded_on_times_s() alone is for flight software; burn_log, shot_log, mass and
///             channels are truth.
/// Faults      "lost": the firing does nothing (asked once per firing). Of all nozzles, or of one
/// as
///             "+X/stuck_open": "stuck_closed" (asked when the valve is told to open: it does not),
///             "stuck_open" (asked when it is told to close, and every 100 ms while stuck: it stays
///             open), "weak" (factor on the force, nominal 1), "misaligned" (degrees more, about
///             the first transverse axis). nth() counts the askings.
/// Channels    "dv_mps" and "propellant_kg" at the end of each firing, "+X/impulse_Ns" of each
/// shot. Power       Losing it drops what is pending; valves are closed when it returns.
class ColdGasThruster final : public Thruster {
 public:
  using Options = ColdGasThrusterOptions;
  static constexpr int kNozzles = 6;
  using OnTimes = std::array<Duration, kNozzles>;

  /// One nozzle in one firing: the four edges, and what came out.
  struct Shot {
    int nozzle = 0;
    Duration on_time{};  // commanded
    SimTime valve_opens, thrust_begins, valve_closes, thrust_ends;
    double impulse_Ns = 0;  // delivered between the edges, 0 if stuck closed, lost or empty
  };

  /// @throws std::invalid_argument  an option outside its range.
  explicit ColdGasThruster(const Options& options = {});

  void start(DeviceContext& io) override;
  void from_flight(DeviceContext& io, Bytes bytes) override;

  /// Commanded on-times per nozzle whose valve has been told to close, since power-on [s].
  const std::array<double, kNozzles>& commanded_on_times_s() const { return commanded_s_; }
  /// Mass that flight commands are converted with: falls by what was commanded.
  double commanded_mass_kg() const { return commanded_mass_kg_; }

  const std::vector<Shot>& shot_log() const { return shot_log_; }
  /// In the tank at the last edge [kg].
  double propellant_kg() const { return propellant_kg_; }

  /// "+X", "-X", ... @throws std::out_of_range  not 0 to 5.
  static std::string nozzle_name(int nozzle);
  /// The on-times of an impulse in body axes.
  static OnTimes on_times(const Vec3& impulse_B_Ns, const Options& options);

 private:
  struct Firing {
    std::int64_t begin_ns = 0, end_ns = 0;  // of the thrust, onboard clock; the widest possible
    std::optional<Vec3> dv_ECI = {};        // of a `thruster` command
    std::array<std::int64_t, kNozzles> starts_ns{};
    OnTimes on_times{};
    EventHandle preparation{};
    bool prepared = false;
    bool lost = false;
    SimTime middle{};
    std::array<Shot, kNozzles> shots{};
    int shots_open = 0;
    Vec3 impulse_B{};  // delivered by the shots that ended
  };
  struct Nozzle {
    double scale = 1;
    double tilt_rad[2] = {0, 0};  // about the transverse axes
    Thrust thrust{};              // while open, if there is gas
    bool open = false;
    bool held = false;        // stuck open
    double delivered_Ns = 0;  // since the valve was last told to open
    Vec3 delivered_B{};
  };

  void draw_errors(DeviceContext& io);
  void accept_delta_v(DeviceContext& io, Bytes message);
  void accept_on_time(DeviceContext& io, Bytes message);
  bool lead_is_good(DeviceContext& io, std::int64_t epoch_ns);
  bool interval_is_good(DeviceContext& io, const Firing& firing);
  Firing* overlapping(const Firing& firing);
  bool join(DeviceContext& io, Firing& pending, const Firing& more);
  void schedule(DeviceContext& io, Firing& firing);
  void prepare(DeviceContext& io, Firing& firing);
  void convert(DeviceContext& io, Firing& firing);
  void open_valve(DeviceContext& io, Firing& firing, int nozzle);
  void begin_thrust(DeviceContext& io, int nozzle, double shot_factor);
  void close_valve(DeviceContext& io, int nozzle, Duration on_time);
  void while_stuck(DeviceContext& io, int nozzle);
  void end_thrust(DeviceContext& io, int nozzle);
  void end_shot(DeviceContext& io, Firing& firing, int nozzle);
  void finish(DeviceContext& io, Firing& firing);
  void drop(const Firing& firing);
  void account(DeviceContext& io);
  void update_thrust(DeviceContext& io);
  double fault(DeviceContext& io, int nozzle, const char* name, double nominal) const;
  Thrust thrust_of(DeviceContext& io, int nozzle, double shot_factor) const;

  Options options_;
  std::array<Nozzle, kNozzles> nozzles_;
  std::vector<std::unique_ptr<Firing>> firings_;  // accepted and not finished
  std::optional<std::int64_t> last_end_ns_;       // of the firings that were
  std::vector<Shot> shot_log_;
  std::array<double, kNozzles> commanded_s_{};
  double commanded_mass_kg_ = 0;
  double propellant_kg_;
  double flow_kgps_ = 0;  // since edge_
  SimTime edge_;
  EventHandle empty_;
  bool drawn_ = false;
};

}  // namespace orrery
