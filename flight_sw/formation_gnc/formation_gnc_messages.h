/* Byte layouts of the package's own messages: ground commands, telemetry, crosslink packets. C89,
 * little-endian, no struct overlay, in the manner of orrery_messages.h. Times are GPS ns since
 * 1980-01-06. Every message ends in the common CRC-32 (zlib) of the bytes before it. A get function
 * returns 1 if magic, version, length and CRC are right; otherwise 0, and nothing is written.
 */
/* clang-format off: tables */
/*   command, ground -> either spacecraft, 48 bytes
 *     0 u16 magic 0x4347 | 2 u8 version | 3 u8 opcode | 4 u32 number | 8 i64 t_ns | 16 i64 end_ns
 *     | 24 u8 mode | 25 u8 observations | 26 u8 every | 27 u8 0 | 28 f64 a_m | 36 f64 b_m | 44 u32
 * crc UPLOAD  adds an entry to the plan: at t_ns (0: now) request `mode`. The number names the
 * entry; one that is in the plan already is replaced, so a command may be sent twice. TRANSFER
 * arrives at end_ns on the goal that a_m and b_m name: both 0, the science orbit; else the safe
 * ellipse with a*de = (0, a_m), a*di = (0, b_m). SCIENCE observes `observations` times, in every
 * `every`-th orbit. REMOVE  takes entry `number` out of the plan, if it is there. CLEAR   empties
 * the plan and withdraws what was announced and is not committed.
 *
 *   telemetry, 408 bytes
 *     0 u16 magic 0x5447 | 2 u8 version | 3 u8 role | 4 u32 mode | 8 i64 t_ns | 16 f64 a_roe_m[6]
 *     | 64 f64 sigma_r_m[3] | 88 f64 sigma_v_mps[3] | 112 f64 delta_v_mps | 120 i64 next_event_ns
 * (0: none) | 128 f64 minimum_separation_m | 136 u32 boot_count | 140 u32 transition | 144 u32 late
 *     | 148 u32 postponed | 152 u32 rejected | 156 u32 burns | 160 u32 observations | 164 u32
 * skipped | 168 u32 retransmissions | 172 u32 fixed_ambiguities | 176 u32 plan_entries | 180 u32
 * fault | 184 u32 measurements_sent | 188 u32 measurements_heard | 192 u32 flags
 *     | 196 f64 drag_difference_mps2 | 204 graphic | 220 sdcp: innovations since boot, each u32
 *     degrees of freedom, u32 rejected, f64 sum of squares over variances; of epochs in time
 *     | 236 integers held, 12 times: u8 prn (0: none), 40-bit two's complement cycles, of single
 *     differences deputy less chief, up to what all have in common | 308 f64 nozzle_scale[6]
 *     | 356 f64 sigma_nozzle_scale[6] | 404 u32 crc
 *     flags: 1 navigation valid, 2 integers fixed, 4 partner heard, 8 transition pending.
 *
 *   crosslink packet, both ways
 *     0 u16 magic 0x4E47 | 2 u8 version | 3 u8 kind | 4 u8 role of the sender | 5 u8 0 | 6 u16 body
 * bytes | 8 u32 session, the sender's boot count | 12 u32 peer session, the receiver's boot count
 * as the sender knows it (0xFFFFFFFF: not at all) | 16 u32 acknowledged | 20 u32 committed | 24
 * body | 24 + body u32 crc acknowledged: every reliable message up to this number, of the
 * receiver's session named, has come. committed: the last transition that the leader will execute,
 * whatever happens to the link. MEASUREMENT  44 + 14 per satellite, so a packet has 240 bytes at
 * most: 0 i64 t_ns | 8 i16 q_BI[4] 2^-15 | 16 u8 satellites | 17 u8 flags, 1: solution | 18 i32
 * r_ECEF[3] cm | 30 i32 v_ECEF[3] mm/s | 42 u8 sigma_r dm | 43 u8 sigma_v cm/s then each: u8 prn |
 * u8 flags | u8 cn0 1/4 dB-Hz | u16 lock 0.1 s, saturating | u32 code cm | 40-bit two's complement
 * phase 2^-10 cycles RELIABLE     0 u32 sequence | 4 payload, at most 64 bytes ACKNOWLEDGE  no
 * body: the header says it all
 */
