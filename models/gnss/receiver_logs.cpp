// What each log of the receiver says.
#include <orrery/models/frames/geodetic.hpp>
#include <orrery/models/frames/time_scales.hpp>
#include <orrery/models/gnss/gps_constants.hpp>
#include <orrery/models/gnss/lnav.hpp>
#include <orrery/models/gnss/receiver.hpp>

#include <chrono>
#include <cmath>
#include <numbers>

namespace orrery {
namespace {

using novatel::SolutionStatus;
using novatel::SolutionType;

constexpr std::uint8_t kGpsL1 = 0x01;
constexpr double kDegrees = 180 / std::numbers::pi;
constexpr Duration kFrame = 30s;

novatel::Time time_message(SimTime t, double offset_s, double sigma_s, bool steered) {
  constexpr int kTaiMinusGps = 19;
  const int gps_minus_utc = leap_seconds(t) - kTaiMinusGps;
  const SimTime utc = t - gps_minus_utc * 1s;
  // 1980-01-06 is 3657 days after the epoch of the civil calendar.
  const auto since_1970 = utc.time_since_epoch() + days(3657);
  const auto day = std::chrono::floor<std::chrono::days>(since_1970);
  const std::chrono::year_month_day date{std::chrono::sys_days(day)};
  const auto ms = std::chrono::duration_cast<std::chrono::milliseconds>(since_1970 - day).count();
  novatel::Time m;
  m.clock_status = steered ? 0 : 1;
  m.offset_s = offset_s;
  m.offset_sigma_s = sigma_s;
  m.utc_offset_s = -gps_minus_utc;
  m.year = static_cast<std::uint32_t>(static_cast<int>(date.year()));
  m.month = static_cast<std::uint8_t>(static_cast<unsigned>(date.month()));
  m.day = static_cast<std::uint8_t>(static_cast<unsigned>(date.day()));
  m.hour = static_cast<std::uint8_t>(ms / 3'600'000);
  m.minute = static_cast<std::uint8_t>(ms / 60'000 % 60);
  m.millisecond = static_cast<std::uint32_t>(ms % 60'000);
  return m;
}

novatel::IonUtc ion_utc_message(SimTime t) {
  constexpr int kTaiMinusGps = 19;
  const int gps_minus_utc = leap_seconds(t) - kTaiMinusGps;
  novatel::IonUtc m;  // the simulated ionosphere is not Klobuchar's: all coefficients 0
  m.utc_reference_week = static_cast<std::uint32_t>(gps::week_of(t));
  m.utc_reference_s = 0;
  m.leap_week = 1929;  // 2016-12-31, the last leap second so far: the end of day 7 of that week
  m.leap_day = 7;
  m.leap_seconds = m.leap_seconds_future = gps_minus_utc;
  return m;
}

}  // namespace

void GnssReceiver::append(const novatel::DueLog& log, const novatel::Header& head) {
  const auto tracked = static_cast<std::uint8_t>(tracker_->channels().size());
  const auto used = static_cast<std::uint8_t>(solution_.satellites);
  const SolutionStatus status =
      solution_.computed ? SolutionStatus::kComputed : SolutionStatus::kInsufficientObservations;
  switch (log.message_id) {
    case novatel::kBestXyzId: {
      novatel::BestXyz m;
      m.position_status = m.velocity_status = status;
      m.position_type = solution_.computed ? SolutionType::kSingle : SolutionType::kNone;
      m.velocity_type = solution_.computed ? SolutionType::kDopplerVelocity : SolutionType::kNone;
      if (solution_.computed) {
        const double r = options_.sigma_position_m, v = options_.sigma_velocity_mps;
        m.r_ECEF = solution_.r_ECEF, m.v_ECEF = solution_.v_ECEF;
        m.sigma_r_ECEF = {r, r, r}, m.sigma_v_ECEF = {v, v, v};
      }
      m.satellites_tracked = tracked;
      m.satellites_used = m.satellites_used_L1 = used;
      m.gps_glonass_mask = kGpsL1;
      novatel::append(head, m, frames_);
      return;
    }
    case novatel::kBestPosId: {
      novatel::BestPos m;
      m.status = status;
      m.type = solution_.computed ? SolutionType::kSingle : SolutionType::kNone;
      if (solution_.computed) {
        const Geodetic place = to_geodetic(solution_.r_ECEF);
        m.latitude_deg = place.latitude_rad * kDegrees;
        m.longitude_deg = place.longitude_rad * kDegrees;
        m.height_msl_m = place.height_m;  // no geoid is carried: undulation 0
        m.sigma_latitude_m = m.sigma_longitude_m = m.sigma_height_m =
            static_cast<float>(options_.sigma_position_m);
      }
      m.satellites_tracked = tracked;
      m.satellites_used = m.satellites_used_L1 = used;
      m.gps_glonass_mask = kGpsL1;
      novatel::append(head, m, frames_);
      return;
    }
    case novatel::kRangeId:
      novatel::append_range(head, tracker_->observations(), frames_);
      return;
    case novatel::kRangeCmpId:
      novatel::append_rangecmp(head, tracker_->observations(), frames_);
      return;
    case novatel::kTimeId: {
      const bool steered = head.time_status == novatel::TimeStatus::kFineSteering;
      novatel::append(head,
                      time_message(head.t, clock_.bias_s(), options_.clock.sigma_bias_s, steered),
                      frames_);
      return;
    }
    case novatel::kRawEphemId:
    case novatel::kGpsEphemId:
      append_ephemerides(log, head);
      return;
    case novatel::kIonUtcId:
      novatel::append(head, ion_utc_message(head.t), frames_);
      return;
    case novatel::kAlmanacId:
      append_almanac(head);
      return;
    case novatel::kVersionId: {
      const novatel::VersionComponent card{.model = "ORRERY",
                                           .serial_number = "SIM00000001",
                                           .hardware = "OEMSIM",
                                           .software = "1.0",
                                           .boot = "1.0",
                                           .date = "2025/Jan/01",
                                           .time = "00:00:00"};
      novatel::append_version(head, std::span(&card, 1), frames_);
      return;
    }
    default:
      return;  // a log that this receiver does not know says nothing
  }
}

void GnssReceiver::append_ephemerides(const novatel::DueLog& log, const novatel::Header& head) {
  // The frame in which the subframes came last.
  const auto second = static_cast<std::int64_t>(gps::second_of_week(head.t));
  const std::int64_t frame_s = second - second % (kFrame / 1s);
  const bool raw = log.message_id == novatel::kRawEphemId;
  for (Ephemeris& e : ephemerides_) {
    bool& changed = raw ? e.raw_changed : e.gps_changed;
    if (e.iodc < 0 || (log.only_changed && !changed)) continue;
    changed = false;
    if (raw) {
      novatel::append(head,
                      novatel::RawEphem{.prn = static_cast<std::uint32_t>(e.data.prn),
                                        .reference_week = static_cast<std::uint32_t>(e.data.week),
                                        .reference_s = static_cast<std::uint32_t>(e.data.toe_s),
                                        .subframes = lnav::pack(e.data, static_cast<int>(frame_s))},
                      frames_);
    } else {
      novatel::append(
          head, novatel::to_gpsephem(e.data, static_cast<double>(frame_s), gps::week_of(head.t)),
          frames_);
    }
  }
}

void GnssReceiver::append_almanac(const novatel::Header& head) {
  std::array<novatel::AlmanacEntry, gps::kSatellites> entries;
  std::size_t count = 0;
  for (const GpsAlmanacEntry& a : gps_->almanac(head.t)) {
    novatel::AlmanacEntry& m = entries[count++];
    const double axis_m = a.sqrt_a_sqrtm * a.sqrt_a_sqrtm;
    m.prn = static_cast<std::uint32_t>(a.prn);
    m.week = static_cast<std::uint32_t>(a.week);
    m.toa_s = a.toa_s;
    m.eccentricity = a.eccentricity;
    m.raan_rate_radps = a.raan_rate_radps;
    m.raan0_rad = a.raan0_rad;
    m.argument_of_perigee_rad = a.argument_of_perigee_rad;
    m.mean_anomaly_rad = a.mean_anomaly_rad;
    m.af0_s = a.af0_s;
    m.af1_sps = a.af1_sps;
    m.corrected_mean_motion_radps = std::sqrt(gps::kMu_m3ps2 / axis_m) / axis_m;
    m.semi_major_axis_m = axis_m;
    m.delta_inclination_rad = a.inclination_rad - 0.3 * kGpsPi;
    m.health_6bit = static_cast<std::uint32_t>(a.health & 63);
    m.health_8bit = static_cast<std::uint32_t>(a.health);
  }
  novatel::append_almanac(head, std::span(entries.data(), count), frames_);
}

}  // namespace orrery
