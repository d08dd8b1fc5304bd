/* clang-format off: printed like this in the API page. */
#include "orrery_flight.h"
#include <string.h>
struct beacon { const orrery_host *host; int64_t period_ns; uint32_t heard; };
static struct beacon the_beacon; /* one per instance: loaded with isolation `copy` */
enum { XLINK = 1 };
static const orrery_port ports[] = {{XLINK, ORRERY_IN, ORRERY_PACKET, "crosslink", 64},
                                    {XLINK, ORRERY_OUT, ORRERY_PACKET, "crosslink", 64}};
static int32_t create(void **self, const orrery_host *host, const orrery_boot *boot) {
  the_beacon.host = host;
  the_beacon.period_ns = (int64_t)1000000000 * 10;
  host->request_tick(host->context, boot->now_ns);
  *self = &the_beacon;
  return ORRERY_OK;
}
static int32_t input(void *self, int64_t now_ns, uint32_t port, const void *data, uint32_t n) {
  struct beacon *b = self;
  (void)now_ns; (void)data;
  if (port != XLINK || n != 4) return ORRERY_REJECTED;
  b->heard++;
  return ORRERY_OK;
}
static int32_t tick(void *self, int64_t now_ns) {
  struct beacon *b = self;
  b->host->output(b->host->context, XLINK, &b->heard, 4);
  b->host->request_tick(b->host->context, now_ns + b->period_ns);
  return ORRERY_OK;
}
static void destroy(void *self) { memset(self, 0, sizeof(struct beacon)); }
static const orrery_flight beacon = {sizeof(orrery_flight), ORRERY_ABI_VERSION, "beacon", "1.0",
                                     ports, 2, create, input, tick, destroy};
const orrery_flight *orrery_flight_entry(void) { return &beacon; }