/* clang-format on */
#ifndef FORMATION_GNC_MESSAGES_H
#define FORMATION_GNC_MESSAGES_H

#include "orrery_crc32.h"
#include "orrery_messages.h"

#define FORMATION_GNC_VERSION 3u
#define FORMATION_GNC_COMMAND_BYTES 48u
#define FORMATION_GNC_TELEMETRY_BYTES 408u
#define FORMATION_GNC_SATELLITES 12u
#define FORMATION_GNC_HEADER_BYTES 24u
#define FORMATION_GNC_MEASUREMENT_BYTES (44u + 14u * FORMATION_GNC_SATELLITES)
#define FORMATION_GNC_PAYLOAD_BYTES 64u
#define FORMATION_GNC_PACKET_BYTES \
  (FORMATION_GNC_HEADER_BYTES + FORMATION_GNC_MEASUREMENT_BYTES + 4u)
#define FORMATION_GNC_NO_SESSION 0xFFFFFFFFu

enum {
  FORMATION_GNC_STANDBY = 0,  /* coasts on a passively safe ellipse */
  FORMATION_GNC_TRANSFER = 1, /* the deputy reconfigures towards a goal */
  FORMATION_GNC_SCIENCE = 2,  /* holds the science orbit, aligns and observes */
  FORMATION_GNC_SAFE = 3,     /* no manoeuvres until the ground says so */
  FORMATION_GNC_ESCAPE = 4    /* leaves the other's neighbourhood, then coasts */
};
enum { FORMATION_GNC_UPLOAD = 1, FORMATION_GNC_REMOVE = 2, FORMATION_GNC_CLEAR = 3 };
enum {
  FORMATION_GNC_NO_FAULT = 0,
  FORMATION_GNC_NAVIGATION_INVALID = 1,
  FORMATION_GNC_PARTNER_SILENT = 2,
  FORMATION_GNC_PROPELLANT_LOW = 3,
  FORMATION_GNC_SEPARATION = 4, /* predicted separation below the threshold */
  FORMATION_GNC_PARTNER_FAULT = 5,
  FORMATION_GNC_COMMANDED = 6
};
enum { FORMATION_GNC_MEASUREMENT = 1, FORMATION_GNC_RELIABLE = 2, FORMATION_GNC_ACKNOWLEDGE = 3 };

typedef struct formation_gnc_command {
  unsigned opcode, mode, observations, every;
  uint32_t number;
  int64_t t_ns, end_ns;
  double a_m, b_m;
} formation_gnc_command;

typedef struct formation_gnc_innovations {
  uint32_t degrees, rejected;
  double chi2;
} formation_gnc_innovations;

typedef struct formation_gnc_integer {
  unsigned prn;
  int64_t cycles;
} formation_gnc_integer;

typedef struct formation_gnc_telemetry {
  unsigned role;
  uint32_t mode;
  int64_t t_ns;
  double a_roe_m[6], sigma_r_m[3], sigma_v_mps[3];
  double delta_v_mps; /* commanded since boot */
  int64_t next_event_ns;
  double minimum_separation_m; /* radial/cross-track, predicted, less 3 sigma */
  uint32_t boot_count, transition, late, postponed, rejected, burns, observations, skipped;
  uint32_t retransmissions, fixed_ambiguities, plan_entries, fault;
  uint32_t measurements_sent, measurements_heard, flags;
  double drag_difference_mps2; /* deputy less chief, along track */
  formation_gnc_innovations graphic, sdcp;
  formation_gnc_integer integer[FORMATION_GNC_SATELLITES];
  /* of +X -X +Y -Y +Z -Z: delivered over commanded, as learnt so far */
  double nozzle_scale[6], sigma_nozzle_scale[6];
} formation_gnc_telemetry;

