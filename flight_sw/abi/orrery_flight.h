/* Orrery flight ABI 1: the whole contract between flight software and what runs it, be that a
 * simulation, a socket or a board. Plain C89 plus <stdint.h>; no float, enum type, bool or size_t.
 * Time    now_ns: what this spacecraft's own clock shows, ns since 1980-01-06 GPS; it may be wrong,
 *         step ahead or back; constant during a call. Truth is nowhere in this file.
 * Memory  a pointer handed over, either way, is valid during that call only; input data is 8-byte
 *         aligned.
 * Calls   one thread; the host never enters the library from inside output/request_tick/log/nv_*.
 * The rest of the contract (ticks, status codes, ports, life, storage) is in README.md beside it.
 */
#ifndef ORRERY_FLIGHT_H
#define ORRERY_FLIGHT_H

#include <stddef.h>
#include <stdint.h>

#if defined(__GNUC__)
#define ORRERY_EXPORT __attribute__((visibility("default")))
#else
#define ORRERY_EXPORT
#endif

#ifndef ORRERY_FLIGHT_ENTRY /* rename it to link several packages statically into one board image \
                             */
#define ORRERY_FLIGHT_ENTRY orrery_flight_entry
#endif

#define ORRERY_ABI_VERSION 1u
#define ORRERY_NO_TICK ((int64_t)-1) /* any negative time withdraws the request */

/* Status codes. */
#define ORRERY_OK 0           /* done */
#define ORRERY_REJECTED 1     /* message not usable or not accepted: counted, not a failure */
#define ORRERY_NOT_FOUND (-1) /* no such port or slot */
#define ORRERY_TOO_SMALL (-2) /* buffer or medium too small; nothing was written */
#define ORRERY_FATAL (-100)   /* cannot go on: the host ends this process as if it had crashed */

enum { ORRERY_IN = 0, ORRERY_OUT = 1, ORRERY_PACKET = 0, ORRERY_STREAM = 1 };
enum { ORRERY_DEBUG = 0, ORRERY_INFO = 1, ORRERY_WARNING = 2, ORRERY_ERROR = 3 };
enum { ORRERY_POWER_ON = 0, ORRERY_COMMANDED = 1, ORRERY_WATCHDOG = 2, ORRERY_CRASH = 3 };

#ifdef __cplusplus
extern "C" {
#endif

typedef struct orrery_port {
  uint32_t id;        /* the library's own number, any value, unique per direction */
  uint16_t direction; /* ORRERY_IN, ORRERY_OUT */
  uint16_t kind;      /* ORRERY_PACKET: one call, one message. ORRERY_STREAM: cuts mean nothing */
  const char* name;   /* "gnss": what tests wire and records show */
  uint32_t max_bytes; /* of one call */
} orrery_port;

typedef struct orrery_boot { /* valid during create only */
  int64_t now_ns;
  const char *spacecraft, *process; /* "dsc", "gnc" */
  uint32_t boot_count, reset_cause; /* 0 and ORRERY_POWER_ON the first time */
  const void* config;               /* the content, not a path; the library's own format */
  uint32_t config_bytes;
} orrery_boot;

typedef struct orrery_host { /* outlives the instance */
  uint32_t size, abi_version;
  void* context; /* first argument of every function below */
  int32_t (*output)(void* context, uint32_t port, const void* data, uint32_t bytes);
  /* Replaces the pending one; spent when delivered. */
  void (*request_tick)(void* context, int64_t at_ns);
  void (*log)(void* context, int32_t level, const char* line);
  /* The bytes loaded, or < 0. */
  int32_t (*nv_load)(void* context, uint32_t slot, void* buffer, uint32_t capacity);
  /* All or nothing. */
  int32_t (*nv_store)(void* context, uint32_t slot, const void* data, uint32_t bytes);
} orrery_host;

typedef struct orrery_flight { /* static in the library */
  uint32_t size, abi_version;
  const char *name, *version;
  const orrery_port* ports;
  uint32_t port_count;
  int32_t (*create)(void** self, const orrery_host* host, const orrery_boot* boot);
  int32_t (*input)(void* self, int64_t now_ns, uint32_t port, const void* data, uint32_t bytes);
  int32_t (*tick)(void* self, int64_t now_ns); /* may be NULL */
  void (*destroy)(void* self);                 /* orderly end only: a crash or power cut skips it */
} orrery_flight;

/* Within an ABI version tables grow only at their end; `size` tells how far this one goes. */
#define ORRERY_HAS(table, member)                                              \
  ((table)->size >= offsetof(orrery_host, member) + sizeof((table)->member) && \
   (table)->member != NULL)

ORRERY_EXPORT const orrery_flight* ORRERY_FLIGHT_ENTRY(void); /* the only exported symbol */

#ifdef __cplusplus
}
#endif
#endif
