#include <string.h>

#include "novatel.h"
#include "orrery_messages.h"

#define NS_PER_WEEK ((int64_t)604800 * 1000000000)
#define ROLL_CYCLES 8388608.0 /* 2^23 */

enum {
  GPSEPHEM_BYTES = 224,
  IONUTC_BYTES = 108,
  RAWEPHEM_BYTES = 102,
  BESTPOS_BYTES = 72,
  TIME_BYTES = 44,
  BESTXYZ_BYTES = 112,
  RANGE_BYTES = 44, /* of one entry, as the three below */
  RANGECMP_BYTES = 24,
  ALMANAC_BYTES = 112,
  VERSION_BYTES = 108
};

/* Takes values one after another, least significant byte first. */
typedef struct reader {
  const unsigned char* at;
} reader;

static uint8_t u8(reader* r) {
  return *r->at++;
}

static uint16_t u16(reader* r) {
  const uint16_t value = (uint16_t)(r->at[0] | (r->at[1] << 8));
  r->at += 2;
  return value;
}

static uint32_t u32(reader* r) {
  const uint32_t value = orrery_get_u32(r->at);
  r->at += 4;
  return value;
}

static int32_t i32_of(uint32_t bits) {
  int32_t value;
  memcpy(&value, &bits, sizeof value);
  return value;
}

static int32_t i32(reader* r) {
  return i32_of(u32(r));
}

static float f32(reader* r) {
  const uint32_t bits = u32(r);
  float value;
  memcpy(&value, &bits, sizeof value);
  return value;
}

static double f64(reader* r) {
  const double value = orrery_get_f64(r->at);
  r->at += 8;
  return value;
}

static void f32x3(reader* r, float out[3]) {
  int i;
  for (i = 0; i < 3; i++) out[i] = f32(r);
}

static void f64s(reader* r, double* out, int count) {
  orrery_get_f64s(r->at, out, count);
  r->at += 8 * count;
}

static void bytes(reader* r, void* out, size_t count) {
  memcpy(out, r->at, count);
  r->at += count;
}

static void text(reader* r, char* out, size_t count) {
  bytes(r, out, count);
  out[count] = '\0';
}

int novatel_is_response(const novatel_frame* frame) {
  return (frame->header.message_type & 0x80u) != 0;
}

int64_t novatel_time_ns(const novatel_frame* frame) {
  const novatel_header* header = &frame->header;
  if (header->time_status == NOVATEL_TIME_UNKNOWN || header->week == 0 ||
      header->ms >= 604800000u) {
    return 0;
  }
  return header->week * NS_PER_WEEK + header->ms * (int64_t)1000000;
}

/* A reader at the body if the frame is that log and has so many bytes. */
static int starts(const novatel_frame* frame, unsigned message_id, size_t body_bytes, reader* r) {
  if (frame->header.message_id != message_id || novatel_is_response(frame)) return 0;
  r->at = frame->body;
  return frame->header.body_bytes >= body_bytes;
}

static size_t entry_bytes(unsigned message_id) {
  switch (message_id) {
    case NOVATEL_RANGE:
      return RANGE_BYTES;
    case NOVATEL_RANGECMP:
      return RANGECMP_BYTES;
    case NOVATEL_ALMANAC:
      return ALMANAC_BYTES;
    case NOVATEL_VERSION:
      return VERSION_BYTES;
    default:
      return 0;
  }
}

uint32_t novatel_count(const novatel_frame* frame) {
  const size_t size = entry_bytes(frame->header.message_id);
  uint32_t said, room;
  if (size == 0 || novatel_is_response(frame) || frame->header.body_bytes < 4) return 0;
  said = orrery_get_u32(frame->body);
  room = (uint32_t)((frame->header.body_bytes - 4u) / size);
  return said < room ? said : room;
}

/* A reader at an entry if the frame is that log and has it. */
static int starts_entry(const novatel_frame* frame, unsigned message_id, uint32_t index,
                        reader* r) {
  if (frame->header.message_id != message_id || index >= novatel_count(frame)) return 0;
  r->at = frame->body + 4 + index * entry_bytes(message_id);
  return 1;
}

int novatel_get_range(const novatel_frame* frame, uint32_t index, novatel_observation* out) {
  reader r;
  if (!starts_entry(frame, NOVATEL_RANGE, index, &r)) return 0;
  out->prn = u16(&r);
  out->glonass_frequency = u16(&r);
  out->pseudorange_m = f64(&r);
  out->pseudorange_sigma_m = f32(&r);
  out->carrier_phase_cycles = -f64(&r);
  out->carrier_phase_sigma_cycles = f32(&r);
  out->doppler_Hz = f32(&r);
  out->cn0_dBHz = f32(&r);
  out->lock_time_s = f32(&r);
  out->tracking_status = u32(&r);
  return 1;
}

