/* Sends what the wall clock shows. */
#include <time.h>

#include "orrery_flight.h"
static const orrery_host* host;
static const orrery_port ports[] = {{1, ORRERY_OUT, ORRERY_PACKET, "crosslink", 64}};
static int32_t create(void** self, const orrery_host* the_host, const orrery_boot* boot) {
  (void)self;
  host = the_host;
  host->request_tick(host->context, boot->now_ns);
  return ORRERY_OK;
}
static int32_t input(void* self, int64_t now_ns, uint32_t port, const void* data, uint32_t bytes) {
  (void)self, (void)now_ns, (void)port, (void)data, (void)bytes;
  return ORRERY_NOT_FOUND;
}
static int32_t stamp_message(void) {
  struct timespec now = {0, 0};
  clock_gettime(CLOCK_REALTIME, &now);
  return host->output(host->context, 1, &now.tv_nsec, sizeof now.tv_nsec);
}
static int32_t tick(void* self, int64_t now_ns) {
  (void)self;
  stamp_message();
  host->request_tick(host->context, now_ns + (int64_t)1000000000 * 10);
  return ORRERY_OK;
}
static void destroy(void* self) {
  (void)self;
}
static const orrery_flight library = {sizeof(orrery_flight),
                                      ORRERY_ABI_VERSION,
                                      "wall_clock",
                                      "1.0",
                                      ports,
                                      1,
                                      create,
                                      input,
                                      tick,
                                      destroy};
const orrery_flight* orrery_flight_entry(void) {
  return &library;
}