typedef struct formation_gnc_header {
  unsigned kind, role;
  uint32_t session, peer_session, acknowledged, committed;
  uint32_t body_bytes;
} formation_gnc_header;

typedef struct formation_gnc_satellite {
  unsigned prn, flags; /* flags as navigation defines them */
  double code_m, phase_cycles, cn0_dBHz, lock_s;
} formation_gnc_satellite;

typedef struct formation_gnc_measurement {
  int64_t t_ns;
  double q_BI[4];
  unsigned satellites;
  unsigned has_solution;
  double r_ECEF[3], v_ECEF[3], sigma_r_m, sigma_v_mps;
  formation_gnc_satellite satellite[FORMATION_GNC_SATELLITES];
} formation_gnc_measurement;

ORRERY_MAYBE_UNUSED static void formation_gnc_put_u16(unsigned char* at, unsigned value) {
  at[0] = (unsigned char)(value & 0xFFu);
  at[1] = (unsigned char)((value >> 8) & 0xFFu);
}

ORRERY_MAYBE_UNUSED static unsigned formation_gnc_get_u16(const unsigned char* at) {
  return (unsigned)at[0] | ((unsigned)at[1] << 8);
}

/* The lowest `bytes` of a number in two's complement, and back with its sign. */
ORRERY_MAYBE_UNUSED static void formation_gnc_put_int(unsigned char* at, int bytes, int64_t value) {
  unsigned char all[8];
  orrery_put_i64(all, value);
  memcpy(at, all, (size_t)bytes);
}

ORRERY_MAYBE_UNUSED static int64_t formation_gnc_get_int(const unsigned char* at, int bytes) {
  unsigned char all[8];
  memset(all, (at[bytes - 1] & 0x80u) ? 0xFF : 0, sizeof all);
  memcpy(all, at, (size_t)bytes);
  return orrery_get_i64(all);
}

ORRERY_MAYBE_UNUSED static void formation_gnc_begin(unsigned char* message, unsigned magic,
                                                    unsigned fourth) {
  formation_gnc_put_u16(message, magic);
  message[2] = (unsigned char)FORMATION_GNC_VERSION;
  message[3] = (unsigned char)(fourth & 0xFFu);
}

ORRERY_MAYBE_UNUSED static void formation_gnc_seal(unsigned char* message, uint32_t bytes) {
  orrery_put_u32(message + bytes - 4, orrery_crc32(message, bytes - 4));
}

ORRERY_MAYBE_UNUSED static int formation_gnc_is_sound(const unsigned char* message, uint32_t bytes,
                                                      unsigned magic) {
  return formation_gnc_get_u16(message) == magic && message[2] == FORMATION_GNC_VERSION &&
         orrery_get_u32(message + bytes - 4) == orrery_crc32(message, bytes - 4);
}

ORRERY_MAYBE_UNUSED static void formation_gnc_put_command(unsigned char* message,
                                                          const formation_gnc_command* c) {
  formation_gnc_begin(message, 0x4347u, c->opcode);
  orrery_put_u32(message + 4, c->number);
  orrery_put_i64(message + 8, c->t_ns);
  orrery_put_i64(message + 16, c->end_ns);
  message[24] = (unsigned char)(c->mode & 0xFFu);
  message[25] = (unsigned char)(c->observations & 0xFFu);
  message[26] = (unsigned char)(c->every & 0xFFu);
  message[27] = 0;
  orrery_put_f64(message + 28, c->a_m);
  orrery_put_f64(message + 36, c->b_m);
  formation_gnc_seal(message, FORMATION_GNC_COMMAND_BYTES);
}

ORRERY_MAYBE_UNUSED static int formation_gnc_get_command(const unsigned char* message,
                                                         uint32_t bytes, formation_gnc_command* c) {
  if (bytes != FORMATION_GNC_COMMAND_BYTES) return 0;
  if (!formation_gnc_is_sound(message, bytes, 0x4347u)) return 0;
  c->opcode = message[3];
  c->number = orrery_get_u32(message + 4);
  c->t_ns = orrery_get_i64(message + 8);
  c->end_ns = orrery_get_i64(message + 16);
  c->mode = message[24];
  c->observations = message[25];
  c->every = message[26];
  c->a_m = orrery_get_f64(message + 28);
  c->b_m = orrery_get_f64(message + 36);
  return 1;
}

