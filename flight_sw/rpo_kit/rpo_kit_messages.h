/* Byte layouts of the package's own messages, for ground software and tests. C89, little-endian, no
 * struct overlay, in the manner of orrery_messages.h. Times are GPS ns since 1980-01-06.
 *
 *   command, ground -> chaser      0 u8 order (RPO_KIT_GO, _HOLD, _ABORT) | 1 u32 crc
 *   bearing, a processor of images -> chaser: where the target is among the stars
 *     0 i64 exposure_ns, of its middle | 8 f64 direction_ECI[3], a unit vector, geometric
 *     | 32 f64 sigma_rad, per axis
 *   observation, a second observer -> chaser over a crosslink: where the target was seen, and from
 *   where. May be late, doubled, overtaken or lost: each stands for itself, by its time.
 *     0 i64 exposure_ns, of its middle | 8 f64 r_ECI[3] m, of the observer then
 *     | 32 f64 covariance_ECI[6] m^2: xx, xy, xz, yy, yz, zz | 80 f64 direction_ECI[3], a unit
 *     vector, geometric | 104 f64 sigma_rad, per axis | 112 u32 crc
 *   keypoints, a processor of images -> chaser
 *     0 i64 exposure_ns, of its middle | 8 f64 q_CI[4], the camera's attitude
 *     | 40 f64 attitude_sigma_rad, per axis | 48 u32 count, at most 32
 *     | 52 per keypoint: u32 point, f64 u px, f64 v px, f64 sigma px
 *   view, camera on the target -> chaser
 *     0 f64 q_CI[4], the camera's attitude in the middle of the exposure
 *     | 32 f64 attitude_sigma_rad, per axis | 40 `image` of orrery_messages.h, all rows
 *   target, chaser -> ground and payloads: how the target is turned
 *     0 i64 t_ns | 8 f64 q_BI[4] | 40 f64 omega_BI_B[3] rad/s | 64 f64 sigma_rad[3], about B
 *     | 88 u32 poses, flips, rejected, lost: of the near-range filter, since boot
 *   imaging, chaser -> ground: what a frame of the camera gave
 *     0 i64 exposure_ns, of its middle | 8 u32 found: RPO_KIT_FOUND_ATTITUDE, _LOST (looked for
 *     without a prediction), _TARGET | 12 u32 sources, identified as stars
 *     | 20 f64 q_CI[4], the camera's attitude | 52 f64 attitude_sigma_rad[3], about C
 *     | 76 f64 direction_ECI[3] of the target | 100 f64 sigma_rad, per axis
 *     | 108 f64 u, v px of the target; zero where not found
 *   telemetry, chaser -> ground
 *     0 i64 t_ns | 8 u32 mode | 12 u32 waypoint | 16 f64 a_roe_m[6] | 64 f64 sigma_m[6]
 *     | 112 f64 delta_v_mps | 120 u32 burns | 124 u32 used[3]: GNSS, directions, poses
 *     | 136 u32 outliers | 140 u32 restarts | 144 u32 rejected
 *     | 148 u32 used of the second observer
 *     a_roe of the chaser relative to the target, mean, order da, dl, dex, dey, dix, diy; zero
 *     while there is no estimate.
 *
 * crc is the common CRC-32 (zlib) of the bytes before it. Modes: rpo_kit/mission/autonomy.hpp.
 */
#ifndef RPO_KIT_MESSAGES_H
#define RPO_KIT_MESSAGES_H

#include "orrery_crc32.h"
#include "orrery_messages.h"

#define RPO_KIT_COMMAND_BYTES 5u
#define RPO_KIT_TELEMETRY_BYTES 152u
#define RPO_KIT_KEYPOINT_BYTES 28u
#define RPO_KIT_MOST_KEYPOINTS 32u
#define RPO_KIT_KEYPOINTS_HEAD_BYTES 52u
#define RPO_KIT_KEYPOINTS_BYTES \
  (RPO_KIT_KEYPOINTS_HEAD_BYTES + RPO_KIT_MOST_KEYPOINTS * RPO_KIT_KEYPOINT_BYTES)
#define RPO_KIT_BEARING_BYTES 40u
#define RPO_KIT_VIEW_HEAD_BYTES 40u
#define RPO_KIT_OBSERVATION_BYTES 116u
#define RPO_KIT_TARGET_BYTES 104u
#define RPO_KIT_IMAGING_BYTES 124u

enum { RPO_KIT_FOUND_ATTITUDE = 1, RPO_KIT_FOUND_LOST = 2, RPO_KIT_FOUND_TARGET = 4 };