static float pseudorange_sigma_m(unsigned index) {
  static const float kSigma_m[16] = {0.050f, 0.075f, 0.113f, 0.169f, 0.253f, 0.380f,
                                     0.570f, 0.854f, 1.281f, 2.375f, 4.75f,  9.5f,
                                     19.0f,  38.0f,  76.0f,  152.0f};
  return kSigma_m[index & 15u];
}

/* 28 bits, two's complement. */
static int32_t doppler_steps(uint32_t word) {
  const uint32_t bits = word & 0x0FFFFFFFu;
  return (bits & 0x08000000u) != 0 ? (int32_t)bits - 0x10000000 : (int32_t)bits;
}

int novatel_get_rangecmp(const novatel_frame* frame, uint32_t index, novatel_observation* out) {
  reader r;
  uint32_t low, high, sigmas, lock;
  if (!starts_entry(frame, NOVATEL_RANGECMP, index, &r)) return 0;
  out->tracking_status = u32(&r);
  low = u32(&r);
  high = u32(&r);
  out->doppler_Hz = (float)doppler_steps(low) / 256.0f;
  out->pseudorange_m = ((double)high * 16.0 + (double)(low >> 28)) / 128.0;
  out->carrier_phase_cycles = -(double)i32(&r) / 256.0;
  sigmas = u8(&r);
  out->pseudorange_sigma_m = pseudorange_sigma_m(sigmas & 15u);
  out->carrier_phase_sigma_cycles = (float)((sigmas >> 4) + 1u) / 512.0f;
  out->prn = u8(&r);
  lock = u32(&r);
  out->lock_time_s = (float)(lock & 0x1FFFFFu) / 32.0f;
  out->cn0_dBHz = (float)(20u + ((lock >> 21) & 31u));
  out->glonass_frequency = (uint16_t)(lock >> 26);
  return 1;
}

/* Nearest whole number of a value within +-2^52; C89 has no round(). */
static double nearest(double value) {
  const double half = value < 0 ? -0.5 : 0.5;
  if (!(value > -4503599627370496.0 && value < 4503599627370496.0)) return value;
  return (double)(int64_t)(value + half);
}

double novatel_restored_phase_cycles(const novatel_observation* observation, double wavelength_m) {
  const double phase = observation->carrier_phase_cycles;
  const double range_cycles = observation->pseudorange_m / wavelength_m;
  return phase + ROLL_CYCLES * nearest((range_cycles - phase) / ROLL_CYCLES);
}

int novatel_get_bestxyz(const novatel_frame* frame, novatel_bestxyz* out) {
  reader r;
  if (!starts(frame, NOVATEL_BESTXYZ, BESTXYZ_BYTES, &r)) return 0;
  out->position_status = u32(&r);
  out->position_type = u32(&r);
  f64s(&r, out->r_ECEF, 3);
  f32x3(&r, out->sigma_r_ECEF);
  out->velocity_status = u32(&r);
  out->velocity_type = u32(&r);
  f64s(&r, out->v_ECEF, 3);
  f32x3(&r, out->sigma_v_ECEF);
  bytes(&r, out->station_id, 4);
  out->velocity_latency_s = f32(&r);
  out->differential_age_s = f32(&r);
  out->solution_age_s = f32(&r);
  out->satellites_tracked = u8(&r);
  out->satellites_used = u8(&r);
  out->satellites_used_L1 = u8(&r);
  out->satellites_used_multi_frequency = u8(&r);
  out->reserved = u8(&r);
  out->extended_solution_status = u8(&r);
  out->galileo_beidou_mask = u8(&r);
  out->gps_glonass_mask = u8(&r);
  return 1;
}

int novatel_get_bestpos(const novatel_frame* frame, novatel_bestpos* out) {
  reader r;
  if (!starts(frame, NOVATEL_BESTPOS, BESTPOS_BYTES, &r)) return 0;
  out->status = u32(&r);
  out->type = u32(&r);
  out->latitude_deg = f64(&r);
  out->longitude_deg = f64(&r);
  out->height_msl_m = f64(&r);
  out->undulation_m = f32(&r);
  out->datum = u32(&r);
  out->sigma_latitude_m = f32(&r);
  out->sigma_longitude_m = f32(&r);
  out->sigma_height_m = f32(&r);
  bytes(&r, out->station_id, 4);
  out->differential_age_s = f32(&r);
  out->solution_age_s = f32(&r);
  out->satellites_tracked = u8(&r);
  out->satellites_used = u8(&r);
  out->satellites_used_L1 = u8(&r);
  out->satellites_used_multi_frequency = u8(&r);
  out->reserved = u8(&r);
  out->extended_solution_status = u8(&r);
  out->galileo_beidou_mask = u8(&r);
  out->gps_glonass_mask = u8(&r);
  return 1;
}

