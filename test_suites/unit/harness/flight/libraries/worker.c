/* Counts its work: a message is a little-endian number of turns of a loop; ~0: for ever. */
#include "orrery_flight.h"
#include "orrery_messages.h"

enum { TURNS = 1, DONE = 2 };
static const orrery_port ports[] = {{TURNS, ORRERY_IN, ORRERY_PACKET, "turns", 4},
                                    {DONE, ORRERY_OUT, ORRERY_PACKET, "done", 4}};
static volatile uint32_t turned; /* global: loaded with isolation `copy` */

static int32_t create(void** self, const orrery_host* host, const orrery_boot* boot) {
  (void)boot;
  *self = (void*)host;
  return ORRERY_OK;
}

static int32_t input(void* self, int64_t now_ns, uint32_t port, const void* data, uint32_t bytes) {
  const orrery_host* host = (const orrery_host*)self;
  unsigned char answer[4];
  uint32_t turns;
  (void)now_ns;
  if (port != TURNS || bytes != 4) return ORRERY_REJECTED;
  turns = orrery_get_u32((const unsigned char*)data);
  for (turned = 0; turned < turns || turns == 0xffffffffu; turned++) {
  }
  orrery_put_u32(answer, turned);
  return host->output(host->context, DONE, answer, 4);
}

static void destroy(void* self) {
  (void)self;
}

static const orrery_flight flight = {sizeof(orrery_flight),
                                     ORRERY_ABI_VERSION,
                                     "worker",
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
