/* Sends a variable that it has not written to. */
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
static int32_t tick(void* self, int64_t now_ns) {
  unsigned char message[64];
  (void)self;
  host->output(host->context, 1, message, sizeof message);
  host->request_tick(host->context, now_ns + (int64_t)1000000000 * 10);
  return ORRERY_OK;
}
static void destroy(void* self) {
  (void)self;
}
static const orrery_flight library = {sizeof(orrery_flight),
                                      ORRERY_ABI_VERSION,
                                      "uninitialised_stack",
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
