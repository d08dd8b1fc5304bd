/* Reads the byte stream of a NovAtel OEM receiver. C89, no allocation, no dependency but the
 * headers beside it; any bytes are survived.
 *
 * Layout   OEM7 Commands and Logs Reference Manual (NovAtel OM-20000169): binary header, CRC-32,
 * and the logs below. Values are taken byte by byte: no struct overlay. Framing  A frame counts
 * when its CRC is right, and no length is believed before. After a wrong CRC the search resumes one
 * byte behind the false start, inside the bytes already held. Text, NMEA and ASCII logs between
 * frames are passed over; short-header logs are checked, counted and passed over. Units    SI;
 * angles in radians except where a name says _deg. Getters  1 if the frame is that log and long
 * enough (a later firmware may append fields), else 0, with *out untouched. Numbers are given as
 * they were sent: they may be NaN or absurd. Responses to commands (novatel_is_response) are no
 * logs.
 *
 *   unsigned char room[4096];
 *   novatel_framer framer;
 *   novatel_framer_init(&framer, room, sizeof room);
 *   while (count > 0) {
 *     size_t taken = novatel_framer_write(&framer, bytes, count);
 *     bytes += taken;
 *     count -= taken;
 *     while (novatel_framer_next(&framer, &frame)) use(&frame);
 *   }
 */
#ifndef FLIGHT_SUPPORT_NOVATEL_H
#define FLIGHT_SUPPORT_NOVATEL_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define NOVATEL_HEADER_BYTES 28u
#define NOVATEL_CRC_BYTES 4u

#define NOVATEL_LOG 1u /* commands */
#define NOVATEL_UNLOG 36u
#define NOVATEL_UNLOGALL 38u
#define NOVATEL_GPSEPHEM 7u /* logs */
#define NOVATEL_IONUTC 8u
#define NOVATEL_VERSION 37u
#define NOVATEL_RAWEPHEM 41u
#define NOVATEL_BESTPOS 42u
#define NOVATEL_RANGE 43u
#define NOVATEL_ALMANAC 73u
#define NOVATEL_TIME 101u
#define NOVATEL_RANGECMP 140u
#define NOVATEL_BESTXYZ 241u

#define NOVATEL_TIME_UNKNOWN 20u /* time status: week and ms mean nothing */
#define NOVATEL_SOL_COMPUTED 0u

/* Channel tracking status, RANGE and RANGECMP. */
#define NOVATEL_PHASE_LOCKED 0x00000400u
#define NOVATEL_PARITY_KNOWN 0x00000800u /* else the phase may be off by half a cycle */
#define NOVATEL_CODE_LOCKED 0x00001000u
#define NOVATEL_SYSTEM(status) (((status) >> 16) & 7u)  /* 0 GPS */
#define NOVATEL_SIGNAL(status) (((status) >> 21) & 31u) /* of GPS: 0 L1 C/A, 9 L2 P(Y), 17 L2C */

typedef struct novatel_header {
  uint16_t message_id;
  uint8_t message_type; /* bits 0-4 source, 5-6 format, 7 response */
  uint8_t port_address;
  uint16_t body_bytes;
  uint16_t sequence;
  uint8_t idle_time_half_percent;
  uint8_t time_status;
  uint16_t week; /* of GPS, not modulo 1024 */
  uint32_t ms;   /* of the week */
  uint32_t receiver_status;
  uint16_t reserved;
  uint16_t software_build;
} novatel_header;

/* A frame with a right CRC. `body` points into the framer's room: until its next call. */
typedef struct novatel_frame {
  novatel_header header;
  const unsigned char* body; /* header.body_bytes of them */
} novatel_frame;

typedef struct novatel_framer {
  unsigned char* room;
  size_t capacity;
  size_t begin, end; /* what is held */
  size_t given;      /* bytes of the frame given last, dropped at the next call */
  uint32_t frames, short_frames;
  uint32_t bad_frames;  /* whole frames whose CRC was wrong, false starts included */
  uint32_t passed_over; /* bytes that belonged to no frame */
} novatel_framer;

/* `room` stays the framer's. Frames longer than `capacity` are passed over, and a wrong length
 * delays what follows it by at most that. 0, and nothing is ever found, below 32 bytes. RANGE of 40
 * signals takes 1796 bytes, ALMANAC of 32 satellites 3620. */
int novatel_framer_init(novatel_framer* framer, unsigned char* room, size_t capacity);

/* Takes as many bytes as there is room for, at least one if novatel_framer_next said 0 before. */
size_t novatel_framer_write(novatel_framer* framer, const unsigned char* bytes, size_t count);

/* 1 and the next frame; 0 if it needs more bytes. */
int novatel_framer_next(novatel_framer* framer, novatel_frame* frame);

int novatel_is_response(const novatel_frame* frame);

/* GPS time of the header [ns since 1980-01-06]; 0 if the receiver does not know it. */
int64_t novatel_time_ns(const novatel_frame* frame);

/* Entries of a RANGE, RANGECMP, ALMANAC or VERSION that are there in full; 0 for anything else. */
uint32_t novatel_count(const novatel_frame* frame);

