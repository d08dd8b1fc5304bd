/// Reads a log with the flight software's decoder (C) and writes it with the simulator's encoder
/// (C++): the two share no code, so equal bytes prove both. For tests and fuzzing.
#pragma once

#include <orrery/models/gnss/novatel_messages.hpp>

#include <algorithm>
#include <string_view>
#include <vector>

#include "support/novatel/novatel.h"

namespace orrery::novatel {

inline Header to_header(const novatel_header& h) {
  constexpr std::int64_t kNsPerMs = 1'000'000;
  constexpr std::int64_t kNsPerWeek = 604'800'000 * kNsPerMs;
  return {.message_id = h.message_id,
          .t = from_ns(h.week * kNsPerWeek + h.ms * kNsPerMs),
          .message_type = h.message_type,
          .port_address = h.port_address,
          .sequence = h.sequence,
          .idle_time_half_percent = h.idle_time_half_percent,
          .time_status = TimeStatus{h.time_status},
          .receiver_status = h.receiver_status,
          .reserved = h.reserved,
          .software_build = h.software_build};
}

inline Vec3 to_vec3(const auto(&v)[3]) {
  return {v[0], v[1], v[2]};
}

inline std::array<char, 4> to_station(const char (&id)[4]) {
  return {id[0], id[1], id[2], id[3]};
}

inline BestXyz to_message(const novatel_bestxyz& m) {
  return {.position_status = SolutionStatus{m.position_status},
          .position_type = SolutionType{m.position_type},
          .r_ECEF = to_vec3(m.r_ECEF),
          .sigma_r_ECEF = to_vec3(m.sigma_r_ECEF),
          .velocity_status = SolutionStatus{m.velocity_status},
          .velocity_type = SolutionType{m.velocity_type},
          .v_ECEF = to_vec3(m.v_ECEF),
          .sigma_v_ECEF = to_vec3(m.sigma_v_ECEF),
          .station_id = to_station(m.station_id),
          .velocity_latency_s = m.velocity_latency_s,
          .differential_age_s = m.differential_age_s,
          .solution_age_s = m.solution_age_s,
          .satellites_tracked = m.satellites_tracked,
          .satellites_used = m.satellites_used,
          .satellites_used_L1 = m.satellites_used_L1,
          .satellites_used_multi_frequency = m.satellites_used_multi_frequency,
          .extended_solution_status = m.extended_solution_status,
          .galileo_beidou_mask = m.galileo_beidou_mask,
          .gps_glonass_mask = m.gps_glonass_mask};
}

inline BestPos to_message(const novatel_bestpos& m) {
  return {.status = SolutionStatus{m.status},
          .type = SolutionType{m.type},
          .latitude_deg = m.latitude_deg,
          .longitude_deg = m.longitude_deg,
          .height_msl_m = m.height_msl_m,
          .undulation_m = m.undulation_m,
          .datum = m.datum,
          .sigma_latitude_m = m.sigma_latitude_m,
          .sigma_longitude_m = m.sigma_longitude_m,
          .sigma_height_m = m.sigma_height_m,
          .station_id = to_station(m.station_id),
          .differential_age_s = m.differential_age_s,
          .solution_age_s = m.solution_age_s,
          .satellites_tracked = m.satellites_tracked,
          .satellites_used = m.satellites_used,
          .satellites_used_L1 = m.satellites_used_L1,
          .satellites_used_multi_frequency = m.satellites_used_multi_frequency,
          .reserved = m.reserved,
          .extended_solution_status = m.extended_solution_status,
          .galileo_beidou_mask = m.galileo_beidou_mask,
          .gps_glonass_mask = m.gps_glonass_mask};
}

inline Time to_message(const novatel_time& m) {
  return {.clock_status = m.clock_status,
          .offset_s = m.offset_s,
          .offset_sigma_s = m.offset_sigma_s,
          .utc_offset_s = m.utc_offset_s,
          .year = m.year,
          .month = m.month,
          .day = m.day,
          .hour = m.hour,
          .minute = m.minute,
          .millisecond = m.millisecond,
          .utc_status = m.utc_status};
}

inline RawEphem to_message(const novatel_rawephem& m) {
  RawEphem out{.prn = m.prn, .reference_week = m.reference_week, .reference_s = m.reference_s};
  for (std::size_t k = 0; k < 3; ++k) {
    std::ranges::transform(m.subframes[k], out.subframes[k].begin(),
                           [](unsigned char b) { return std::byte{b}; });
  }
  return out;
}

inline GpsEphem to_message(const novatel_gpsephem& m) {
  return {.prn = m.prn,
          .tow_s = m.tow_s,
          .health = m.health,
          .iode1 = m.iode1,
          .iode2 = m.iode2,
          .week = m.week,
          .z_week = m.z_week,
          .toe_s = m.toe_s,
          .semi_major_axis_m = m.semi_major_axis_m,
          .delta_n_radps = m.delta_n_radps,
          .mean_anomaly_rad = m.mean_anomaly_rad,
          .eccentricity = m.eccentricity,
          .argument_of_perigee_rad = m.argument_of_perigee_rad,
          .cuc_rad = m.cuc_rad,
          .cus_rad = m.cus_rad,
          .crc_m = m.crc_m,
          .crs_m = m.crs_m,
          .cic_rad = m.cic_rad,
          .cis_rad = m.cis_rad,
          .i0_rad = m.i0_rad,
          .i_rate_radps = m.i_rate_radps,
          .raan0_rad = m.raan0_rad,
          .raan_rate_radps = m.raan_rate_radps,
          .iodc = m.iodc,
          .toc_s = m.toc_s,
          .tgd_s = m.tgd_s,
          .af0_s = m.af0_s,
          .af1_sps = m.af1_sps,
          .af2_sps2 = m.af2_sps2,
          .anti_spoofing = m.anti_spoofing,
          .corrected_mean_motion_radps = m.corrected_mean_motion_radps,
          .ura_variance_m2 = m.ura_variance_m2};
}

inline IonUtc to_message(const novatel_ionutc& m) {
  return {.alpha = std::to_array(m.alpha),
          .beta = std::to_array(m.beta),
          .utc_reference_week = m.utc_reference_week,
          .utc_reference_s = m.utc_reference_s,
          .A0_s = m.A0_s,
          .A1_sps = m.A1_sps,
          .leap_week = m.leap_week,
          .leap_day = m.leap_day,
          .leap_seconds = m.leap_seconds,
          .leap_seconds_future = m.leap_seconds_future,
          .reserved = m.reserved};
}

inline RangeObservation to_message(const novatel_observation& m) {
  return {.prn = m.prn,
          .glonass_frequency = m.glonass_frequency,
          .pseudorange_m = m.pseudorange_m,
          .pseudorange_sigma_m = m.pseudorange_sigma_m,
          .carrier_phase_cycles = m.carrier_phase_cycles,
          .carrier_phase_sigma_cycles = m.carrier_phase_sigma_cycles,
          .doppler_Hz = m.doppler_Hz,
          .cn0_dBHz = m.cn0_dBHz,
          .lock_time_s = m.lock_time_s,
          .tracking_status = m.tracking_status};
}

inline AlmanacEntry to_message(const novatel_almanac_entry& m) {
  return {.prn = m.prn,
          .week = m.week,
          .toa_s = m.toa_s,
          .eccentricity = m.eccentricity,
          .raan_rate_radps = m.raan_rate_radps,
          .raan0_rad = m.raan0_rad,
          .argument_of_perigee_rad = m.argument_of_perigee_rad,
          .mean_anomaly_rad = m.mean_anomaly_rad,
          .af0_s = m.af0_s,
          .af1_sps = m.af1_sps,
          .corrected_mean_motion_radps = m.corrected_mean_motion_radps,
          .semi_major_axis_m = m.semi_major_axis_m,
          .delta_inclination_rad = m.delta_inclination_rad,
          .configuration = m.configuration,
          .health_6bit = m.health_6bit,
          .health_8bit = m.health_8bit,
          .anti_spoofing = m.anti_spoofing};
}

// The views look into `m`.
inline VersionComponent to_message(const novatel_version_component& m) {
  return {.type = m.type,
          .model = m.model,
          .serial_number = m.serial_number,
          .hardware = m.hardware,
          .software = m.software,
          .boot = m.boot,
          .date = m.date,
          .time = m.time};
}

template <class Decoded>
bool reencode_one(const novatel_frame& frame, int (*get)(const novatel_frame*, Decoded*),
                  ByteBuffer& out) {
  Decoded decoded;
  if (get(&frame, &decoded) == 0) return false;
  append(to_header(frame.header), to_message(decoded), out);
  return true;
}

template <class Decoded, class Append>
bool reencode_entries(const novatel_frame& frame,
                      int (*get)(const novatel_frame*, std::uint32_t, Decoded*), Append append_all,
                      ByteBuffer& out) {
  if (frame.header.body_bytes < 4 || novatel_is_response(&frame) != 0) return false;
  std::vector<Decoded> decoded(novatel_count(&frame));
  std::vector<decltype(to_message(decoded[0]))> messages;
  for (std::uint32_t i = 0; i < decoded.size(); ++i) {
    if (get(&frame, i, &decoded[i]) == 0) return false;
    messages.push_back(to_message(decoded[i]));
  }
  append_all(to_header(frame.header), messages, out);
  return true;
}

/// Appends the log again to `out`; false if the decoder does not know or does not take it.
inline bool reencode(const novatel_frame& frame, ByteBuffer& out) {
  switch (frame.header.message_id) {
    case kGpsEphemId:
      return reencode_one(frame, novatel_get_gpsephem, out);
    case kIonUtcId:
      return reencode_one(frame, novatel_get_ionutc, out);
    case kVersionId:
      return reencode_entries(frame, novatel_get_version, append_version, out);
    case kRawEphemId:
      return reencode_one(frame, novatel_get_rawephem, out);
    case kBestPosId:
      return reencode_one(frame, novatel_get_bestpos, out);
    case kRangeId:
      return reencode_entries(frame, novatel_get_range, append_range, out);
    case kAlmanacId:
      return reencode_entries(frame, novatel_get_almanac, append_almanac, out);
    case kTimeId:
      return reencode_one(frame, novatel_get_time, out);
    case kRangeCmpId:
      return reencode_entries(frame, novatel_get_rangecmp, append_rangecmp, out);
    case kBestXyzId:
      return reencode_one(frame, novatel_get_bestxyz, out);
    default:
      return false;
  }
}

/// Every frame of a stream, handed to `use(frame)` while it is valid. `chunk` bytes at a time.
template <class Use>
novatel_framer for_each_frame(Bytes stream, std::size_t chunk, std::size_t capacity, Use use) {
  std::vector<unsigned char> room(capacity);
  novatel_framer framer;
  novatel_framer_init(&framer, room.data(), room.size());
  const auto* at = reinterpret_cast<const unsigned char*>(stream.data());
  for (std::size_t left = stream.size(); left > 0;) {
    const std::size_t taken = novatel_framer_write(&framer, at, std::min(chunk, left));
    at += taken;
    left -= taken;
    novatel_frame frame;
    while (novatel_framer_next(&framer, &frame) != 0) use(frame);
  }
  return framer;
}

}  // namespace orrery::novatel
