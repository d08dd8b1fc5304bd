/* One breach of the ABI per build: MALFORMED says which. */
#include "orrery_flight.h"

enum {
  NO_ENTRY = 1,
  OTHER_VERSION,
  NULL_TABLE,
  SHORT_TABLE,
  NULL_CREATE,
  NULL_INPUT,
  NULL_DESTROY,
  NULL_PORTS,
  NULL_PORT_NAME,
  SAME_PORT_NAME,
  SAME_PORT_ID,
  CRASHES_WHEN_LOADED
};

static int32_t create(void** self, const orrery_host* host, const orrery_boot* boot) {
  (void)self;
  (void)host;
  (void)boot;
  return ORRERY_OK;
}
static int32_t input(void* self, int64_t now_ns, uint32_t port, const void* data, uint32_t bytes) {
  (void)self;
  (void)now_ns;
  (void)port;
  (void)data;
  (void)bytes;
  return ORRERY_OK;
}
static void destroy(void* self) {
  (void)self;
}

/* An id and a name may serve both directions. */
static const orrery_port ports[] = {{1, ORRERY_IN, ORRERY_PACKET, "one", 8},
                                    {MALFORMED == SAME_PORT_ID ? 1 : 2, ORRERY_IN, ORRERY_PACKET,
                                     MALFORMED == NULL_PORT_NAME   ? (const char*)0
                                     : MALFORMED == SAME_PORT_NAME ? "one"
                                                                   : "two",
                                     8},
                                    {1, ORRERY_OUT, ORRERY_PACKET, "one", 8}};

static const orrery_flight flight = {MALFORMED == SHORT_TABLE ? 16 : sizeof(orrery_flight),
                                     MALFORMED == OTHER_VERSION ? 999 : ORRERY_ABI_VERSION,
                                     "malformed",
                                     "1.0",
                                     MALFORMED == NULL_PORTS ? (const orrery_port*)0 : ports,
                                     3,
                                     MALFORMED == NULL_CREATE ? 0 : create,
                                     MALFORMED == NULL_INPUT ? 0 : input,
                                     0,
                                     MALFORMED == NULL_DESTROY ? 0 : destroy};

#if MALFORMED == 1
ORRERY_EXPORT const orrery_flight* some_other_entry(void);
const orrery_flight* some_other_entry(void) {
  return &flight;
}
#else
__attribute__((no_sanitize("undefined"))) const orrery_flight* orrery_flight_entry(void) {
  static int* volatile nowhere = 0;
  if (MALFORMED == CRASHES_WHEN_LOADED) *nowhere = 1;
  return MALFORMED == NULL_TABLE ? (const orrery_flight*)0 : &flight;
}
#endif
