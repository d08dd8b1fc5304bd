/* Byte layouts of the package's own messages, for ground software and tests. C89, little-endian, no
 * struct overlay, in the manner of orrery_messages.h. Times are GPS ns since 1980-01-06.
 *
 * Relative orbital elements are mean, quasi-nonsingular, scaled by the chief's semi-major axis [m]:
 *   a*da, a*dl, a*dex, a*dey, a*dix, a*diy   (D'Amico 2010; dl = du + dRAAN cos i)
 *
 *   command, ground -> deputy
 *     0 u8 opcode | 1 f64 a_roe_m[6] | 49 i64 end_ns | 57 u32 crc
 *     RECONFIGURE: be at a_roe_m at end_ns, then hold it.
 *     HALT: drop the goal and coast; same length, a_roe_m and end_ns are ignored.
 *   telemetry, deputy -> ground
 *     0 i64 t_ns | 8 u32 mode | 12 f64 a_roe_m[6] | 60 f64 sigma_m[6] | 108 f64 delta_v_mps
 *     116 u32 burns | 120 u32 updates | 124 u32 outliers | 128 u32 rejected
 *     a_roe_m and sigma_m are zero until relative navigation has started.
 *
 * crc is the common CRC-32 (zlib) of the bytes before it.
 */
#ifndef FORMATION_KEEPING_MESSAGES_H
#define FORMATION_KEEPING_MESSAGES_H

#include "orrery_crc32.h"
#include "orrery_messages.h"

#define FORMATION_COMMAND_BYTES 61u
#define FORMATION_TELEMETRY_BYTES 132u

enum { FORMATION_RECONFIGURE = 1, FORMATION_HALT = 2 };

/* What the `mode` and `telemetry` ports report. */
enum {
  FORMATION_MODE_PASSIVE = 0,       /* chief: navigates, sends, never manoeuvres */
  FORMATION_MODE_ACQUIRING = 1,     /* deputy: relative navigation has not converged */
  FORMATION_MODE_STANDBY = 2,       /* deputy: converged, no goal, coasting */
  FORMATION_MODE_RECONFIGURING = 3, /* deputy: on the way to a commanded goal */
  FORMATION_MODE_KEEPING = 4        /* deputy: holds the last goal within deadbands */
};

typedef struct formation_telemetry {
  int64_t t_ns;
  uint32_t mode;
  double a_roe_m[6], sigma_m[6];
  double delta_v_mps; /* commanded since boot */
  uint32_t burns, updates, outliers, rejected;
} formation_telemetry;

ORRERY_MAYBE_UNUSED static void formation_put_command(unsigned char* message, unsigned opcode,
                                                      const double a_roe_m[6], int64_t end_ns) {
  message[0] = (unsigned char)(opcode & 0xFFu);
  orrery_put_f64s(message + 1, a_roe_m, 6);
  orrery_put_i64(message + 49, end_ns);
  orrery_put_u32(message + 57, orrery_crc32(message, 57));
}

/* 1 if the length and the CRC are right; otherwise 0, and nothing is written. */
ORRERY_MAYBE_UNUSED static int formation_get_command(const unsigned char* message, uint32_t bytes,
                                                     unsigned* opcode, double a_roe_m[6],
                                                     int64_t* end_ns) {
  if (bytes != FORMATION_COMMAND_BYTES) return 0;
  if (orrery_get_u32(message + 57) != orrery_crc32(message, 57)) return 0;
  *opcode = message[0];
  orrery_get_f64s(message + 1, a_roe_m, 6);
  *end_ns = orrery_get_i64(message + 49);
  return 1;
}

ORRERY_MAYBE_UNUSED static void formation_put_telemetry(unsigned char* message,
                                                        const formation_telemetry* t) {
  orrery_put_i64(message, t->t_ns);
  orrery_put_u32(message + 8, t->mode);
  orrery_put_f64s(message + 12, t->a_roe_m, 6);
  orrery_put_f64s(message + 60, t->sigma_m, 6);
  orrery_put_f64(message + 108, t->delta_v_mps);
  orrery_put_u32(message + 116, t->burns);
  orrery_put_u32(message + 120, t->updates);
  orrery_put_u32(message + 124, t->outliers);
  orrery_put_u32(message + 128, t->rejected);
}

ORRERY_MAYBE_UNUSED static void formation_get_telemetry(const unsigned char* message,
                                                        formation_telemetry* t) {
  t->t_ns = orrery_get_i64(message);
  t->mode = orrery_get_u32(message + 8);
  orrery_get_f64s(message + 12, t->a_roe_m, 6);
  orrery_get_f64s(message + 60, t->sigma_m, 6);
  t->delta_v_mps = orrery_get_f64(message + 108);
  t->burns = orrery_get_u32(message + 116);
  t->updates = orrery_get_u32(message + 120);
  t->outliers = orrery_get_u32(message + 124);
  t->rejected = orrery_get_u32(message + 128);
}

#endif
