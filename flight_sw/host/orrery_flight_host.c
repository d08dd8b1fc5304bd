/* Runs a flight library from a recording of calls (README.md), and prints the recording with what
 * the library answers now: equal bytes if it answers as it did. Plain C99 and dlopen; nothing of
 * the simulator. */
#define _POSIX_C_SOURCE 200809L
#define PROGRAM "orrery-flight-host"
#include <inttypes.h>
#include <string.h>

#include "orrery_flight_library.h"

static struct {
  void *library, *self;
  const orrery_flight* flight;
  FILE* loads; /* the recording, from where the last call ended: its lines "slot" are read here */
  int64_t tick_at;
  int asked_for_tick, ending; /* within destroy, which may only log */
} host;

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
  const orrery_port* to = host.flight->ports;
  const orrery_port* const end = to + host.flight->port_count;
  (void)context;
  if (host.ending) return ORRERY_REJECTED;
  while (to != end && (to->direction != ORRERY_OUT || to->id != port)) ++to;
  if (to == end) return ORRERY_NOT_FOUND;
  if (bytes > to->max_bytes) return ORRERY_TOO_SMALL;
  printf("> out %" PRIu32 " %s", port, bytes == 0 ? "-" : "");
  for (uint32_t i = 0; i < bytes; ++i) printf("%02x", ((const unsigned char*)data)[i]);
  putchar('\n');
  return ORRERY_OK;
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
  static char* line;
  static size_t size;
  uint32_t recorded, bytes;
  unsigned char* data;
  int at = 0;
  (void)context;
  do {
    if (getline(&line, &size, host.loads) <= 0) return ORRERY_NOT_FOUND;
  } while (line[0] == '>');
  if (sscanf(line, "slot %" SCNu32 " %n", &recorded, &at) != 1 || recorded != number ||
      strncmp(line + at, "none", 4) == 0) {
    return ORRERY_NOT_FOUND; /* as then, or it did not ask for this one then */
  }
  data = from_hex(line + at, &bytes);
  if (bytes <= capacity) memcpy(buffer, data, bytes);
  free(data);
  return bytes <= capacity ? (int32_t)bytes : ORRERY_TOO_SMALL;
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
  size_t size = 0;
  FILE* recording = argc == 3 ? fopen(argv[2], "r") : NULL;
  host.loads = argc == 3 ? fopen(argv[2], "r") : NULL;
  if (argc != 3) fail("usage", PROGRAM " LIBRARY.so RECORDING > REPLAY");
  if (recording == NULL || host.loads == NULL) fail("cannot read", argv[2]);
  while (getline(&line, &size, recording) > 0) {
    int32_t status;
    if (line[0] == '>') continue; /* an answer: ours is printed instead */
    fputs(line, stdout);
    fflush(stdout); /* a call that crashed crashes here, too, and is the last line */
    if (strncmp(line, "slot ", 5) == 0) continue;
    if (strncmp(line, "orrery-calls 1 ", 15) != 0) {
      host.asked_for_tick = 0;
      status = call(argv[1], line);
      if (host.asked_for_tick) printf("> tick %" PRId64 "\n", host.tick_at);
      printf("> status %" PRId32 "\n", status);
    }
    fseek(host.loads, ftell(recording), SEEK_SET);
  }
  return 0;
}
