/* Messages of camera_navigation, for itself and its test. C89, little-endian, in the manner of
 * orrery_messages.h. Times are GPS ns since 1980-01-06.
 *
 *   crosslink, to all   0 u32 sender | 4 i64 epoch_ns | 12 f64 r_ECEF[3] m | 36 f64 v_ECEF[3] m/s
 *                       | 60 u32 crc of the bytes before it
 *   frame, an image has come     0 u32 camera (0 star, 1 target) | 4 u32 frame
 *                       | 8 i64 exposure_begin_ns | 16 i64 received_ns | 24 u32 sources
 *                       | 28 u32 own fixes | 32 u32 fixes of others, since boot
 *   attitude, of the star camera 0 i64 t_ns, middle of the exposure | 8 f64 R_CI[9], by rows
 *                       | 80 f64 sigma_rad[3], about its axes | 104 u32 identified stars
 *   bearing, of the target       0 rpo_kit_bearing | 40 f64 u, v px | 56 f64 predicted u, v px
 *                       | 72 f64 age_s of the pair of fixes that it was predicted from
 */
#ifndef CAMERA_NAVIGATION_MESSAGES_H
#define CAMERA_NAVIGATION_MESSAGES_H

#include "rpo_kit/rpo_kit_messages.h"

#define CAMERA_NAVIGATION_CROSSLINK_BYTES 64u
#define CAMERA_NAVIGATION_FRAME_BYTES 36u
#define CAMERA_NAVIGATION_ATTITUDE_BYTES 108u
#define CAMERA_NAVIGATION_BEARING_BYTES 80u

enum { CAMERA_NAVIGATION_STAR = 0, CAMERA_NAVIGATION_TARGET = 1 };

#endif
