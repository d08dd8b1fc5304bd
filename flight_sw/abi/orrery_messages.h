/* Byte layouts of the messages that Orrery's ready devices understand. C89, little-endian, no
 * struct overlay: each message has a size, a put and a get function. Times are ns of the onboard
 * clock (GPS scale). Teams with formats of their own pass a translator to connect() in the test
 * instead. */

/* clang-format off: a table */
/*   message           layout                                                     direction
 *   thruster          0 i64 mid_burn_ns | 8 f64 dv_ECI[3] m/s (EME2000)          flight -> device
 *                     at least 20 s before the middle of the burn
 *   thruster_on_time  0 i64 start_ns | 8 u8 nozzle | 9 f64 duration_s            flight -> device
 *   bus               0 i64 t_ns | 8 f64 q_BI[4] (w first)                       device -> flight
 *                     | 40 f64 omega_BI_B[3] rad/s
 *                     | 64 f64 on_time_s[6], commanded, since boot, per nozzle
 *   estimate          0 i64 t_ns | 8 f64 r_DC_RTN[3] m | 32 f64 v_DC_RTN[3] m/s  flight -> test
 *                     | 56 f64 sigma_r[3] m | 80 f64 sigma_v[3] m/s
 *                     deputy relative to chief in the chief's RTN, derivative taken in RTN,
 *                     whichever spacecraft sends it
 *   observation       0 i64 begin_ns | 8 i64 end_ns                              flight -> test
 *   image             0 u32 frame | 4 u16 width | 6 u16 height | 8 u16 first_row   device -> flight
 *                     | 10 u16 rows | 12 u8 bits | 13 u8 0 | 14 u16 0
 *                     | 16 i64 exposure_begin_ns, of the first row of the frame
 *                     | 24 f64 exposure_s | 32 f64 row_period_s, 0: global shutter
 *                     | 40 f64 gain electrons/DN | 48 f64 offset DN
 *                     | 56 f64 fx, fy, cx, cy px, k1, k2, p1, p2, k3 (OpenCV's order; (0, 0) is
 *                     the centre of the first pixel), as calibrated on the ground
 *                     | 128 u16 pixels DN, row by row; v down from first_row, u to the right
 *   expose            0 i64 begin_ns | 8 f64 exposure_s, 0: as configured        flight -> device
 *   mode              0 i64 t_ns | 8 u32 mode, the package's own number          flight -> test
 *   command           the team's own bytes, exactly as the ground sent them      device -> flight
 */
/* clang-format on */
#ifndef ORRERY_MESSAGES_H
#define ORRERY_MESSAGES_H

#include <stdint.h>
#include <string.h>

#define ORRERY_THRUSTER_BYTES 32u
#define ORRERY_THRUSTER_ON_TIME_BYTES 17u
#define ORRERY_BUS_BYTES 112u
#define ORRERY_ESTIMATE_BYTES 104u
#define ORRERY_OBSERVATION_BYTES 16u
#define ORRERY_MODE_BYTES 12u
#define ORRERY_IMAGE_HEADER_BYTES 128u /* 2 bytes per pixel follow */
#define ORRERY_EXPOSE_BYTES 16u

#if defined(__GNUC__)
#define ORRERY_MAYBE_UNUSED __attribute__((unused))
#else
#define ORRERY_MAYBE_UNUSED
#endif

ORRERY_MAYBE_UNUSED static void orrery_put_u32(unsigned char* at, uint32_t value) {
  int i;
  for (i = 0; i < 4; i++) at[i] = (unsigned char)((value >> (8 * i)) & 0xFFu);
}

ORRERY_MAYBE_UNUSED static uint32_t orrery_get_u32(const unsigned char* at) {
  uint32_t value = 0;
  int i;
  for (i = 3; i >= 0; i--) value = (value << 8) | at[i];
  return value;
}

ORRERY_MAYBE_UNUSED static void orrery_put_u16(unsigned char* at, unsigned value) {
  at[0] = (unsigned char)(value & 0xFFu);
  at[1] = (unsigned char)((value >> 8) & 0xFFu);
}

ORRERY_MAYBE_UNUSED static unsigned orrery_get_u16(const unsigned char* at) {
  return (unsigned)at[0] | ((unsigned)at[1] << 8);
}

ORRERY_MAYBE_UNUSED static void orrery_put_i64(unsigned char* at, int64_t value) {
  uint64_t bits = (uint64_t)value;
  int i;
  for (i = 0; i < 8; i++) at[i] = (unsigned char)((bits >> (8 * i)) & 0xFFu);
}