ORRERY_MAYBE_UNUSED static void formation_gnc_put_innovations(unsigned char* at,
                                                              const formation_gnc_innovations* i) {
  orrery_put_u32(at, i->degrees);
  orrery_put_u32(at + 4, i->rejected);
  orrery_put_f64(at + 8, i->chi2);
}

ORRERY_MAYBE_UNUSED static void formation_gnc_get_innovations(const unsigned char* at,
                                                              formation_gnc_innovations* i) {
  i->degrees = orrery_get_u32(at);
  i->rejected = orrery_get_u32(at + 4);
  i->chi2 = orrery_get_f64(at + 8);
}

ORRERY_MAYBE_UNUSED static void formation_gnc_put_telemetry(unsigned char* message,
                                                            const formation_gnc_telemetry* t) {
  unsigned k;
  formation_gnc_begin(message, 0x5447u, t->role);
  orrery_put_u32(message + 4, t->mode);
  orrery_put_i64(message + 8, t->t_ns);
  orrery_put_f64s(message + 16, t->a_roe_m, 6);
  orrery_put_f64s(message + 64, t->sigma_r_m, 3);
  orrery_put_f64s(message + 88, t->sigma_v_mps, 3);
  orrery_put_f64(message + 112, t->delta_v_mps);
  orrery_put_i64(message + 120, t->next_event_ns);
  orrery_put_f64(message + 128, t->minimum_separation_m);
  orrery_put_u32(message + 136, t->boot_count);
  orrery_put_u32(message + 140, t->transition);
  orrery_put_u32(message + 144, t->late);
  orrery_put_u32(message + 148, t->postponed);
  orrery_put_u32(message + 152, t->rejected);
  orrery_put_u32(message + 156, t->burns);
  orrery_put_u32(message + 160, t->observations);
  orrery_put_u32(message + 164, t->skipped);
  orrery_put_u32(message + 168, t->retransmissions);
  orrery_put_u32(message + 172, t->fixed_ambiguities);
  orrery_put_u32(message + 176, t->plan_entries);
  orrery_put_u32(message + 180, t->fault);
  orrery_put_u32(message + 184, t->measurements_sent);
  orrery_put_u32(message + 188, t->measurements_heard);
  orrery_put_u32(message + 192, t->flags);
  orrery_put_f64(message + 196, t->drag_difference_mps2);
  formation_gnc_put_innovations(message + 204, &t->graphic);
  formation_gnc_put_innovations(message + 220, &t->sdcp);
  for (k = 0; k < FORMATION_GNC_SATELLITES; k++) {
    message[236 + 6 * k] = (unsigned char)(t->integer[k].prn & 0xFFu);
    formation_gnc_put_int(message + 237 + 6 * k, 5, t->integer[k].cycles);
  }
  orrery_put_f64s(message + 308, t->nozzle_scale, 6);
  orrery_put_f64s(message + 356, t->sigma_nozzle_scale, 6);
  formation_gnc_seal(message, FORMATION_GNC_TELEMETRY_BYTES);
}