typedef struct novatel_observation {
  uint16_t prn;
  uint16_t glonass_frequency; /* plus 7; 0 for GPS */
  double pseudorange_m;
  float pseudorange_sigma_m;
  double carrier_phase_cycles; /* grows with the range: the negative of the log's ADR */
  float carrier_phase_sigma_cycles;
  float doppler_Hz; /* positive when approaching */
  float cn0_dBHz;
  float lock_time_s;
  uint32_t tracking_status;
} novatel_observation;

/* Entry 0 to novatel_count - 1. The phase of RANGECMP comes modulo 2^24 cycles. */
int novatel_get_range(const novatel_frame* frame, uint32_t index, novatel_observation* out);
int novatel_get_rangecmp(const novatel_frame* frame, uint32_t index, novatel_observation* out);

/* The phase of a RANGECMP with its roll-overs restored: the one nearest the pseudorange. */
double novatel_restored_phase_cycles(const novatel_observation* observation, double wavelength_m);

typedef struct novatel_bestxyz {
  uint32_t position_status, position_type;
  double r_ECEF[3];
  float sigma_r_ECEF[3];
  uint32_t velocity_status, velocity_type;
  double v_ECEF[3]; /* relative to the rotating Earth */
  float sigma_v_ECEF[3];
  char station_id[4];
  float velocity_latency_s, differential_age_s, solution_age_s;
  uint8_t satellites_tracked, satellites_used, satellites_used_L1, satellites_used_multi_frequency;
  uint8_t reserved, extended_solution_status, galileo_beidou_mask, gps_glonass_mask;
} novatel_bestxyz;
int novatel_get_bestxyz(const novatel_frame* frame, novatel_bestxyz* out);

typedef struct novatel_bestpos {
  uint32_t status, type;
  double latitude_deg, longitude_deg, height_msl_m;
  float undulation_m;
  uint32_t datum;
  float sigma_latitude_m, sigma_longitude_m, sigma_height_m;
  char station_id[4];
  float differential_age_s, solution_age_s;
  uint8_t satellites_tracked, satellites_used, satellites_used_L1, satellites_used_multi_frequency;
  uint8_t reserved, extended_solution_status, galileo_beidou_mask, gps_glonass_mask;
} novatel_bestpos;
int novatel_get_bestpos(const novatel_frame* frame, novatel_bestpos* out);

typedef struct novatel_time {
  uint32_t clock_status;           /* 0 valid */
  double offset_s, offset_sigma_s; /* receiver's time minus GPS time */
  double utc_offset_s;             /* UTC minus GPS time */
  uint32_t year;                   /* the rest is UTC */
  uint8_t month, day, hour, minute;
  uint32_t millisecond; /* of the minute */
  uint32_t utc_status;  /* 1 valid */
} novatel_time;
int novatel_get_time(const novatel_frame* frame, novatel_time* out);

typedef struct novatel_rawephem {
  uint32_t prn, reference_week, reference_s;
  unsigned char subframes[3][30]; /* parity removed, most significant bit first */
} novatel_rawephem;
int novatel_get_rawephem(const novatel_frame* frame, novatel_rawephem* out);

typedef struct novatel_gpsephem {
  uint32_t prn;
  double tow_s;
  uint32_t health, iode1, iode2;
  uint32_t week, z_week; /* of toe, of tow */
  double toe_s, semi_major_axis_m, delta_n_radps, mean_anomaly_rad, eccentricity;
  double argument_of_perigee_rad, cuc_rad, cus_rad, crc_m, crs_m, cic_rad, cis_rad;
  double i0_rad, i_rate_radps, raan0_rad, raan_rate_radps;
  uint32_t iodc;
  double toc_s, tgd_s, af0_s, af1_sps, af2_sps2;
  uint32_t anti_spoofing;
  double corrected_mean_motion_radps, ura_variance_m2;
} novatel_gpsephem;
int novatel_get_gpsephem(const novatel_frame* frame, novatel_gpsephem* out);

typedef struct novatel_ionutc {
  double alpha[4], beta[4]; /* Klobuchar's: s, s/semicircle, ... */
  uint32_t utc_reference_week, utc_reference_s;
  double A0_s, A1_sps;
  uint32_t leap_week, leap_day;
  int32_t leap_seconds, leap_seconds_future;
  uint32_t reserved;
} novatel_ionutc;
int novatel_get_ionutc(const novatel_frame* frame, novatel_ionutc* out);

typedef struct novatel_almanac_entry {
  uint32_t prn, week;
  double toa_s, eccentricity, raan_rate_radps, raan0_rad, argument_of_perigee_rad;
  double mean_anomaly_rad, af0_s, af1_sps, corrected_mean_motion_radps, semi_major_axis_m;
  double delta_inclination_rad; /* relative to 0.3 semicircles */
  uint32_t configuration, health_6bit, health_8bit, anti_spoofing;
} novatel_almanac_entry;
int novatel_get_almanac(const novatel_frame* frame, uint32_t index, novatel_almanac_entry* out);

typedef struct novatel_version_component { /* texts end in zero */
  uint32_t type;
  char model[17], serial_number[17], hardware[17], software[17], boot[17], date[13], time[13];
} novatel_version_component;
int novatel_get_version(const novatel_frame* frame, uint32_t index, novatel_version_component* out);

#ifdef __cplusplus
}
#endif

#endif