ORRERY_MAYBE_UNUSED static int64_t orrery_get_i64(const unsigned char* at) {
  uint64_t bits = 0;
  int64_t value;
  int i;
  for (i = 7; i >= 0; i--) bits = (bits << 8) | at[i];
  memcpy(&value, &bits, sizeof value);
  return value;
}

ORRERY_MAYBE_UNUSED static void orrery_put_f64(unsigned char* at, double value) {
  int64_t bits;
  memcpy(&bits, &value, sizeof bits);
  orrery_put_i64(at, bits);
}

ORRERY_MAYBE_UNUSED static double orrery_get_f64(const unsigned char* at) {
  int64_t bits = orrery_get_i64(at);
  double value;
  memcpy(&value, &bits, sizeof value);
  return value;
}

ORRERY_MAYBE_UNUSED static void orrery_put_f64s(unsigned char* at, const double* values,
                                                int count) {
  int i;
  for (i = 0; i < count; i++) orrery_put_f64(at + 8 * i, values[i]);
}

ORRERY_MAYBE_UNUSED static void orrery_get_f64s(const unsigned char* at, double* values,
                                                int count) {
  int i;
  for (i = 0; i < count; i++) values[i] = orrery_get_f64(at + 8 * i);
}

ORRERY_MAYBE_UNUSED static void orrery_put_thruster(unsigned char* message, int64_t mid_burn_ns,
                                                    const double dv_ECI[3]) {
  orrery_put_i64(message, mid_burn_ns);
  orrery_put_f64s(message + 8, dv_ECI, 3);
}

ORRERY_MAYBE_UNUSED static void orrery_get_thruster(const unsigned char* message,
                                                    int64_t* mid_burn_ns, double dv_ECI[3]) {
  *mid_burn_ns = orrery_get_i64(message);
  orrery_get_f64s(message + 8, dv_ECI, 3);
}

ORRERY_MAYBE_UNUSED static void orrery_put_thruster_on_time(unsigned char* message,
                                                            int64_t start_ns, unsigned nozzle,
                                                            double duration_s) {
  orrery_put_i64(message, start_ns);
  message[8] = (unsigned char)(nozzle & 0xFFu);
  orrery_put_f64(message + 9, duration_s);
}

ORRERY_MAYBE_UNUSED static void orrery_get_thruster_on_time(const unsigned char* message,
                                                            int64_t* start_ns, unsigned* nozzle,
                                                            double* duration_s) {
  *start_ns = orrery_get_i64(message);
  *nozzle = message[8];
  *duration_s = orrery_get_f64(message + 9);
}

ORRERY_MAYBE_UNUSED static void orrery_put_bus(unsigned char* message, int64_t t_ns,
                                               const double q_BI[4], const double omega_BI_B[3],
                                               const double on_time_s[6]) {
  orrery_put_i64(message, t_ns);
  orrery_put_f64s(message + 8, q_BI, 4);
  orrery_put_f64s(message + 40, omega_BI_B, 3);
  orrery_put_f64s(message + 64, on_time_s, 6);
}

ORRERY_MAYBE_UNUSED static void orrery_get_bus(const unsigned char* message, int64_t* t_ns,
                                               double q_BI[4], double omega_BI_B[3],
                                               double on_time_s[6]) {
  *t_ns = orrery_get_i64(message);
  orrery_get_f64s(message + 8, q_BI, 4);
  orrery_get_f64s(message + 40, omega_BI_B, 3);
  orrery_get_f64s(message + 64, on_time_s, 6);
}

ORRERY_MAYBE_UNUSED static void orrery_put_estimate(unsigned char* message, int64_t t_ns,
                                                    const double r_DC_RTN[3],
                                                    const double v_DC_RTN[3],
                                                    const double sigma_r[3],
                                                    const double sigma_v[3]) {
  orrery_put_i64(message, t_ns);
  orrery_put_f64s(message + 8, r_DC_RTN, 3);
  orrery_put_f64s(message + 32, v_DC_RTN, 3);
  orrery_put_f64s(message + 56, sigma_r, 3);
  orrery_put_f64s(message + 80, sigma_v, 3);
}

ORRERY_MAYBE_UNUSED static void orrery_get_estimate(const unsigned char* message, int64_t* t_ns,
                                                    double r_DC_RTN[3], double v_DC_RTN[3],
                                                    double sigma_r[3], double sigma_v[3]) {
  *t_ns = orrery_get_i64(message);
  orrery_get_f64s(message + 8, r_DC_RTN, 3);
  orrery_get_f64s(message + 32, v_DC_RTN, 3);
  orrery_get_f64s(message + 56, sigma_r, 3);
  orrery_get_f64s(message + 80, sigma_v, 3);
}