ORRERY_MAYBE_UNUSED static int formation_gnc_get_telemetry(const unsigned char* message,
                                                           uint32_t bytes,
                                                           formation_gnc_telemetry* t) {
  unsigned k;
  if (bytes != FORMATION_GNC_TELEMETRY_BYTES) return 0;
  if (!formation_gnc_is_sound(message, bytes, 0x5447u)) return 0;
  t->role = message[3];
  t->mode = orrery_get_u32(message + 4);
  t->t_ns = orrery_get_i64(message + 8);
  orrery_get_f64s(message + 16, t->a_roe_m, 6);
  orrery_get_f64s(message + 64, t->sigma_r_m, 3);
  orrery_get_f64s(message + 88, t->sigma_v_mps, 3);
  t->delta_v_mps = orrery_get_f64(message + 112);
  t->next_event_ns = orrery_get_i64(message + 120);
  t->minimum_separation_m = orrery_get_f64(message + 128);
  t->boot_count = orrery_get_u32(message + 136);
  t->transition = orrery_get_u32(message + 140);
  t->late = orrery_get_u32(message + 144);
  t->postponed = orrery_get_u32(message + 148);
  t->rejected = orrery_get_u32(message + 152);
  t->burns = orrery_get_u32(message + 156);
  t->observations = orrery_get_u32(message + 160);
  t->skipped = orrery_get_u32(message + 164);
  t->retransmissions = orrery_get_u32(message + 168);
  t->fixed_ambiguities = orrery_get_u32(message + 172);
  t->plan_entries = orrery_get_u32(message + 176);
  t->fault = orrery_get_u32(message + 180);
  t->measurements_sent = orrery_get_u32(message + 184);
  t->measurements_heard = orrery_get_u32(message + 188);
  t->flags = orrery_get_u32(message + 192);
  t->drag_difference_mps2 = orrery_get_f64(message + 196);
  formation_gnc_get_innovations(message + 204, &t->graphic);
  formation_gnc_get_innovations(message + 220, &t->sdcp);
  for (k = 0; k < FORMATION_GNC_SATELLITES; k++) {
    t->integer[k].prn = message[236 + 6 * k];
    t->integer[k].cycles = formation_gnc_get_int(message + 237 + 6 * k, 5);
  }
  orrery_get_f64s(message + 308, t->nozzle_scale, 6);
  orrery_get_f64s(message + 356, t->sigma_nozzle_scale, 6);
  return 1;
}

/* The body stands at message + FORMATION_GNC_HEADER_BYTES already. Returns the packet's length. */
ORRERY_MAYBE_UNUSED static uint32_t formation_gnc_put_packet(unsigned char* message,
                                                             const formation_gnc_header* h) {
  const uint32_t bytes = FORMATION_GNC_HEADER_BYTES + h->body_bytes + 4;
  formation_gnc_begin(message, 0x4E47u, h->kind);
  message[4] = (unsigned char)(h->role & 0xFFu);
  message[5] = 0;
  formation_gnc_put_u16(message + 6, h->body_bytes);
  orrery_put_u32(message + 8, h->session);
  orrery_put_u32(message + 12, h->peer_session);
  orrery_put_u32(message + 16, h->acknowledged);
  orrery_put_u32(message + 20, h->committed);
  formation_gnc_seal(message, bytes);
  return bytes;
}

ORRERY_MAYBE_UNUSED static int formation_gnc_get_packet(const unsigned char* message,
                                                        uint32_t bytes, formation_gnc_header* h) {
  if (bytes < FORMATION_GNC_HEADER_BYTES + 4 || bytes > FORMATION_GNC_PACKET_BYTES) return 0;
  if (formation_gnc_get_u16(message + 6) != bytes - FORMATION_GNC_HEADER_BYTES - 4) return 0;
  if (!formation_gnc_is_sound(message, bytes, 0x4E47u)) return 0;
  h->kind = message[3];
  h->role = message[4];
  h->body_bytes = bytes - FORMATION_GNC_HEADER_BYTES - 4;
  h->session = orrery_get_u32(message + 8);
  h->peer_session = orrery_get_u32(message + 12);
  h->acknowledged = orrery_get_u32(message + 16);
  h->committed = orrery_get_u32(message + 20);
  return 1;
}

/* To the nearest unit, and to the end of the range beyond it; 0 for what is not a number. */
ORRERY_MAYBE_UNUSED static int64_t formation_gnc_quantised(double value, double unit, double low,
                                                           double high) {
  const double scaled = value / unit;
  if (scaled != scaled) return 0;
  if (scaled <= low) return (int64_t)low;
  if (scaled >= high) return (int64_t)high;
  return (int64_t)(scaled < 0 ? scaled - 0.5 : scaled + 0.5);
}

