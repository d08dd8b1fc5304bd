/* Every 10 s it tells the other spacecraft how many beacons and altitudes it has got so far. */
#include <stdlib.h>

#include "orrery_flight.h"

#ifdef NDEBUG
#error "flight libraries keep their asserts in every build type"
#endif

enum { CROSSLINK = 1, ALTITUDE = 2, BEACON_BYTES = 8, SCRATCH_BYTES = 1000 };

struct beacon {
  const orrery_host* host;
  uint32_t heard, altitudes;
  unsigned char* scratch; /* something that the heap figures must show */
};

static const orrery_port ports[] = {{CROSSLINK, ORRERY_IN, ORRERY_PACKET, "crosslink", 64},
                                    {ALTITUDE, ORRERY_IN, ORRERY_PACKET, "altitude", 8},
                                    {CROSSLINK, ORRERY_OUT, ORRERY_PACKET, "crosslink", 64}};

static int32_t create(void** self, const orrery_host* host, const orrery_boot* boot) {
  struct beacon* b = malloc(sizeof *b);
  if (b == NULL) return ORRERY_FATAL;
  b->host = host;
  b->heard = 0;
  b->altitudes = 0;
  b->scratch = malloc(SCRATCH_BYTES);
  if (b->scratch == NULL) return ORRERY_FATAL;
  host->request_tick(host->context, boot->now_ns);
  *self = b;
  return ORRERY_OK;
}

static int32_t input(void* self, int64_t now_ns, uint32_t port, const void* data, uint32_t bytes) {
  struct beacon* b = self;
  (void)now_ns;
  (void)data;
  if (bytes != BEACON_BYTES) return ORRERY_REJECTED;
  switch (port) {
    case CROSSLINK:
      b->heard++;
      return ORRERY_OK;
    case ALTITUDE:
      b->altitudes++;
      return ORRERY_OK;
    default:
      return ORRERY_NOT_FOUND;
  }
}

static void put_u32(unsigned char* to, uint32_t value) {
  int i;
  for (i = 0; i < 4; i++) to[i] = (unsigned char)(value >> 8 * i);
}

static int32_t tick(void* self, int64_t now_ns) {
  struct beacon* b = self;
  unsigned char message[BEACON_BYTES];
  put_u32(message, b->heard);
  put_u32(message + 4, b->altitudes);
  b->host->output(b->host->context, CROSSLINK, message, sizeof message);
  b->host->request_tick(b->host->context, now_ns + (int64_t)1000000000 * 10);
  return ORRERY_OK;
}

static void destroy(void* self) {
  struct beacon* b = self;
  free(b->scratch);
  free(b);
}

static const orrery_flight beacon = {sizeof(orrery_flight),
                                     ORRERY_ABI_VERSION,
                                     "acme_beacon",
                                     "1.0",
                                     ports,
                                     sizeof ports / sizeof ports[0],
                                     create,
                                     input,
                                     tick,
                                     destroy};

const orrery_flight* orrery_flight_entry(void) {
  return &beacon;
}