int novatel_get_time(const novatel_frame* frame, novatel_time* out) {
  reader r;
  if (!starts(frame, NOVATEL_TIME, TIME_BYTES, &r)) return 0;
  out->clock_status = u32(&r);
  out->offset_s = f64(&r);
  out->offset_sigma_s = f64(&r);
  out->utc_offset_s = f64(&r);
  out->year = u32(&r);
  out->month = u8(&r);
  out->day = u8(&r);
  out->hour = u8(&r);
  out->minute = u8(&r);
  out->millisecond = u32(&r);
  out->utc_status = u32(&r);
  return 1;
}

int novatel_get_rawephem(const novatel_frame* frame, novatel_rawephem* out) {
  reader r;
  if (!starts(frame, NOVATEL_RAWEPHEM, RAWEPHEM_BYTES, &r)) return 0;
  out->prn = u32(&r);
  out->reference_week = u32(&r);
  out->reference_s = u32(&r);
  bytes(&r, out->subframes, sizeof out->subframes);
  return 1;
}

int novatel_get_gpsephem(const novatel_frame* frame, novatel_gpsephem* out) {
  reader r;
  if (!starts(frame, NOVATEL_GPSEPHEM, GPSEPHEM_BYTES, &r)) return 0;
  out->prn = u32(&r);
  out->tow_s = f64(&r);
  out->health = u32(&r);
  out->iode1 = u32(&r);
  out->iode2 = u32(&r);
  out->week = u32(&r);
  out->z_week = u32(&r);
  out->toe_s = f64(&r);
  out->semi_major_axis_m = f64(&r);
  out->delta_n_radps = f64(&r);
  out->mean_anomaly_rad = f64(&r);
  out->eccentricity = f64(&r);
  out->argument_of_perigee_rad = f64(&r);
  out->cuc_rad = f64(&r);
  out->cus_rad = f64(&r);
  out->crc_m = f64(&r);
  out->crs_m = f64(&r);
  out->cic_rad = f64(&r);
  out->cis_rad = f64(&r);
  out->i0_rad = f64(&r);
  out->i_rate_radps = f64(&r);
  out->raan0_rad = f64(&r);
  out->raan_rate_radps = f64(&r);
  out->iodc = u32(&r);
  out->toc_s = f64(&r);
  out->tgd_s = f64(&r);
  out->af0_s = f64(&r);
  out->af1_sps = f64(&r);
  out->af2_sps2 = f64(&r);
  out->anti_spoofing = u32(&r);
  out->corrected_mean_motion_radps = f64(&r);
  out->ura_variance_m2 = f64(&r);
  return 1;
}

int novatel_get_ionutc(const novatel_frame* frame, novatel_ionutc* out) {
  reader r;
  if (!starts(frame, NOVATEL_IONUTC, IONUTC_BYTES, &r)) return 0;
  f64s(&r, out->alpha, 4);
  f64s(&r, out->beta, 4);
  out->utc_reference_week = u32(&r);
  out->utc_reference_s = u32(&r);
  out->A0_s = f64(&r);
  out->A1_sps = f64(&r);
  out->leap_week = u32(&r);
  out->leap_day = u32(&r);
  out->leap_seconds = i32(&r);
  out->leap_seconds_future = i32(&r);
  out->reserved = u32(&r);
  return 1;
}

int novatel_get_almanac(const novatel_frame* frame, uint32_t index, novatel_almanac_entry* out) {
  reader r;
  if (!starts_entry(frame, NOVATEL_ALMANAC, index, &r)) return 0;
  out->prn = u32(&r);
  out->week = u32(&r);
  out->toa_s = f64(&r);
  out->eccentricity = f64(&r);
  out->raan_rate_radps = f64(&r);
  out->raan0_rad = f64(&r);
  out->argument_of_perigee_rad = f64(&r);
  out->mean_anomaly_rad = f64(&r);
  out->af0_s = f64(&r);
  out->af1_sps = f64(&r);
  out->corrected_mean_motion_radps = f64(&r);
  out->semi_major_axis_m = f64(&r);
  out->delta_inclination_rad = f64(&r);
  out->configuration = u32(&r);
  out->health_6bit = u32(&r);
  out->health_8bit = u32(&r);
  out->anti_spoofing = u32(&r);
  return 1;
}

int novatel_get_version(const novatel_frame* frame, uint32_t index,
                        novatel_version_component* out) {
  reader r;
  if (!starts_entry(frame, NOVATEL_VERSION, index, &r)) return 0;
  out->type = u32(&r);
  text(&r, out->model, 16);
  text(&r, out->serial_number, 16);
  text(&r, out->hardware, 16);
  text(&r, out->software, 16);
  text(&r, out->boot, 16);
  text(&r, out->date, 12);
  text(&r, out->time, 12);
  return 1;
}