enum { RPO_KIT_GO = 1, RPO_KIT_HOLD = 2, RPO_KIT_ABORT = 3 };

enum {
  RPO_KIT_MODE_STANDBY = 0,
  RPO_KIT_MODE_ACQUIRING = 1,
  RPO_KIT_MODE_APPROACHING = 2,
  RPO_KIT_MODE_INSPECTING = 3,
  RPO_KIT_MODE_HOLDING = 4,
  RPO_KIT_MODE_ABORTING = 5,
  RPO_KIT_MODE_SAFE = 6
};

typedef struct rpo_kit_telemetry {
  int64_t t_ns;
  uint32_t mode, waypoint;
  double a_roe_m[6], sigma_m[6];
  double delta_v_mps; /* commanded since boot */
  uint32_t burns, used[3], outliers, restarts, rejected, used_second;
} rpo_kit_telemetry;

ORRERY_MAYBE_UNUSED static void rpo_kit_put_command(unsigned char* message, unsigned order) {
  message[0] = (unsigned char)(order & 0xFFu);
  orrery_put_u32(message + 1, orrery_crc32(message, 1));
}

/* 1 if the length, the CRC and the order are right; otherwise 0, and nothing is written. */
ORRERY_MAYBE_UNUSED static int rpo_kit_get_command(const unsigned char* message, uint32_t bytes,
                                                   unsigned* order) {
  if (bytes != RPO_KIT_COMMAND_BYTES) return 0;
  if (orrery_get_u32(message + 1) != orrery_crc32(message, 1)) return 0;
  if (message[0] < RPO_KIT_GO || message[0] > RPO_KIT_ABORT) return 0;
  *order = message[0];
  return 1;
}

ORRERY_MAYBE_UNUSED static void rpo_kit_put_telemetry(unsigned char* message,
                                                      const rpo_kit_telemetry* t) {
  int i;
  orrery_put_i64(message, t->t_ns);
  orrery_put_u32(message + 8, t->mode);
  orrery_put_u32(message + 12, t->waypoint);
  orrery_put_f64s(message + 16, t->a_roe_m, 6);
  orrery_put_f64s(message + 64, t->sigma_m, 6);
  orrery_put_f64(message + 112, t->delta_v_mps);
  orrery_put_u32(message + 120, t->burns);
  for (i = 0; i < 3; i++) orrery_put_u32(message + 124 + 4 * i, t->used[i]);
  orrery_put_u32(message + 136, t->outliers);
  orrery_put_u32(message + 140, t->restarts);
  orrery_put_u32(message + 144, t->rejected);
  orrery_put_u32(message + 148, t->used_second);
}

/* 1 if the length is right; otherwise 0, and nothing is written. */
ORRERY_MAYBE_UNUSED static int rpo_kit_get_telemetry(const unsigned char* message, uint32_t bytes,
                                                     rpo_kit_telemetry* t) {
  int i;
  if (bytes != RPO_KIT_TELEMETRY_BYTES) return 0;
  t->t_ns = orrery_get_i64(message);
  t->mode = orrery_get_u32(message + 8);
  t->waypoint = orrery_get_u32(message + 12);
  orrery_get_f64s(message + 16, t->a_roe_m, 6);
  orrery_get_f64s(message + 64, t->sigma_m, 6);
  t->delta_v_mps = orrery_get_f64(message + 112);
  t->burns = orrery_get_u32(message + 120);
  for (i = 0; i < 3; i++) t->used[i] = orrery_get_u32(message + 124 + 4 * i);
  t->outliers = orrery_get_u32(message + 136);
  t->restarts = orrery_get_u32(message + 140);
  t->rejected = orrery_get_u32(message + 144);
  t->used_second = orrery_get_u32(message + 148);
  return 1;
}

typedef struct rpo_kit_bearing {
  int64_t exposure_ns;
  double direction_ECI[3], sigma_rad;
} rpo_kit_bearing;

typedef struct rpo_kit_observation {
  int64_t exposure_ns;
  double r_ECI[3], covariance_ECI[6], direction_ECI[3], sigma_rad;
} rpo_kit_observation;

typedef struct rpo_kit_keypoint {
  uint32_t point;
  double u_px, v_px, sigma_px;
} rpo_kit_keypoint;

typedef struct rpo_kit_keypoints {
  int64_t exposure_ns;
  double q_CI[4], attitude_sigma_rad;
  uint32_t count;
  rpo_kit_keypoint seen[RPO_KIT_MOST_KEYPOINTS];
} rpo_kit_keypoints;

