/* The target's side of orrery_wire.h: C89, no allocation, no system call. */
#include "orrery_wire.h"

#include <string.h>

#include "orrery_crc32_sliced.h"

enum { kOut_bytes = 8192 }; /* frames wait here for DONE, so that a call is answered by one write */

/* A stored slot, in the order of the first store: u32 slot, u32 bytes, the bytes. */
enum { kSlotHeader_bytes = 8 };

typedef struct wire_state {
  const orrery_wire_link* link;
  const orrery_flight* flight;
  void* self;
  int created, in_call, broken, asked_for_tick;
  uint32_t sequence;
  int64_t pending_tick;
  unsigned char* request;
  uint32_t request_capacity;
  unsigned char* slots;
  uint32_t slots_bytes, slots_capacity;
  uint32_t storage_bytes; /* what the simulation allows for all slots together */
  orrery_host host;
  orrery_crc32_tables crc;
  uint32_t out_bytes;
  unsigned char out[kOut_bytes];
} wire_state;

/* ---- sending */

static void put_u16(unsigned char* at, uint32_t value) {
  at[0] = (unsigned char)(value & 0xFFu);
  at[1] = (unsigned char)((value >> 8) & 0xFFu);
}

static uint32_t get_u16(const unsigned char* at) {
  return at[0] | ((uint32_t)at[1] << 8);
}

static void put_u64(unsigned char* at, uint64_t value) {
  orrery_put_u32(at, (uint32_t)(value & 0xFFFFFFFFu));
  orrery_put_u32(at + 4, (uint32_t)(value >> 32));
}

static void flush(wire_state* s) {
  if (s->out_bytes > 0 && s->link->write(s->link->context, s->out, s->out_bytes) < 0) s->broken = 1;
  s->out_bytes = 0;
}

static void put(wire_state* s, const void* data, uint32_t bytes) {
  if (bytes > kOut_bytes - s->out_bytes) flush(s);
  if (bytes > kOut_bytes) {
    if (s->link->write(s->link->context, data, bytes) < 0) s->broken = 1;
  } else if (bytes > 0) {
    memcpy(s->out + s->out_bytes, data, bytes);
    s->out_bytes += bytes;
  }
}

static void put_header(wire_state* s, uint32_t type, uint32_t payload_bytes, int64_t time_ns,
                       int32_t code) {
  unsigned char header[ORRERY_WIRE_HEADER_BYTES];
  orrery_put_u32(header, ORRERY_WIRE_MAGIC);
  put_u16(header + 4, type);
  put_u16(header + 6, ORRERY_ABI_VERSION);
  orrery_put_u32(header + 8, s->sequence);
  orrery_put_u32(header + 12, payload_bytes);
  orrery_put_i64(header + 16, time_ns);
  orrery_put_u32(header + 24, (uint32_t)code);
  orrery_put_u32(header + 28, orrery_crc32_sliced(&s->crc, header, 28));
  put(s, header, sizeof header);
}

static void put_crc(wire_state* s, uint32_t crc) {
  unsigned char bytes[4];
  orrery_put_u32(bytes, crc);
  put(s, bytes, 4);
}

static void put_frame(wire_state* s, uint32_t type, int32_t code, const void* data,
                      uint32_t bytes) {
  put_header(s, type, bytes, 0, code);
  if (bytes == 0) return;
  put(s, data, bytes);
  put_crc(s, orrery_crc32_sliced(&s->crc, (const unsigned char*)data, bytes));
}

/* A part of a payload whose length was announced: its CRC goes on. */
static void put_part(wire_state* s, uint32_t* crc, const void* data, uint32_t bytes) {
  *crc = orrery_crc32_sliced_update(&s->crc, *crc, (const unsigned char*)data, bytes);
  put(s, data, bytes);
}

static void put_text(wire_state* s, uint32_t* crc, const char* text, uint32_t bytes) {
  unsigned char length[2];
  put_u16(length, bytes);
  put_part(s, crc, length, 2);
  put_part(s, crc, text, bytes);
}

static uint32_t text_bytes(const char* text) {
  const size_t bytes = text == NULL ? 0 : strlen(text);
  return bytes > 0xFFFFu ? 0xFFFFu : (uint32_t)bytes;
}

