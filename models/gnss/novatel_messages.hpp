/// The logs of a NovAtel OEM receiver beyond BESTXYZ: measurements, ephemerides, time, almanac.
///
/// Layout      OEM7 Commands and Logs Reference Manual (NovAtel OM-20000169); little-endian, packed
/// Angles      radians unless the name says otherwise, as in the logs
/// Memory      append() puts header, body and CRC at the end of `out`; it allocates only if `out`
/// has
///             to grow, so a buffer that is kept and cleared costs nothing.
/// Errors      std::invalid_argument: header.t before the GPS epoch; more entries than the length
///             field can count. Nothing is appended then.
/// Checked by  test_suites/unit/models/gnss/novatel_messages_test.cpp (bytes by hand),
///             test_suites/validation/models/gnss/novatel_logs_test.cpp (real receivers' logs)
#pragma once

#include <orrery/models/gnss/broadcast_ephemeris.hpp>
#include <orrery/models/gnss/lnav.hpp>
#include <orrery/models/gnss/novatel.hpp>

#include <span>
#include <string_view>

namespace orrery::novatel {

constexpr std::uint16_t kGpsEphemId = 7;
constexpr std::uint16_t kIonUtcId = 8;
constexpr std::uint16_t kVersionId = 37;
constexpr std::uint16_t kRawEphemId = 41;
constexpr std::uint16_t kBestPosId = 42;
constexpr std::uint16_t kRangeId = 43;
constexpr std::uint16_t kAlmanacId = 73;
constexpr std::uint16_t kTimeId = 101;
constexpr std::uint16_t kRangeCmpId = 140;

/// State of one channel's tracking loops.
enum class TrackingState : std::uint8_t {
  kIdle = 0,
  kWidePullIn = 2,
  kNarrowPullIn = 3,
  kPhaseLock = 4,
  kFrequencyLock = 7,
  kChannelAlignment = 9,
  kCodeSearch = 10,
  kAidedPhaseLock = 11,
};

/// Signal of GPS; other systems count theirs anew.
enum class GpsSignal : std::uint8_t {
  kL1CA = 0,
  kL2P = 5,
  kL2PY = 9,
  kL5Q = 14,
  kL1CP = 16,
  kL2CM = 17
};

/// The channel tracking status word, field by field. Defaults: GPS L1 C/A in lock.
struct ChannelStatus {
  TrackingState state = TrackingState::kPhaseLock;
  std::uint8_t channel = 0;  // 0 to 31
  bool phase_locked = true;
  bool parity_known = true;  // false: the phase may be off by half a cycle
  bool code_locked = true;
  std::uint8_t correlator = 1;  // 0 to 7; 1: standard spacing, 2: narrow, 4: PAC
  std::uint8_t system = 0;      // 0 to 7; 0: GPS
  bool grouped = false;         // another signal of the satellite is tracked, too
  GpsSignal signal = GpsSignal::kL1CA;
  bool primary_L1 = true;
  bool half_cycle_added = false;
  bool prn_locked_out = false;
  bool forced_assignment = false;
};

constexpr std::uint32_t to_word(const ChannelStatus& status) {
  const auto bit = [](bool value, int at) { return static_cast<std::uint32_t>(value) << at; };
  const auto bits = [](auto value, std::uint32_t mask, int at) {
    return (static_cast<std::uint32_t>(value) & mask) << at;
  };
  return bits(status.state, 31, 0) | bits(status.channel, 31, 5) | bit(status.phase_locked, 10) |
         bit(status.parity_known, 11) | bit(status.code_locked, 12) |
         bits(status.correlator, 7, 13) | bits(status.system, 7, 16) | bit(status.grouped, 20) |
         bits(status.signal, 31, 21) | bit(status.primary_L1, 27) |
         bit(status.half_cycle_added, 28) | bit(status.prn_locked_out, 30) |
         bit(status.forced_assignment, 31);
}

/// One signal of one satellite at one epoch.
struct RangeObservation {
  std::uint16_t prn = 0;
  std::uint16_t glonass_frequency = 0;  // plus 7; 0 for GPS
  double pseudorange_m = 0;
  float pseudorange_sigma_m = 0;
  /// Carrier phase [cycles] that grows with the range, as in RINEX and in the literature. The logs
  /// carry the accumulated Doppler range, which is its negative; the encoder turns the sign.
  double carrier_phase_cycles = 0;
  float carrier_phase_sigma_cycles = 0;
  float doppler_Hz = 0;  // positive when approaching
  float cn0_dBHz = 0;
  float lock_time_s = 0;  // of continuous tracking
  std::uint32_t tracking_status = to_word({});
};

/// RANGE (43). At most 1489 observations.
void append_range(const Header& header, std::span<const RangeObservation> observations,
                  ByteBuffer& out);

/// RANGECMP (140), the same in 24 bytes each. Steps: Doppler 1/256 Hz, pseudorange 1/128 m
/// (nearest), phase 1/256 cycle modulo 2^23 cycles, C/N0 1 dB in 20 to 51, lock time 1/32 s up to
/// 65535.97 s, sigmas by the manual's table; what lies beyond a field's range takes its end.
void append_rangecmp(const Header& header, std::span<const RangeObservation> observations,
                     ByteBuffer& out);

/// BESTPOS (42): geodetic position on WGS 84.
struct BestPos {
  SolutionStatus status = SolutionStatus::kComputed;
  SolutionType type = SolutionType::kSingle;
  double latitude_deg = 0, longitude_deg = 0;
  double height_msl_m = 0;   // above the geoid
  float undulation_m = 0;    // geoid above the ellipsoid
  std::uint32_t datum = 61;  // WGS 84
  float sigma_latitude_m = 0, sigma_longitude_m = 0, sigma_height_m = 0;
  std::array<char, 4> station_id{};
  float differential_age_s = 0, solution_age_s = 0;
  std::uint8_t satellites_tracked = 0;
  std::uint8_t satellites_used = 0;
  std::uint8_t satellites_used_L1 = 0;
  std::uint8_t satellites_used_multi_frequency = 0;
  std::uint8_t reserved = 0;
  std::uint8_t extended_solution_status = 0;
  std::uint8_t galileo_beidou_mask = 0;
  std::uint8_t gps_glonass_mask = 0;
};
void append(const Header& header, const BestPos& message, ByteBuffer& out);

/// TIME (101): the receiver's clock against GPS time and UTC.
struct Time {
  std::uint32_t clock_status = 0;  // 0 valid, 1 converging, 2 iterating, 3 invalid
  double offset_s = 0;             // receiver's time minus GPS time
  double offset_sigma_s = 0;
  double utc_offset_s = 0;  // UTC minus GPS time: -18 since 2017
  std::uint32_t year = 0;   // the rest is UTC
  std::uint8_t month = 0, day = 0, hour = 0, minute = 0;
  std::uint32_t millisecond = 0;  // of the minute, 60999 in a leap second
  std::uint32_t utc_status = 1;   // 0 invalid, 1 valid, 2 warning
};
void append(const Header& header, const Time& message, ByteBuffer& out);

/// RAWEPHEM (41).
struct RawEphem {
  std::uint32_t prn = 0;
  std::uint32_t reference_week = 0;
  std::uint32_t reference_s = 0;  // toe, s of week
  lnav::Subframes subframes{};
};
void append(const Header& header, const RawEphem& message, ByteBuffer& out);

/// GPSEPHEM (7): fields of the log, which differ from the broadcast's in some units.
struct GpsEphem {
  std::uint32_t prn = 0;
  double tow_s = 0;  // time of subframe 1's hand-over word
  std::uint32_t health = 0;
  std::uint32_t iode1 = 0, iode2 = 0;  // of subframes 2 and 3
  std::uint32_t week = 0;              // of toe
  std::uint32_t z_week = 0;            // of tow_s
  double toe_s = 0;
  double semi_major_axis_m = 0;
  double delta_n_radps = 0;
  double mean_anomaly_rad = 0;
  double eccentricity = 0;
  double argument_of_perigee_rad = 0;
  double cuc_rad = 0, cus_rad = 0;
  double crc_m = 0, crs_m = 0;
  double cic_rad = 0, cis_rad = 0;
  double i0_rad = 0;
  double i_rate_radps = 0;
  double raan0_rad = 0;
  double raan_rate_radps = 0;
  std::uint32_t iodc = 0;
  double toc_s = 0;
  double tgd_s = 0;
  double af0_s = 0, af1_sps = 0, af2_sps2 = 0;
  std::uint32_t anti_spoofing = 1;
  double corrected_mean_motion_radps = 0;
  double ura_variance_m2 = 0;
};
/// The log of an ephemeris whose subframe 1 came at `tow_s` of `z_week`.
GpsEphem to_gpsephem(const BroadcastEphemeris& ephemeris, double tow_s, int z_week);
void append(const Header& header, const GpsEphem& message, ByteBuffer& out);

/// IONUTC (8): Klobuchar's coefficients and GPS time against UTC.
struct IonUtc {
  std::array<double, 4> alpha{};  // s, s/semicircle, ...
  std::array<double, 4> beta{};
  std::uint32_t utc_reference_week = 0;
  std::uint32_t utc_reference_s = 0;
  double A0_s = 0, A1_sps = 0;
  std::uint32_t leap_week = 0;    // of the next or last leap second
  std::uint32_t leap_day = 0;     // 1 (Sunday) to 7
  std::int32_t leap_seconds = 0;  // GPS minus UTC before it
  std::int32_t leap_seconds_future = 0;
  std::uint32_t reserved = 0;
};
void append(const Header& header, const IonUtc& message, ByteBuffer& out);

/// One satellite of ALMANAC (73).
struct AlmanacEntry {
  std::uint32_t prn = 0;
  std::uint32_t week = 0;
  double toa_s = 0;
  double eccentricity = 0;
  double raan_rate_radps = 0;
  double raan0_rad = 0;
  double argument_of_perigee_rad = 0;
  double mean_anomaly_rad = 0;
  double af0_s = 0, af1_sps = 0;
  double corrected_mean_motion_radps = 0;
  double semi_major_axis_m = 0;
  /// Inclination less 0.3 semicircles: the manual's "angle of inclination relative to 0.3 pi".
  double delta_inclination_rad = 0;
  std::uint32_t configuration = 0;
  std::uint32_t health_6bit = 0;
  std::uint32_t health_8bit = 0;
  std::uint32_t anti_spoofing = 1;
};
void append_almanac(const Header& header, std::span<const AlmanacEntry> entries, ByteBuffer& out);

/// One component of VERSION (37). Texts are cut or padded with zeros to their fields.
struct VersionComponent {
  std::uint32_t type = 1;                                           // GPSCARD
  std::string_view model, serial_number, hardware, software, boot;  // 16 bytes each
  std::string_view date;                                            // "2010/Apr/29", 12 bytes
  std::string_view time;                                            // "16:11:14", 12 bytes
};
void append_version(const Header& header, std::span<const VersionComponent> components,
                    ByteBuffer& out);

}  // namespace orrery::novatel