ORRERY_MAYBE_UNUSED static void orrery_put_observation(unsigned char* message, int64_t begin_ns,
                                                       int64_t end_ns) {
  orrery_put_i64(message, begin_ns);
  orrery_put_i64(message + 8, end_ns);
}

ORRERY_MAYBE_UNUSED static void orrery_get_observation(const unsigned char* message,
                                                       int64_t* begin_ns, int64_t* end_ns) {
  *begin_ns = orrery_get_i64(message);
  *end_ns = orrery_get_i64(message + 8);
}

ORRERY_MAYBE_UNUSED static void orrery_put_mode(unsigned char* message, int64_t t_ns,
                                                uint32_t mode) {
  orrery_put_i64(message, t_ns);
  orrery_put_u32(message + 8, mode);
}

ORRERY_MAYBE_UNUSED static void orrery_get_mode(const unsigned char* message, int64_t* t_ns,
                                                uint32_t* mode) {
  *t_ns = orrery_get_i64(message);
  *mode = orrery_get_u32(message + 8);
}

/* What stands before the pixels of an image, or of a band of its rows. */
struct orrery_image {
  uint32_t frame; /* counts exposures since power-on, from 1; a lost one leaves a gap */
  unsigned width, height, first_row, rows;
  unsigned bits;
  int64_t exposure_begin_ns;
  double exposure_s, row_period_s;
  double gain, offset;
  double fx_fy_cx_cy[4], k1_k2_p1_p2_k3[5];
};

ORRERY_MAYBE_UNUSED static void orrery_put_image_header(unsigned char* message,
                                                        const struct orrery_image* image) {
  orrery_put_u32(message, image->frame);
  orrery_put_u16(message + 4, image->width);
  orrery_put_u16(message + 6, image->height);
  orrery_put_u16(message + 8, image->first_row);
  orrery_put_u16(message + 10, image->rows);
  orrery_put_u32(message + 12, image->bits & 0xFFu);
  orrery_put_i64(message + 16, image->exposure_begin_ns);
  orrery_put_f64(message + 24, image->exposure_s);
  orrery_put_f64(message + 32, image->row_period_s);
  orrery_put_f64(message + 40, image->gain);
  orrery_put_f64(message + 48, image->offset);
  orrery_put_f64s(message + 56, image->fx_fy_cx_cy, 4);
  orrery_put_f64s(message + 88, image->k1_k2_p1_p2_k3, 5);
}

/* Returns 1, or 0 where `length` is not that of such a message; then nothing is written. Pixel (u,
 * v), v in first_row ... first_row + rows - 1, is orrery_get_u16(message +
 * ORRERY_IMAGE_HEADER_BYTES + 2 * ((v - first_row) * width + u)). */
ORRERY_MAYBE_UNUSED static int orrery_get_image_header(const unsigned char* message,
                                                       uint32_t length,
                                                       struct orrery_image* image) {
  if (length < ORRERY_IMAGE_HEADER_BYTES ||
      length != ORRERY_IMAGE_HEADER_BYTES +
                    (uint32_t)2 * orrery_get_u16(message + 4) * orrery_get_u16(message + 10)) {
    return 0;
  }
  image->frame = orrery_get_u32(message);
  image->width = orrery_get_u16(message + 4);
  image->height = orrery_get_u16(message + 6);
  image->first_row = orrery_get_u16(message + 8);
  image->rows = orrery_get_u16(message + 10);
  image->bits = message[12];
  image->exposure_begin_ns = orrery_get_i64(message + 16);
  image->exposure_s = orrery_get_f64(message + 24);
  image->row_period_s = orrery_get_f64(message + 32);
  image->gain = orrery_get_f64(message + 40);
  image->offset = orrery_get_f64(message + 48);
  orrery_get_f64s(message + 56, image->fx_fy_cx_cy, 4);
  orrery_get_f64s(message + 88, image->k1_k2_p1_p2_k3, 5);
  return 1;
}

ORRERY_MAYBE_UNUSED static void orrery_put_expose(unsigned char* message, int64_t begin_ns,
                                                  double exposure_s) {
  orrery_put_i64(message, begin_ns);
  orrery_put_f64(message + 8, exposure_s);
}

ORRERY_MAYBE_UNUSED static void orrery_get_expose(const unsigned char* message, int64_t* begin_ns,
                                                  double* exposure_s) {
  *begin_ns = orrery_get_i64(message);
  *exposure_s = orrery_get_f64(message + 8);
}

#endif