static void say_hello(wire_state* s) {
  const orrery_flight* f = s->flight;
  unsigned char number[12];
  uint32_t i, crc = 0xFFFFFFFFu;
  uint32_t bytes = 4 + 2 + text_bytes(f->name) + 2 + text_bytes(f->version) + 4;
  for (i = 0; i < f->port_count; i++) bytes += 12 + 2 + text_bytes(f->ports[i].name);
  put_header(s, ORRERY_W_HELLO, bytes, 0, 0);
  orrery_put_u32(number, s->request_capacity);
  put_part(s, &crc, number, 4);
  put_text(s, &crc, f->name, text_bytes(f->name));
  put_text(s, &crc, f->version, text_bytes(f->version));
  orrery_put_u32(number, f->port_count);
  put_part(s, &crc, number, 4);
  for (i = 0; i < f->port_count; i++) {
    const orrery_port* port = &f->ports[i];
    orrery_put_u32(number, port->id);
    put_u16(number + 4, port->direction);
    put_u16(number + 6, port->kind);
    orrery_put_u32(number + 8, port->max_bytes);
    put_part(s, &crc, number, 12);
    put_text(s, &crc, port->name, text_bytes(port->name));
  }
  put_crc(s, crc ^ 0xFFFFFFFFu);
  flush(s);
}

/* ---- slots, behind one another; a store moves those behind it */

static unsigned char* find_slot(const wire_state* s, uint32_t slot) {
  uint32_t at = 0;
  while (at < s->slots_bytes) {
    unsigned char* entry = s->slots + at;
    if (orrery_get_u32(entry) == slot) return entry;
    at += kSlotHeader_bytes + orrery_get_u32(entry + 4);
  }
  return NULL;
}

static uint32_t stored_bytes(const wire_state* s) {
  uint32_t at = 0, sum = 0;
  while (at < s->slots_bytes) {
    const uint32_t bytes = orrery_get_u32(s->slots + at + 4);
    sum += bytes;
    at += kSlotHeader_bytes + bytes;
  }
  return sum;
}

static int32_t store(wire_state* s, uint32_t slot, const void* data, uint32_t bytes) {
  unsigned char* entry = find_slot(s, slot);
  const uint32_t old = entry == NULL ? 0 : orrery_get_u32(entry + 4);
  const uint32_t freed = entry == NULL ? 0 : kSlotHeader_bytes + old;
  if (bytes > s->storage_bytes || stored_bytes(s) - old > s->storage_bytes - bytes) {
    return ORRERY_TOO_SMALL;
  }
  if (s->slots_capacity < kSlotHeader_bytes ||
      s->slots_bytes - freed > s->slots_capacity - kSlotHeader_bytes ||
      bytes > s->slots_capacity - kSlotHeader_bytes - (s->slots_bytes - freed)) {
    return ORRERY_TOO_SMALL;
  }
  if (entry != NULL) {
    const unsigned char* rest = entry + freed;
    memmove(entry, rest, (size_t)(s->slots + s->slots_bytes - rest));
    s->slots_bytes -= freed;
  }
  entry = s->slots + s->slots_bytes;
  orrery_put_u32(entry, slot);
  orrery_put_u32(entry + 4, bytes);
  if (bytes > 0) memcpy(entry + kSlotHeader_bytes, data, bytes);
  s->slots_bytes += kSlotHeader_bytes + bytes;
  return ORRERY_OK;
}

/* ---- what the library may ask for, within a call */

static int32_t host_output(void* context, uint32_t port, const void* data, uint32_t bytes) {
  wire_state* s = (wire_state*)context;
  uint32_t i;
  if (!s->in_call) return ORRERY_REJECTED;
  for (i = 0; i < s->flight->port_count; i++) {
    const orrery_port* p = &s->flight->ports[i];
    if (p->direction != ORRERY_OUT || p->id != port) continue;
    if (bytes > p->max_bytes) return ORRERY_TOO_SMALL;
    put_frame(s, ORRERY_W_OUTPUT, (int32_t)port, data, bytes);
    return ORRERY_OK;
  }
  return ORRERY_NOT_FOUND;
}

static void host_request_tick(void* context, int64_t at_ns) {
  wire_state* s = (wire_state*)context;
  if (!s->in_call) return;
  s->pending_tick = at_ns < 0 ? ORRERY_NO_TICK : at_ns;
  s->asked_for_tick = 1;
}

static void host_log(void* context, int32_t level, const char* line) {
  wire_state* s = (wire_state*)context;
  uint32_t bytes = text_bytes(line);
  put_frame(s, ORRERY_W_LOG, level, line, bytes > 1000 ? 1000 : bytes);
}

