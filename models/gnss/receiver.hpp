/// A GNSS receiver: what it tracks, its clock, its solution, and the NovAtel logs of all that.
#pragma once

#include <orrery/models/device/device.hpp>
#include <orrery/models/gnss/antenna.hpp>
#include <orrery/models/gnss/constellation.hpp>
#include <orrery/models/gnss/log_command.hpp>
#include <orrery/models/gnss/log_schedule.hpp>
#include <orrery/models/gnss/receiver_clock.hpp>
#include <orrery/models/gnss/tracking.hpp>

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace orrery {

struct GnssReceiverOptions {
  Duration period = 10s;                   // of the epochs: whole milliseconds, 100 ms to 60 s
  double sigma_position_m = 1.5;           // per axis, 0 to 10 km; Table 2 of Bell and D'Amico
  double sigma_velocity_mps = 0.03;        // per axis, 0 to 1 km/s; same table
  Vec3 lever_arm_B{0.05, 0, 0.10};         // antenna relative to the centre of mass, at most 100 m
  Vec3 boresight_B{0, 0, 1};               // any length
  GnssStart start = GnssStart::kTracking;  // at the first power-on; later ones are cold
  /// Logs from power-on, as LOG commands would request them. Empty: BESTXYZ at every epoch.
  std::vector<novatel::LogRequest> logs = {};
  GnssTrackingOptions tracking = {};
  ReceiverClockOptions clock = {};
  AntennaPattern antenna = AntennaPattern::patch();
};

/// A part of the sky above the plane normal to r, by azimuth clockwise from north.
struct SkySector {
  double azimuth_from_deg = 0, azimuth_to_deg = 360;  // to > from, at most 360 more
  double elevation_from_deg = -90, elevation_to_deg = 90;
};

/// Device "gnss". Epochs are the integer multiples of the period in GPS time, so receivers of all
/// spacecraft measure together and a restart returns to the same grid. What the logs of an epoch
/// say goes to flight software in one piece, at the instant it speaks of.
///
/// Measurements  tracking.hpp, over the constellation that all receivers of a world share. The
///               antenna is at r + R_BI^T l_B and moves with the body's turning.
/// Solution      The antenna's true position and velocity plus white noise from the streams
///               "position_noise" and "velocity_noise", drawn at every epoch. It needs four
///               satellites in lock, healthy, whose ephemerides are known; without, BESTXYZ says
///               INSUFFICIENT_OBS.
/// Ephemerides   A satellite's is known when subframes 1 to 3 of a frame have come (30 s, from the
///               first whole frame in lock or of the new issue), and good until 2 h after its toe.
/// Time          FINESTEERING while |bias| < 100 ns, else COARSE; UNKNOWN from a cold start to the
///               first solution.
/// Faults        "outage": hears and says nothing; "outage G07": does not hear one satellite;
///               sector_fault(): nothing from that part of the sky. "slip G07": that many
///               cycles (halves allowed) are added to the phase at each epoch at which it is not 0.
///               "restart": 1 warm, 2 cold. "clock_jump_s": added to the bias at each epoch.
///               "freeze": the solution repeats itself. "noise": it is so many times as noisy as
///               it says. bias_fault(): the solution is off by a
///               vector in ECEF. "week_offset": weeks added to every week in the headers.
///               "withhold", "withhold G07": no ephemeris is received. Of each message: "corrupt":
///               that many bits are turned over, "cut": that many bytes are missing at its end.
class GnssReceiver final : public Device {
 public:
  using Options = GnssReceiverOptions;

  /// @param gps  Shared with other receivers. Null: its own, the carried almanac unperturbed.
  /// @throws std::invalid_argument  an option outside its range.
  explicit GnssReceiver(const Options& options = {}, std::shared_ptr<GpsConstellation> gps = {});

  std::string_view name() const override { return "gnss"; }
  void start(DeviceContext& io) override;
  /// LOG, UNLOG and UNLOGALL (log_command.hpp); answers go back at once.
  void from_flight(DeviceContext& io, Bytes bytes) override;

  /// Takes up faults whose names carry numbers; std::invalid_argument names what is wrong with
  /// them.
  void fault_set(std::string_view name) override;
  /// The names of such faults: "sector 90 270 -90 90" [deg], "bias 0 250 0" [m].
  static std::string sector_fault(const SkySector& sector);
  static std::string bias_fault(const Vec3& by_ECEF);
  /// The list of logs, to be changed between epochs as LOG and UNLOG would.
  novatel::LogSchedule& logs() { return logs_; }
  Duration period() const { return options_.period; }

  /// For tests and reports, of the last epoch.
  const GnssTracker* tracker() const { return tracker_ ? &*tracker_ : nullptr; }
  const ReceiverClock& clock() const { return clock_; }
  /// Satellites whose ephemeris is known, bit prn - 1.
  std::uint32_t ephemerides_known() const;

 private:
  struct Ephemeris {
    int iodc = -1;  // of the one that is known
    SimTime good_until;
    bool raw_changed = false, gps_changed = false;  // since RAWEPHEM, GPSEPHEM was last sent
    BroadcastEphemeris data;
  };
  struct Solution {
    bool computed = false;
    int satellites = 0;
    Vec3 r_ECEF, v_ECEF;
  };
  struct SectorFault {
    std::string name;
    SkySector sector;
  };
  struct BiasFault {
    std::string name;
    Vec3 by_ECEF;
  };
  /// Names of the faults of one satellite, made once.
  struct FaultNames {
    std::string outage, slip, withhold;
  };

  void power_on(DeviceContext& io);
  void measure(DeviceContext& io);
  void restart(GnssStart how);
  AntennaPlace antenna_place(DeviceContext& io, const Surroundings& around) const;
  GnssTracker::Faults tracking_faults(DeviceContext& io, const AntennaPlace& antenna,
                                      const GpsSnapshot& gps) const;
  bool in_blocked_sector(DeviceContext& io, const Vec3& r_ECEF, const Vec3& satellite_ECEF) const;
  void receive_ephemerides(DeviceContext& io);
  void learn(const BroadcastEphemeris& sent);
  void solve(DeviceContext& io, const AntennaPlace& antenna);
  void send(DeviceContext& io);
  void append(const novatel::DueLog& log, const novatel::Header& header);
  void append_ephemerides(const novatel::DueLog& log, const novatel::Header& header);
  void append_almanac(const novatel::Header& header);
  void damage(DeviceContext& io, std::size_t from);
  novatel::Header header(DeviceContext& io) const;

  Options options_;
  std::shared_ptr<GpsConstellation> gps_;
  Mat3 R_AB_;
  ReceiverClock clock_;
  std::optional<GnssTracker> tracker_;
  novatel::LogSchedule logs_;
  std::optional<novatel::LogCommandReader> commands_;  // of this power-on
  std::vector<SectorFault> sectors_;
  std::vector<BiasFault> biases_;
  std::array<FaultNames, gps::kSatellites> fault_names_;
  std::array<Ephemeris, gps::kSatellites> ephemerides_;
  RandomStream *position_noise_ = nullptr, *velocity_noise_ = nullptr, *clock_noise_ = nullptr;
  bool powered_before_ = false, first_epoch_ = true, time_known_ = true;
  SimTime last_epoch_;
  Solution solution_;
  ByteBuffer frames_, answers_;  // kept, so that an epoch costs no allocation
};

}  // namespace orrery