typedef struct rpo_kit_target {
  int64_t t_ns;
  double q_BI[4], omega_BI_B[3], sigma_rad[3];
  uint32_t poses, flips, rejected, lost;
} rpo_kit_target;

typedef struct rpo_kit_imaging {
  int64_t exposure_ns;
  uint32_t found, sources, identified;
  double q_CI[4], attitude_sigma_rad[3];
  double direction_ECI[3], sigma_rad, u_px, v_px;
} rpo_kit_imaging;

ORRERY_MAYBE_UNUSED static void rpo_kit_put_imaging(unsigned char* message,
                                                    const rpo_kit_imaging* r) {
  orrery_put_i64(message, r->exposure_ns);
  orrery_put_u32(message + 8, r->found);
  orrery_put_u32(message + 12, r->sources);
  orrery_put_u32(message + 16, r->identified);
  orrery_put_f64s(message + 20, r->q_CI, 4);
  orrery_put_f64s(message + 52, r->attitude_sigma_rad, 3);
  orrery_put_f64s(message + 76, r->direction_ECI, 3);
  orrery_put_f64(message + 100, r->sigma_rad);
  orrery_put_f64(message + 108, r->u_px);
  orrery_put_f64(message + 116, r->v_px);
}

/* 1 if the length is right; otherwise 0, and nothing is written. */
ORRERY_MAYBE_UNUSED static int rpo_kit_get_imaging(const unsigned char* message, uint32_t bytes,
                                                   rpo_kit_imaging* r) {
  if (bytes != RPO_KIT_IMAGING_BYTES) return 0;
  r->exposure_ns = orrery_get_i64(message);
  r->found = orrery_get_u32(message + 8);
  r->sources = orrery_get_u32(message + 12);
  r->identified = orrery_get_u32(message + 16);
  orrery_get_f64s(message + 20, r->q_CI, 4);
  orrery_get_f64s(message + 52, r->attitude_sigma_rad, 3);
  orrery_get_f64s(message + 76, r->direction_ECI, 3);
  r->sigma_rad = orrery_get_f64(message + 100);
  r->u_px = orrery_get_f64(message + 108);
  r->v_px = orrery_get_f64(message + 116);
  return 1;
}

ORRERY_MAYBE_UNUSED static void rpo_kit_put_bearing(unsigned char* message,
                                                    const rpo_kit_bearing* b) {
  orrery_put_i64(message, b->exposure_ns);
  orrery_put_f64s(message + 8, b->direction_ECI, 3);
  orrery_put_f64(message + 32, b->sigma_rad);
}

/* 1 if the length is right; otherwise 0, and nothing is written. */
ORRERY_MAYBE_UNUSED static int rpo_kit_get_bearing(const unsigned char* message, uint32_t bytes,
                                                   rpo_kit_bearing* b) {
  if (bytes != RPO_KIT_BEARING_BYTES) return 0;
  b->exposure_ns = orrery_get_i64(message);
  orrery_get_f64s(message + 8, b->direction_ECI, 3);
  b->sigma_rad = orrery_get_f64(message + 32);
  return 1;
}

ORRERY_MAYBE_UNUSED static void rpo_kit_put_observation(unsigned char* message,
                                                        const rpo_kit_observation* o) {
  orrery_put_i64(message, o->exposure_ns);
  orrery_put_f64s(message + 8, o->r_ECI, 3);
  orrery_put_f64s(message + 32, o->covariance_ECI, 6);
  orrery_put_f64s(message + 80, o->direction_ECI, 3);
  orrery_put_f64(message + 104, o->sigma_rad);
  orrery_put_u32(message + 112, orrery_crc32(message, 112));
}

/* 1 if the length and the CRC are right; otherwise 0, and nothing is written. */
ORRERY_MAYBE_UNUSED static int rpo_kit_get_observation(const unsigned char* message, uint32_t bytes,
                                                       rpo_kit_observation* o) {
  if (bytes != RPO_KIT_OBSERVATION_BYTES) return 0;
  if (orrery_get_u32(message + 112) != orrery_crc32(message, 112)) return 0;
  o->exposure_ns = orrery_get_i64(message);
  orrery_get_f64s(message + 8, o->r_ECI, 3);
  orrery_get_f64s(message + 32, o->covariance_ECI, 6);
  orrery_get_f64s(message + 80, o->direction_ECI, 3);
  o->sigma_rad = orrery_get_f64(message + 104);
  return 1;
}