static int32_t host_nv_load(void* context, uint32_t slot, void* buffer, uint32_t capacity) {
  const unsigned char* entry = find_slot((const wire_state*)context, slot);
  uint32_t bytes;
  if (entry == NULL) return ORRERY_NOT_FOUND;
  bytes = orrery_get_u32(entry + 4);
  if (bytes > capacity) return ORRERY_TOO_SMALL;
  if (bytes > 0) memcpy(buffer, entry + kSlotHeader_bytes, bytes);
  return (int32_t)bytes;
}

static int32_t host_nv_store(void* context, uint32_t slot, const void* data, uint32_t bytes) {
  wire_state* s = (wire_state*)context;
  int32_t status;
  if (!s->in_call) return ORRERY_REJECTED;
  status = store(s, slot, data, bytes);
  if (status == ORRERY_OK) put_frame(s, ORRERY_W_NV_STORE, (int32_t)slot, data, bytes);
  return status;
}

/* ---- requests */

typedef struct wire_request {
  uint32_t type, bytes, code;
  int64_t time_ns;
} wire_request;

/* 0: not a request that may follow. Its payload lies in s->request then, and a 0 behind it. */
static int read_request(wire_state* s, wire_request* r) {
  unsigned char header[ORRERY_WIRE_HEADER_BYTES];
  uint32_t crc;
  if (s->link->read(s->link->context, header, sizeof header) < 0) return 0;
  if (orrery_get_u32(header) != ORRERY_WIRE_MAGIC || get_u16(header + 6) != ORRERY_ABI_VERSION ||
      orrery_get_u32(header + 28) != orrery_crc32_sliced(&s->crc, header, 28) ||
      orrery_get_u32(header + 8) != s->sequence + 1) {
    return 0;
  }
  r->type = get_u16(header + 4);
  r->bytes = orrery_get_u32(header + 12);
  r->time_ns = orrery_get_i64(header + 16);
  r->code = orrery_get_u32(header + 24);
  s->sequence++;
  if (r->bytes == 0) return 1;
  if (r->bytes > s->request_capacity) return 0;
  if (s->link->read(s->link->context, s->request, r->bytes + 4) < 0) return 0;
  crc = orrery_get_u32(s->request + r->bytes);
  s->request[r->bytes] = 0;
  return crc == orrery_crc32_sliced(&s->crc, s->request, r->bytes);
}

/* One field of CREATE. The texts end with 0 in what the library sees: the byte after them is the
 * next field's tag, so it is put there when all fields have been read. 0: not a field. */
static int take_field(wire_state* s, orrery_boot* boot, uint32_t tag, unsigned char* data,
                      uint32_t bytes) {
  switch (tag) {
    case ORRERY_WT_SPACECRAFT:
      boot->spacecraft = (const char*)data;
      return 1;
    case ORRERY_WT_PROCESS:
      boot->process = (const char*)data;
      return 1;
    case ORRERY_WT_BOOT_COUNT:
      if (bytes != 4) return 0;
      boot->boot_count = orrery_get_u32(data);
      return 1;
    case ORRERY_WT_CONFIG:
      boot->config = data;
      boot->config_bytes = bytes;
      return 1;
    case ORRERY_WT_STORAGE:
      if (bytes != 4) return 0;
      s->storage_bytes = orrery_get_u32(data);
      return 1;
    case ORRERY_WT_SLOT:
      return bytes >= 4 && store(s, orrery_get_u32(data), data + 4, bytes - 4) == ORRERY_OK;
    default:
      return 1; /* of a later version */
  }
}

static int read_boot(wire_state* s, const wire_request* r, orrery_boot* boot) {
  uint32_t at = 0, spacecraft_end = 0, process_end = 0;
  memset(boot, 0, sizeof *boot);
  boot->now_ns = r->time_ns;
  boot->reset_cause = r->code;
  boot->spacecraft = boot->process = "";
  boot->config = s->request;
  while (at < r->bytes) {
    uint32_t tag, bytes;
    if (r->bytes - at < 6) return 0;
    tag = get_u16(s->request + at);
    bytes = orrery_get_u32(s->request + at + 2);
    at += 6;
    if (bytes > r->bytes - at || !take_field(s, boot, tag, s->request + at, bytes)) return 0;
    at += bytes;
    if (tag == ORRERY_WT_SPACECRAFT) spacecraft_end = at;
    if (tag == ORRERY_WT_PROCESS) process_end = at;
  }
  if (spacecraft_end > 0) s->request[spacecraft_end] = 0;
  if (process_end > 0) s->request[process_end] = 0;
  return 1;
}

