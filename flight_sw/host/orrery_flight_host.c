/* Runs a flight library from a recording of calls (README.md), and prints the recording with what
 * the library answers now: equal bytes if it answers as it did. Plain C99 and dlopen; nothing of
 * the simulator. */
#define _POSIX_C_SOURCE 200809L
#define PROGRAM "orrery-flight-host"
#include <inttypes.h>
#include <string.h>

#include "orrery_flight_library.h"

enum { kMostLoads = 256 }; /* of slots, in one call */

static struct {
  void *library, *self;
  const orrery_flight* flight;
  int64_t tick_at;
  int asked_for_tick, ending; /* within destroy, which may only log */
  char* loads[kMostLoads];    /* lines "slot": what the loads of the next call find, in order */
  int load_count, loaded;
} host;

static void print_hex(const void* data, uint32_t bytes) {
  const unsigned char* byte = data;
  if (bytes == 0) putchar('-');
  for (; bytes > 0; --bytes) printf("%02x", *byte++);
  putchar('\n');
}

/* Aligned to 8 bytes and never null, as inputs are. The caller frees it. */
static unsigned char* from_hex(const char* text, uint32_t* bytes) {
  unsigned char* data = malloc(strlen(text) / 2 + 8);
  unsigned byte;
  if (data == NULL) fail("no memory for", text);
  for (*bytes = 0; sscanf(text, "%2x", &byte) == 1; text += 2)
    data[(*bytes)++] = (unsigned char)byte;
  return data;
}

static int32_t output(void* context, uint32_t port, const void* data, uint32_t bytes) {
  uint32_t i;
  (void)context;
  if (host.ending) return ORRERY_REJECTED;
  for (i = 0; i < host.flight->port_count; ++i) {
    if (host.flight->ports[i].direction != ORRERY_OUT || host.flight->ports[i].id != port) continue;
    if (bytes > host.flight->ports[i].max_bytes) return ORRERY_TOO_SMALL;
    printf("> out %" PRIu32 " ", port);
    print_hex(data, bytes);
    return ORRERY_OK;
  }
  return ORRERY_NOT_FOUND;
}

static void request_tick(void* context, int64_t at_ns) {
  (void)context;
  host.tick_at = at_ns;
  host.asked_for_tick = !host.ending;
}

static void log_line(void* context, int32_t level, const char* line) {
  (void)context;
  fprintf(stderr, "%d %s\n", (int)level, line);
}

static int32_t nv_load(void* context, uint32_t number, void* buffer, uint32_t capacity) {
  uint32_t recorded = 0, bytes = 0;
  unsigned char* data;
  int at = 0, fits;
  (void)context;
  if (host.loaded == host.load_count) return ORRERY_NOT_FOUND;
  sscanf(host.loads[host.loaded], "slot %" SCNu32 " %n", &recorded, &at);
  if (recorded != number) return ORRERY_NOT_FOUND; /* it asks for what it did not ask for then */
  if (strncmp(host.loads[host.loaded++] + at, "none", 4) == 0) return ORRERY_NOT_FOUND;
  data = from_hex(host.loads[host.loaded - 1] + at, &bytes);
  fits = bytes <= capacity;
  if (fits) memcpy(buffer, data, bytes);
  free(data);
  return fits ? (int32_t)bytes : ORRERY_TOO_SMALL;
}

/* What was stored shows in the recording, where it is loaded. */
static int32_t nv_store(void* context, uint32_t number, const void* data, uint32_t bytes) {
  (void)context, (void)number, (void)data, (void)bytes;
  return ORRERY_OK;
}

static const orrery_host callbacks = {sizeof callbacks, ORRERY_ABI_VERSION, NULL,    output,
                                      request_tick,     log_line,           nv_load, nv_store};

/* A life of the process: the library anew, so that its globals are, too. */
static int32_t boot(const char* path, const char* line) {
  static char spacecraft[256], process[256];
  orrery_boot boot = {.spacecraft = spacecraft, .process = process};
  unsigned char* config;
  int at = 0;
  int32_t status;
  if (sscanf(line, "boot %" SCNd64 " %" SCNu32 " %" SCNu32 " %255[^/]/%255s %n", &boot.now_ns,
             &boot.boot_count, &boot.reset_cause, spacecraft, process, &at) != 5) {
    fail("not a boot", line);
  }
  if (host.library != NULL) dlclose(host.library);
  host.flight = open_flight_library(path, &host.library);
  boot.config = config = from_hex(line + at, &boot.config_bytes);
  status = host.flight->create(&host.self, &callbacks, &boot);
  free(config);
  return status;
}

static int32_t call(const char* path, const char* line) {
  int64_t now_ns = 0;
  uint32_t port, bytes;
  unsigned char* data;
  int at = 0;
  int32_t status = ORRERY_OK;
  if (strncmp(line, "boot ", 5) == 0) return boot(path, line);
  if (host.flight == NULL) fail("before the first boot", line);
  if (sscanf(line, "in %" SCNd64 " %" SCNu32 " %n", &now_ns, &port, &at) == 2) {
    data = from_hex(line + at, &bytes);
    status = host.flight->input(host.self, now_ns, port, data, bytes);
    free(data);
  } else if (sscanf(line, "tick %" SCNd64, &now_ns) == 1 && host.flight->tick != NULL) {
    status = host.flight->tick(host.self, now_ns);
  } else if (strncmp(line, "destroy", 7) == 0) {
    host.ending = 1;
    host.flight->destroy(host.self);
    host.ending = 0;
  } else {
    fail("not a line of a recording", line);
  }
  return status;
}

int main(int argc, char** argv) {
  char* line = NULL;
  size_t capacity = 0;
  FILE* recording = argc == 3 ? fopen(argv[2], "r") : NULL;
  if (argc != 3) fail("usage", PROGRAM " LIBRARY.so RECORDING > REPLAY");
  if (recording == NULL) fail("cannot read", argv[2]);
  while (getline(&line, &capacity, recording) > 0) {
    int32_t status;
    if (line[0] == '>') continue; /* an answer: ours is printed instead */
    fputs(line, stdout);
    fflush(stdout); /* a call that crashed crashes here, too, and is the last line */
    if (strncmp(line, "orrery-calls 1 ", 15) == 0) continue;
    if (strncmp(line, "slot ", 5) == 0) {
      if (host.load_count == kMostLoads) fail("more loads in a call than this host holds", line);
      host.loads[host.load_count++] = strdup(line);
      continue;
    }
    host.asked_for_tick = 0;
    status = call(argv[1], line);
    if (host.asked_for_tick) printf("> tick %" PRId64 "\n", host.tick_at);
    printf("> status %" PRId32 "\n", status);
    while (host.load_count > 0) free(host.loads[--host.load_count]);
    host.loaded = 0;
  }
  free(line);
  fclose(recording);
  return 0;
}
