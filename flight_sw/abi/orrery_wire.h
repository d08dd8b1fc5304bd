/* The calls of orrery_flight.h as bytes, for a host process, an emulator or a board. Little-endian,
 * packed by hand, never a C struct. C89; allocates nothing.
 *
 * Frame    0 u32 magic | 4 u16 type | 6 u16 abi_version | 8 u32 sequence | 12 u32 payload_bytes
 *          16 i64 time_ns | 24 i32 code | 28 u32 crc32(bytes 0 ... 27)
 *          then the payload, then u32 crc32(payload) if there is a payload
 * Order    The target says HELLO once, with sequence 0. Requests count from 1; one is open at a
 *          time, and simulated time stands still until its DONE. What the target sends before DONE
 *          bears the request's sequence.
 * Errors   Anything else than this page allows breaks the link. Nothing is sent twice: a call would
 *          be made twice.
 */
#ifndef ORRERY_WIRE_H
#define ORRERY_WIRE_H

#include "orrery_flight.h"

#define ORRERY_WIRE_MAGIC 0x5952524Fu /* "ORRY" */
#define ORRERY_WIRE_HEADER_BYTES 32u
#define ORRERY_WIRE_DONE_BYTES 48u
/* No payload is larger, whatever the other side says. */
#define ORRERY_WIRE_MOST_BYTES 0x4000000u

/* A table: */
/* clang-format off */
enum {
  /* simulation -> target           time_ns          code         payload                            */
  ORRERY_W_CREATE = 1,           /* now              reset cause  fields, see ORRERY_WT_             */
  ORRERY_W_INPUT = 2,            /* now              port         message                            */
  ORRERY_W_TICK = 3,             /* now              0            -                                  */
  ORRERY_W_DESTROY = 4,          /* now              0            -                                  */
  /* target -> simulation */
  ORRERY_W_HELLO = 16,           /* 0                0            u32 largest payload it takes
                                                                  | text name | text version
                                                                  | u32 ports | per port: u32 id, u16 direction,
                                                                  u16 kind, u32 max_bytes, text name */
  ORRERY_W_OUTPUT = 17,          /* 0                port         message                            */
  ORRERY_W_LOG = 18,             /* 0                level        text                               */
  ORRERY_W_NV_STORE = 19,        /* 0                slot         bytes                              */
  ORRERY_W_DONE = 20             /* pending tick,    status       u32 unit of cost | u64 cost
                                    or -1                         | u64 heap now | u64 heap peak
                                                                  | u32 0 or 1: the call asked for a tick
                                                                  | u64 heap size | u64 its largest free */
};
/* A text is u16 bytes, then the bytes. The fields of CREATE are u16 tag, u32 bytes, the bytes. */
enum {
  ORRERY_WT_SPACECRAFT = 1,      /* text without its length                                          */
  ORRERY_WT_PROCESS = 2,         /* likewise                                                         */
  ORRERY_WT_BOOT_COUNT = 3,      /* u32                                                              */
  ORRERY_WT_CONFIG = 4,          /* bytes                                                            */
  ORRERY_WT_STORAGE = 5,         /* u32 bytes that all slots together may hold                       */
  ORRERY_WT_SLOT = 6             /* u32 slot, then its bytes; once per slot                          */
};
/* Units of DONE's cost. */
enum { ORRERY_WU_NONE = 0, ORRERY_WU_NS = 1, ORRERY_WU_INSTRUCTIONS = 2 };
/* clang-format on */

#ifdef __cplusplus
extern "C" {
#endif

typedef struct orrery_wire_cost {
  uint32_t unit; /* ORRERY_WU_ */
  uint64_t cost; /* of the call */
  /* Bytes, 0 where not measured: live now, most live within the call, the heap's size, and the
   * largest block of it that is free. */
  uint64_t heap_now, heap_peak, heap_size, heap_largest_free;
} orrery_wire_cost;

typedef struct orrery_wire_link { /* what a board supplies */
  void* context;
  /* Two blocking byte pipes: all of it, or < 0. */
  int32_t (*read)(void* context, void* buffer, uint32_t bytes);
  int32_t (*write)(void* context, const void* data, uint32_t bytes);
  /* Just before a call into the library and just after it; either may be NULL. */
  void (*call_begins)(void* context);
  void (*call_ended)(void* context, orrery_wire_cost* cost);
} orrery_wire_link;

/* Bytes of work[] that orrery_wire_serve needs beside inputs, boot record and stored slots. */
#define ORRERY_WIRE_WORK_BYTES 16384u

/* Says HELLO and serves until DESTROY. Half of work[] beyond ORRERY_WIRE_WORK_BYTES holds the
 * request, half the slots. ORRERY_OK after DESTROY; ORRERY_REJECTED: the link broke, or what came
 * over it was none of the above; ORRERY_TOO_SMALL: work[] is too small for the port table. */
int32_t orrery_wire_serve(const orrery_wire_link* link, const orrery_flight* flight, void* work,
                          uint32_t work_bytes);

#ifdef __cplusplus
}
#endif
#endif
