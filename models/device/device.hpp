/// Sensors, actuators and radios. Derive from Device to add one; the ready ones do the same.
///
/// A device sees its spacecraft and the world through its DeviceContext alone, and runs only when
/// called: at power-on, by its own timers, by flight software, by a frame from the air. Flight
/// software may write anything, so from_flight() and from_air() never throw because of what the
/// bytes say: they reject, log and count.
#pragma once

#include <orrery/harness/kernel/bytes.hpp>
#include <orrery/harness/kernel/event.hpp>
#include <orrery/harness/kernel/random.hpp>
#include <orrery/harness/kernel/time.hpp>
#include <orrery/models/frames/vector.hpp>
#include <orrery/models/orbit/force_model.hpp>
#include <orrery/models/orbit/thrust.hpp>

#include <stdexcept>
#include <string>
#include <string_view>

namespace orrery {

/// A spacecraft as it truly is at one instant.
struct SpacecraftState {
  OrbitState orbit;
  Mat3 R_BI;        // f_B = R_BI * f_ECI
  Vec3 omega_BI_B;  // [rad/s]
};

/// What a device may see and do. One per device; it lives as long as the world.
class DeviceContext {
 public:
  virtual ~DeviceContext() = default;

  virtual std::string_view spacecraft() const = 0;
  /// Truth time.
  virtual SimTime now() const = 0;
  /// What the spacecraft's own clock shows [ns since the GPS epoch], and the truth time at which it
  /// will show a given value.
  virtual std::int64_t onboard_ns() const = 0;
  virtual SimTime truth_of_onboard(std::int64_t onboard_ns) const = 0;
  /// The spacecraft's state now. Looking changes nothing.
  virtual OrbitState truth() const = 0;
  virtual Surroundings surroundings() const = 0;
  /// Attitude now: f_B = R_BI * f_ECI.
  virtual Mat3 R_BI() const = 0;
  /// Angular velocity of the body relative to ECI now, in body axes [rad/s].
  virtual Vec3 omega_BI_B() const = 0;
  /// Another spacecraft now, for sensors that look at it. Looking changes nothing.
  /// @throws std::invalid_argument  there is none of that name.
  virtual SpacecraftState other(std::string_view spacecraft) const {
    throw std::invalid_argument("DeviceContext::other: no spacecraft " + std::string(spacecraft));
  }
  /// The device's own stream (seed, spacecraft, device, purpose). Keep the reference if you like.
  virtual RandomStream& random(std::string_view purpose) = 0;

  /// Runs `action` once, `delay` from now, unless cancelled or the device loses power before that.
  /// @throws std::invalid_argument  negative delay.
  virtual EventHandle after(Duration delay, Action action) = 0;
  /// Runs `action` now, then every `period`, until cancelled or the device loses power. The handle
  /// stays good for all repetitions. @throws std::invalid_argument  period <= 0.
  virtual EventHandle every(Duration period, Action action) = 0;
  virtual bool cancel(EventHandle handle) = 0;

  /// Hands bytes to the flight port to which this device is connected (dropped where there is
  /// none).
  virtual void to_flight(Bytes bytes) = 0;
  /// Sends a frame over the link to another spacecraft; its device of the same name gets it.
  virtual void transmit(std::string_view to, Bytes frame) = 0;

  /// Changes this spacecraft's velocity by dv_ECI [m/s] at this instant. @throws std::domain_error
  /// not finite.
  virtual void apply_impulse(const Vec3& dv_ECI) = 0;
  /// This device's thrust from this instant on, to the nanosecond; Thrust{} ends it. Those of
  /// several devices add up. @throws std::invalid_argument  not finite, or a negative flow.
  virtual void set_thrust(const Thrust& thrust) = 0;

  /// Adds a sample to the channel "<spacecraft>/<device>/<channel>".
  virtual void record(std::string_view channel, double value) = 0;
  /// Components in the frame that the name gives: record("error_RTN_m", error_RTN).
  virtual void record(std::string_view channel, const Vec3& value) = 0;
  /// The discrete state, such as a mode, that is in force from now on.
  virtual void record_state(std::string_view channel, std::string_view state) = 0;
  /// Something happened. A channel of events that may stay without any is declared in start(), so
  /// that a test can say that nothing happened.
  virtual void record_event(std::string_view channel, std::string_view what) = 0;
  virtual void declare_event(std::string_view channel) = 0;
  /// Whether the next two do anything; no record depends on it.
  virtual bool keeps_files() const { return false; }
  /// A file of that name in the folder of this device, beside the run's records.
  virtual void record_file(std::string_view name, Bytes content) { (void)name, (void)content; }
  /// A picture (PNG) for the film strip of this device in the report.
  virtual void record_picture(std::string_view caption, Bytes png) { (void)caption, (void)png; }
  /// A message in the run's log. The levels are those of orrery_flight.h.
  virtual void log(int level, std::string_view line) = 0;
  static constexpr int kDebug = 0, kInfo = 1, kWarning = 2, kError = 3;
  /// Value of a named fault parameter of this device; `nominal` while no fault is active.
  virtual double fault(std::string_view name, double nominal) const = 0;
  /// False: no fault of this device was ever set, and fault() gives the nominal value of every
  /// name.
  virtual bool may_be_faulty() const { return true; }
};

/// Part of a spacecraft.
class Device {
 public:
  virtual ~Device() = default;
  /// Unique on its spacecraft; by default also the flight port it is wired to.
  virtual std::string_view name() const = 0;
  /// At each power-on.
  virtual void start(DeviceContext& io) = 0;
  /// A fault of that name was set, which fault() may give from now on: for names that carry
  /// numbers, so that the name alone says what the fault does.
  /// @throws std::invalid_argument  numbers missing or out of range.
  virtual void fault_set(std::string_view name) { (void)name; }
  /// Bytes that flight software wrote to the connected port.
  virtual void from_flight(DeviceContext& io, Bytes bytes) { (void)io, (void)bytes; }
  /// A frame from another spacecraft's device of the same name.
  virtual void from_air(DeviceContext& io, std::string_view sender, Bytes frame) {
    (void)io, (void)sender, (void)frame;
  }
};

}  // namespace orrery
