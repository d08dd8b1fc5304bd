/* Runs a flight library from a recording of calls (README.md), and prints the recording with what
 * the library answers now: equal bytes if it answers as it did. Plain C99 and dlopen; nothing of
 * the simulator. */
#define _POSIX_C_SOURCE 200809L
#include <dlfcn.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "orrery_flight.h"

enum { kSlots = 64, kSlot_bytes = 1048576 };

static struct {
  void* library;
  const orrery_flight* flight;
  void* self;
  int64_t tick_at;
  int asked_for_tick, ending; /* within destroy, which may only log */
  uint32_t slot[kSlots], slot_bytes[kSlots], slots;
  unsigned char* slot_data[kSlots];
} host;

static void fail(const char* what, const char* about) {
  fprintf(stderr, "orrery-flight-host: %s: %s\n", what, about);
  exit(2);
}

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

static uint32_t slot_index(uint32_t number) {
  uint32_t i = 0;
  while (i < host.slots && host.slot[i] != number) ++i;
  return i;
}

static int32_t nv_load(void* context, uint32_t number, void* buffer, uint32_t capacity) {
  const uint32_t i = slot_index(number);
  (void)context;
  if (i == host.slots) return ORRERY_NOT_FOUND;
  if (host.slot_bytes[i] > capacity) return ORRERY_TOO_SMALL;
  memcpy(buffer, host.slot_data[i], host.slot_bytes[i]);
  return (int32_t)host.slot_bytes[i];
}

static int32_t nv_store(void* context, uint32_t number, const void* data, uint32_t bytes) {
  const uint32_t i = slot_index(number);
  (void)context;
  if (i == kSlots || bytes > kSlot_bytes) return ORRERY_TOO_SMALL;
  if (i == host.slots) ++host.slots;
  host.slot[i] = number;
  host.slot_bytes[i] = bytes;
  host.slot_data[i] = realloc(host.slot_data[i], bytes + 1u);
  if (host.slot_data[i] == NULL) fail("no memory for slot", "nv_store");
  memcpy(host.slot_data[i], data, bytes);
  return ORRERY_OK;
}

static void set_slot(uint32_t number, const char* text) {
  uint32_t bytes, i = slot_index(number);
  unsigned char* data = from_hex(text, &bytes);
  if (strncmp(text, "none", 4) != 0) {
    nv_store(NULL, number, data, bytes);
  } else if (i < host.slots) {
    free(host.slot_data[i]);
    --host.slots;
    host.slot[i] = host.slot[host.slots];
    host.slot_bytes[i] = host.slot_bytes[host.slots];
    host.slot_data[i] = host.slot_data[host.slots];
    host.slot_data[host.slots] = NULL;
  }
  free(data);
}

static const orrery_host callbacks = {sizeof callbacks, ORRERY_ABI_VERSION, NULL,    output,
                                      request_tick,     log_line,           nv_load, nv_store};

/* A life of the process: the library anew, so that its globals are, too. */
static int32_t boot(const char* path, const char* line) {
  static char spacecraft[256], process[256];
  orrery_boot boot;
  const orrery_flight* (*entry)(void);
  unsigned char* config;
  int at = 0;
  int32_t status;
  memset(&boot, 0, sizeof boot);
  if (sscanf(line, "boot %" SCNd64 " %" SCNu32 " %" SCNu32 " %255[^/]/%255s %n", &boot.now_ns,
             &boot.boot_count, &boot.reset_cause, spacecraft, process, &at) != 5) {
    fail("not a boot", line);
  }
  if (host.library != NULL) dlclose(host.library);
  host.library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
  if (host.library == NULL) fail("no flight library", dlerror());
  *(void**)&entry = dlsym(host.library, "orrery_flight_entry");
  if (entry == NULL) fail("no orrery_flight_entry in", path);
  host.flight = entry();
  if (host.flight->abi_version != ORRERY_ABI_VERSION) fail("another version of the ABI in", path);
  boot.spacecraft = spacecraft;
  boot.process = process;
  config = from_hex(line + at, &boot.config_bytes);
  boot.config = config;
  status = host.flight->create(&host.self, &callbacks, &boot);
  free(config);
  return status;
}

/* 0: the line is no call. */
static int run(const char* path, const char* line, int32_t* status) {
  int64_t now_ns = 0;
  uint32_t number, bytes;
  unsigned char* data;
  int at = 0;
  if (strncmp(line, "boot ", 5) == 0) {
    *status = boot(path, line);
    return 1;
  }
  if (sscanf(line, "slot %" SCNu32 " %n", &number, &at) == 1) {
    set_slot(number, line + at);
    return 0;
  }
  if (strncmp(line, "orrery-calls 1 ", 15) == 0) return 0;
  if (host.flight == NULL) fail("before the first boot", line);
  if (sscanf(line, "in %" SCNd64 " %" SCNu32 " %n", &now_ns, &number, &at) == 2) {
    data = from_hex(line + at, &bytes);
    *status = host.flight->input(host.self, now_ns, number, data, bytes);
    free(data);
  } else if (sscanf(line, "tick %" SCNd64, &now_ns) == 1 && host.flight->tick != NULL) {
    *status = host.flight->tick(host.self, now_ns);
  } else if (strncmp(line, "destroy", 7) == 0) {
    host.ending = 1;
    host.flight->destroy(host.self);
    host.ending = 0;
  } else {
    fail("not a line of a recording", line);
  }
  return 1;
}

int main(int argc, char** argv) {
  char* line = NULL;
  size_t capacity = 0;
  int32_t status;
  FILE* recording = argc == 3 ? fopen(argv[2], "r") : NULL;
  if (argc != 3) fail("usage", "orrery-flight-host LIBRARY.so RECORDING > REPLAY");
  if (recording == NULL) fail("cannot read", argv[2]);
  while (getline(&line, &capacity, recording) > 0) {
    if (line[0] == '>') continue; /* an answer: ours is printed instead */
    fputs(line, stdout);
    fflush(stdout); /* a call that crashed crashes here, too, and is the last line */
    status = ORRERY_OK;
    host.asked_for_tick = 0;
    if (!run(argv[1], line, &status)) continue;
    if (host.asked_for_tick) printf("> tick %" PRId64 "\n", host.tick_at);
    printf("> status %" PRId32 "\n", status);
  }
  free(line);
  fclose(recording);
  return 0;
}
