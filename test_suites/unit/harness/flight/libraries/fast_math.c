/* Linked with -ffast-math: its start-up code sets flush-to-zero in the thread that loads it. Says
 * whether a denormal survives in a call, and sets flush-to-zero itself. */
#include <xmmintrin.h>

#include "orrery_flight.h"

static const orrery_host* the_host;
static volatile double tiny = 1e-300;

static int32_t create(void** self, const orrery_host* host, const orrery_boot* boot) {
  (void)self;
  (void)boot;
  the_host = host;
  return ORRERY_OK;
}
static int32_t input(void* self, int64_t now_ns, uint32_t port, const void* data, uint32_t bytes) {
  const char denormal_survives = tiny * 1e-10 != 0.0;
  (void)self;
  (void)now_ns;
  (void)port;
  (void)data;
  (void)bytes;
  the_host->output(the_host->context, 1, &denormal_survives, 1);
  _mm_setcsr(_mm_getcsr() | 0x8040);
  return ORRERY_OK;
}
static void destroy(void* self) {
  (void)self;
}

static const orrery_port ports[] = {{1, ORRERY_IN, ORRERY_PACKET, "do", 8},
                                    {1, ORRERY_OUT, ORRERY_PACKET, "say", 8}};
static const orrery_flight flight = {sizeof(orrery_flight),
                                     ORRERY_ABI_VERSION,
                                     "fast_math",
                                     "1.0",
                                     ports,
                                     2,
                                     create,
                                     input,
                                     0,
                                     destroy};
const orrery_flight* orrery_flight_entry(void) {
  return &flight;
}