static void done(wire_state* s, int32_t status, const orrery_wire_cost* cost) {
  unsigned char payload[ORRERY_WIRE_DONE_BYTES];
  orrery_put_u32(payload, cost->unit);
  put_u64(payload + 4, cost->cost);
  put_u64(payload + 12, cost->heap_now);
  put_u64(payload + 20, cost->heap_peak);
  orrery_put_u32(payload + 28, s->asked_for_tick ? 1u : 0u);
  put_u64(payload + 32, cost->heap_size);
  put_u64(payload + 40, cost->heap_largest_free);
  put_header(s, ORRERY_W_DONE, sizeof payload, s->pending_tick, status);
  put(s, payload, sizeof payload);
  put_crc(s, orrery_crc32_sliced(&s->crc, payload, sizeof payload));
  flush(s);
}

static int32_t call_library(wire_state* s, const wire_request* r, const orrery_boot* boot) {
  switch (r->type) {
    case ORRERY_W_CREATE:
      return s->flight->create(&s->self, &s->host, boot);
    case ORRERY_W_INPUT:
      return s->flight->input(s->self, r->time_ns, r->code, s->request, r->bytes);
    case ORRERY_W_TICK:
      return s->flight->tick == NULL ? ORRERY_NOT_FOUND : s->flight->tick(s->self, r->time_ns);
    default:
      s->flight->destroy(s->self);
      return ORRERY_OK;
  }
}

/* 0: the link is broken. */
static int serve_request(wire_state* s, const wire_request* r) {
  orrery_boot boot;
  orrery_wire_cost cost;
  int32_t status;
  memset(&cost, 0, sizeof cost);
  if (r->type < ORRERY_W_CREATE || r->type > ORRERY_W_DESTROY) return 0;
  if ((r->type == ORRERY_W_CREATE) == (s->created != 0)) return 0;
  if (r->type == ORRERY_W_CREATE && !read_boot(s, r, &boot)) return 0;
  s->created = 1;
  s->asked_for_tick = 0;
  if (r->type == ORRERY_W_TICK) s->pending_tick = ORRERY_NO_TICK;
  s->in_call = r->type != ORRERY_W_DESTROY; /* which may only log */
  if (s->link->call_begins != NULL) s->link->call_begins(s->link->context);
  status = call_library(s, r, &boot);
  if (s->link->call_ended != NULL) s->link->call_ended(s->link->context, &cost);
  s->in_call = 0;
  done(s, status, &cost);
  return !s->broken;
}

int32_t orrery_wire_serve(const orrery_wire_link* link, const orrery_flight* flight, void* work,
                          uint32_t work_bytes) {
  wire_state* s;
  wire_request request;
  uint32_t room;
  unsigned char* memory = (unsigned char*)work;
  /* The state first, then the request, both on multiples of 8. */
  const uint32_t skip = (uint32_t)((8u - ((size_t)memory & 7u)) & 7u);
  const uint32_t state_bytes = (uint32_t)((sizeof(wire_state) + 7u) & ~(size_t)7u);
  if (work_bytes < ORRERY_WIRE_WORK_BYTES || skip + state_bytes + 64u > ORRERY_WIRE_WORK_BYTES) {
    return ORRERY_TOO_SMALL;
  }
  s = (wire_state*)(void*)(memory + skip);
  memset(s, 0, sizeof *s);
  s->link = link;
  s->flight = flight;
  orrery_crc32_fill(&s->crc);
  s->pending_tick = ORRERY_NO_TICK;
  s->storage_bytes = 0xFFFFFFFFu;
  room = work_bytes - skip - state_bytes;
  s->request = memory + skip + state_bytes;
  s->request_capacity = (room / 2u) & ~(uint32_t)7u;
  s->slots = s->request + s->request_capacity;
  s->slots_capacity = room - s->request_capacity;
  s->request_capacity -= 8u; /* the payload's CRC, or the 0 behind a text at the end */
  if (s->request_capacity > ORRERY_WIRE_MOST_BYTES) s->request_capacity = ORRERY_WIRE_MOST_BYTES;
  s->host.size = sizeof s->host;
  s->host.abi_version = ORRERY_ABI_VERSION;
  s->host.context = s;
  s->host.output = host_output;
  s->host.request_tick = host_request_tick;
  s->host.log = host_log;
  s->host.nv_load = host_nv_load;
  s->host.nv_store = host_nv_store;
  say_hello(s);
  do {
    if (s->broken || !read_request(s, &request) || !serve_request(s, &request)) {
      return ORRERY_REJECTED;
    }
  } while (request.type != ORRERY_W_DESTROY);
  return ORRERY_OK;
}
