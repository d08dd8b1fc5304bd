#include <orrery/models/gnss/novatel_frame.hpp>
#include <orrery/models/gnss/novatel_messages.hpp>

#include <cmath>

namespace orrery::novatel {

namespace {

constexpr double kMuGps_m3ps2 = 3.986005e14;  // IS-GPS-200, Table 20-IV

constexpr std::size_t kBestPosBytes = 72;
constexpr std::size_t kTimeBytes = 44;
constexpr std::size_t kRawEphemBytes = 12 + 3 * lnav::kSubframeBytes;
constexpr std::size_t kGpsEphemBytes = 224;
constexpr std::size_t kIonUtcBytes = 108;
constexpr std::size_t kAlmanacEntryBytes = 112;
constexpr std::size_t kVersionComponentBytes = 108;

void put_orbit(const GpsEphem& m, Writer& w) {
  w.f64(m.toe_s);
  w.f64(m.semi_major_axis_m);
  w.f64(m.delta_n_radps);
  w.f64(m.mean_anomaly_rad);
  w.f64(m.eccentricity);
  w.f64(m.argument_of_perigee_rad);
  w.f64(m.cuc_rad);
  w.f64(m.cus_rad);
  w.f64(m.crc_m);
  w.f64(m.crs_m);
  w.f64(m.cic_rad);
  w.f64(m.cis_rad);
  w.f64(m.i0_rad);
  w.f64(m.i_rate_radps);
  w.f64(m.raan0_rad);
  w.f64(m.raan_rate_radps);
}

void put_clock(const GpsEphem& m, Writer& w) {
  w.u32(m.iodc);
  w.f64(m.toc_s);
  w.f64(m.tgd_s);
  w.f64(m.af0_s);
  w.f64(m.af1_sps);
  w.f64(m.af2_sps2);
}

void put_almanac_entry(const AlmanacEntry& entry, Writer& w) {
  w.u32(entry.prn);
  w.u32(entry.week);
  w.f64(entry.toa_s);
  w.f64(entry.eccentricity);
  w.f64(entry.raan_rate_radps);
  w.f64(entry.raan0_rad);
  w.f64(entry.argument_of_perigee_rad);
  w.f64(entry.mean_anomaly_rad);
  w.f64(entry.af0_s);
  w.f64(entry.af1_sps);
  w.f64(entry.corrected_mean_motion_radps);
  w.f64(entry.semi_major_axis_m);
  w.f64(entry.delta_inclination_rad);
  w.u32(entry.configuration);
  w.u32(entry.health_6bit);
  w.u32(entry.health_8bit);
  w.u32(entry.anti_spoofing);
}

void put_version_component(const VersionComponent& component, Writer& w) {
  w.u32(component.type);
  w.text(component.model, 16);
  w.text(component.serial_number, 16);
  w.text(component.hardware, 16);
  w.text(component.software, 16);
  w.text(component.boot, 16);
  w.text(component.date, 12);
  w.text(component.time, 12);
}

}  // namespace

void append(const Header& header, const BestPos& m, ByteBuffer& out) {
  Frame frame(header, kBestPosId, kBestPosBytes, out);
  Writer w = frame.body();
  w.u32(static_cast<std::uint32_t>(m.status));
  w.u32(static_cast<std::uint32_t>(m.type));
  w.f64(m.latitude_deg);
  w.f64(m.longitude_deg);
  w.f64(m.height_msl_m);
  w.f32(m.undulation_m);
  w.u32(m.datum);
  w.f32(m.sigma_latitude_m);
  w.f32(m.sigma_longitude_m);
  w.f32(m.sigma_height_m);
  w.text({m.station_id.data(), m.station_id.size()}, 4);
  w.f32(m.differential_age_s);
  w.f32(m.solution_age_s);
  w.u8(m.satellites_tracked);
  w.u8(m.satellites_used);
  w.u8(m.satellites_used_L1);
  w.u8(m.satellites_used_multi_frequency);
  w.u8(m.reserved);
  w.u8(m.extended_solution_status);
  w.u8(m.galileo_beidou_mask);
  w.u8(m.gps_glonass_mask);
  frame.close();
}

void append(const Header& header, const Time& m, ByteBuffer& out) {
  Frame frame(header, kTimeId, kTimeBytes, out);
  Writer w = frame.body();
  w.u32(m.clock_status);
  w.f64(m.offset_s);
  w.f64(m.offset_sigma_s);
  w.f64(m.utc_offset_s);
  w.u32(m.year);
  w.u8(m.month);
  w.u8(m.day);
  w.u8(m.hour);
  w.u8(m.minute);
  w.u32(m.millisecond);
  w.u32(m.utc_status);
  frame.close();
}

void append(const Header& header, const RawEphem& m, ByteBuffer& out) {
  Frame frame(header, kRawEphemId, kRawEphemBytes, out);
  Writer w = frame.body();
  w.u32(m.prn);
  w.u32(m.reference_week);
  w.u32(m.reference_s);
  for (const lnav::Subframe& subframe : m.subframes) w.bytes(subframe);
  frame.close();
}

GpsEphem to_gpsephem(const BroadcastEphemeris& e, double tow_s, int z_week) {
  const double a_m = e.sqrt_a_sqrtm * e.sqrt_a_sqrtm;
  const double ura_m = lnav::ura_m(e.ura_index);
  return {
      .prn = static_cast<std::uint32_t>(e.prn),
      .tow_s = tow_s,
      .health = static_cast<std::uint32_t>(e.health),
      .iode1 = static_cast<std::uint32_t>(e.iode),
      .iode2 = static_cast<std::uint32_t>(e.iode),
      .week = static_cast<std::uint32_t>(e.week),
      .z_week = static_cast<std::uint32_t>(z_week),
      .toe_s = e.toe_s,
      .semi_major_axis_m = a_m,
      .delta_n_radps = e.delta_n_radps,
      .mean_anomaly_rad = e.mean_anomaly_rad,
      .eccentricity = e.eccentricity,
      .argument_of_perigee_rad = e.argument_of_perigee_rad,
      .cuc_rad = e.cuc_rad,
      .cus_rad = e.cus_rad,
      .crc_m = e.crc_m,
      .crs_m = e.crs_m,
      .cic_rad = e.cic_rad,
      .cis_rad = e.cis_rad,
      .i0_rad = e.i0_rad,
      .i_rate_radps = e.i_rate_radps,
      .raan0_rad = e.raan0_rad,
      .raan_rate_radps = e.raan_rate_radps,
      .iodc = static_cast<std::uint32_t>(e.iodc),
      .toc_s = e.toc_s,
      .tgd_s = e.tgd_s,
      .af0_s = e.af0_s,
      .af1_sps = e.af1_sps,
      .af2_sps2 = e.af2_sps2,
      .corrected_mean_motion_radps = std::sqrt(kMuGps_m3ps2 / (a_m * a_m * a_m)) + e.delta_n_radps,
      .ura_variance_m2 = ura_m * ura_m};
}

void append(const Header& header, const GpsEphem& m, ByteBuffer& out) {
  Frame frame(header, kGpsEphemId, kGpsEphemBytes, out);
  Writer w = frame.body();
  w.u32(m.prn);
  w.f64(m.tow_s);
  w.u32(m.health);
  w.u32(m.iode1);
  w.u32(m.iode2);
  w.u32(m.week);
  w.u32(m.z_week);
  put_orbit(m, w);
  put_clock(m, w);
  w.u32(m.anti_spoofing);
  w.f64(m.corrected_mean_motion_radps);
  w.f64(m.ura_variance_m2);
  frame.close();
}

void append(const Header& header, const IonUtc& m, ByteBuffer& out) {
  Frame frame(header, kIonUtcId, kIonUtcBytes, out);
  Writer w = frame.body();
  for (const double alpha : m.alpha) w.f64(alpha);
  for (const double beta : m.beta) w.f64(beta);
  w.u32(m.utc_reference_week);
  w.u32(m.utc_reference_s);
  w.f64(m.A0_s);
  w.f64(m.A1_sps);
  w.u32(m.leap_week);
  w.u32(m.leap_day);
  w.i32(m.leap_seconds);
  w.i32(m.leap_seconds_future);
  w.u32(m.reserved);
  frame.close();
}

void append_almanac(const Header& header, std::span<const AlmanacEntry> entries, ByteBuffer& out) {
  append_array(header, kAlmanacId, entries, kAlmanacEntryBytes, put_almanac_entry, out);
}

void append_version(const Header& header, std::span<const VersionComponent> components,
                    ByteBuffer& out) {
  append_array(header, kVersionId, components, kVersionComponentBytes, put_version_component, out);
}

}  // namespace orrery::novatel