/* The length of the message. */
ORRERY_MAYBE_UNUSED static uint32_t rpo_kit_put_keypoints(unsigned char* message,
                                                          const rpo_kit_keypoints* k) {
  unsigned char* at = message + RPO_KIT_KEYPOINTS_HEAD_BYTES;
  uint32_t i;
  orrery_put_i64(message, k->exposure_ns);
  orrery_put_f64s(message + 8, k->q_CI, 4);
  orrery_put_f64(message + 40, k->attitude_sigma_rad);
  orrery_put_u32(message + 48, k->count);
  for (i = 0; i < k->count; i++, at += RPO_KIT_KEYPOINT_BYTES) {
    orrery_put_u32(at, k->seen[i].point);
    orrery_put_f64(at + 4, k->seen[i].u_px);
    orrery_put_f64(at + 12, k->seen[i].v_px);
    orrery_put_f64(at + 20, k->seen[i].sigma_px);
  }
  return RPO_KIT_KEYPOINTS_HEAD_BYTES + k->count * RPO_KIT_KEYPOINT_BYTES;
}

/* 1 if the length and the count are right; otherwise 0, and nothing is written. */
ORRERY_MAYBE_UNUSED static int rpo_kit_get_keypoints(const unsigned char* message, uint32_t bytes,
                                                     rpo_kit_keypoints* k) {
  const unsigned char* at = message + RPO_KIT_KEYPOINTS_HEAD_BYTES;
  uint32_t i, count;
  if (bytes < RPO_KIT_KEYPOINTS_HEAD_BYTES) return 0;
  count = orrery_get_u32(message + 48);
  if (count > RPO_KIT_MOST_KEYPOINTS) return 0;
  if (bytes != RPO_KIT_KEYPOINTS_HEAD_BYTES + count * RPO_KIT_KEYPOINT_BYTES) return 0;
  k->exposure_ns = orrery_get_i64(message);
  orrery_get_f64s(message + 8, k->q_CI, 4);
  k->attitude_sigma_rad = orrery_get_f64(message + 40);
  k->count = count;
  for (i = 0; i < count; i++, at += RPO_KIT_KEYPOINT_BYTES) {
    k->seen[i].point = orrery_get_u32(at);
    k->seen[i].u_px = orrery_get_f64(at + 4);
    k->seen[i].v_px = orrery_get_f64(at + 12);
    k->seen[i].sigma_px = orrery_get_f64(at + 20);
  }
  return 1;
}

/* What stands before the image. */
ORRERY_MAYBE_UNUSED static void rpo_kit_put_view_head(unsigned char* message, const double q_CI[4],
                                                      double attitude_sigma_rad) {
  orrery_put_f64s(message, q_CI, 4);
  orrery_put_f64(message + 32, attitude_sigma_rad);
}

/* 1 if it is there; otherwise 0, and nothing is written. */
ORRERY_MAYBE_UNUSED static int rpo_kit_get_view_head(const unsigned char* message, uint32_t bytes,
                                                     double q_CI[4], double* attitude_sigma_rad) {
  if (bytes < RPO_KIT_VIEW_HEAD_BYTES) return 0;
  orrery_get_f64s(message, q_CI, 4);
  *attitude_sigma_rad = orrery_get_f64(message + 32);
  return 1;
}

ORRERY_MAYBE_UNUSED static void rpo_kit_put_target(unsigned char* message,
                                                   const rpo_kit_target* t) {
  orrery_put_i64(message, t->t_ns);
  orrery_put_f64s(message + 8, t->q_BI, 4);
  orrery_put_f64s(message + 40, t->omega_BI_B, 3);
  orrery_put_f64s(message + 64, t->sigma_rad, 3);
  orrery_put_u32(message + 88, t->poses);
  orrery_put_u32(message + 92, t->flips);
  orrery_put_u32(message + 96, t->rejected);
  orrery_put_u32(message + 100, t->lost);
}

/* 1 if the length is right; otherwise 0, and nothing is written. */
ORRERY_MAYBE_UNUSED static int rpo_kit_get_target(const unsigned char* message, uint32_t bytes,
                                                  rpo_kit_target* t) {
  if (bytes != RPO_KIT_TARGET_BYTES) return 0;
  t->t_ns = orrery_get_i64(message);
  orrery_get_f64s(message + 8, t->q_BI, 4);
  orrery_get_f64s(message + 40, t->omega_BI_B, 3);
  orrery_get_f64s(message + 64, t->sigma_rad, 3);
  t->poses = orrery_get_u32(message + 88);
  t->flips = orrery_get_u32(message + 92);
  t->rejected = orrery_get_u32(message + 96);
  t->lost = orrery_get_u32(message + 100);
  return 1;
}

#endif