/* Writes at most FORMATION_GNC_SATELLITES and returns the bytes of the body. */
ORRERY_MAYBE_UNUSED static uint32_t formation_gnc_put_measurement(
    unsigned char* body, const formation_gnc_measurement* m) {
  const double i32 = 2147483647.0;
  unsigned char* at = body + 44;
  unsigned k;
  orrery_put_i64(body, m->t_ns);
  for (k = 0; k < 4; k++) {
    formation_gnc_put_int(body + 8 + 2 * k, 2,
                          formation_gnc_quantised(m->q_BI[k], 1.0 / 32768.0, -32767.0, 32767.0));
  }
  body[16] = (unsigned char)m->satellites;
  body[17] = (unsigned char)(m->has_solution ? 1 : 0);
  for (k = 0; k < 3; k++) {
    const double r = m->has_solution ? m->r_ECEF[k] : 0.0;
    const double v = m->has_solution ? m->v_ECEF[k] : 0.0;
    formation_gnc_put_int(body + 18 + 4 * k, 4, formation_gnc_quantised(r, 0.01, -i32, i32));
    formation_gnc_put_int(body + 30 + 4 * k, 4, formation_gnc_quantised(v, 0.001, -i32, i32));
  }
  body[42] = (unsigned char)formation_gnc_quantised(m->sigma_r_m, 0.1, 0.0, 255.0);
  body[43] = (unsigned char)formation_gnc_quantised(m->sigma_v_mps, 0.01, 0.0, 255.0);
  for (k = 0; k < m->satellites; k++, at += 14) {
    const formation_gnc_satellite* s = &m->satellite[k];
    at[0] = (unsigned char)s->prn;
    at[1] = (unsigned char)s->flags;
    at[2] = (unsigned char)formation_gnc_quantised(s->cn0_dBHz, 0.25, 0.0, 255.0);
    formation_gnc_put_u16(at + 3, (unsigned)formation_gnc_quantised(s->lock_s, 0.1, 0.0, 65535.0));
    orrery_put_u32(at + 5, (uint32_t)formation_gnc_quantised(s->code_m, 0.01, 0.0, 4294967295.0));
    formation_gnc_put_int(
        at + 9, 5,
        formation_gnc_quantised(s->phase_cycles, 1.0 / 1024.0, -549755813887.0, 549755813887.0));
  }
  return 44u + 14u * m->satellites;
}

/* 1 if the length fits the number of satellites and t_ns is after 1980. */
ORRERY_MAYBE_UNUSED static int formation_gnc_get_measurement(const unsigned char* body,
                                                             uint32_t bytes,
                                                             formation_gnc_measurement* m) {
  const unsigned char* at = body + 44;
  unsigned k;
  if (bytes < 44u || body[16] > FORMATION_GNC_SATELLITES || bytes != 44u + 14u * body[16]) return 0;
  if (orrery_get_i64(body) <= 0) return 0;
  m->t_ns = orrery_get_i64(body);
  m->satellites = body[16];
  m->has_solution = body[17] & 1u;
  for (k = 0; k < 4; k++) m->q_BI[k] = (double)formation_gnc_get_int(body + 8 + 2 * k, 2) / 32768.0;
  for (k = 0; k < 3; k++) {
    m->r_ECEF[k] = 0.01 * (double)formation_gnc_get_int(body + 18 + 4 * k, 4);
    m->v_ECEF[k] = 0.001 * (double)formation_gnc_get_int(body + 30 + 4 * k, 4);
  }
  m->sigma_r_m = 0.1 * body[42];
  m->sigma_v_mps = 0.01 * body[43];
  for (k = 0; k < m->satellites; k++, at += 14) {
    formation_gnc_satellite* s = &m->satellite[k];
    s->prn = at[0];
    s->flags = at[1];
    s->cn0_dBHz = 0.25 * at[2];
    s->lock_s = 0.1 * formation_gnc_get_u16(at + 3);
    s->code_m = 0.01 * (double)orrery_get_u32(at + 5);
    s->phase_cycles = (double)formation_gnc_get_int(at + 9, 5) / 1024.0;
  }
  return 1;
}

#endif
