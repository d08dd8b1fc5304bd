/* A target that breaks the rules of orrery_wire.h in one way each: `bad_target WAY`. It says HELLO
 * as it should unless the way is about that, then waits for the first request. */
#define _POSIX_C_SOURCE 200809L
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "orrery_crc32.h"
#include "orrery_wire.h"

static const char* way;
static int is(const char* name) {
  return strcmp(way, name) == 0;
}

static void send_all(const unsigned char* data, size_t bytes) {
  while (bytes > 0) {
    const ssize_t n = write(STDOUT_FILENO, data, bytes);
    if (n <= 0) exit(9);
    data += n;
    bytes -= (size_t)n;
  }
}

static void receive(unsigned char* data, size_t bytes) {
  while (bytes > 0) {
    const ssize_t n = read(STDIN_FILENO, data, bytes);
    if (n <= 0) exit(9);
    data += n;
    bytes -= (size_t)n;
  }
}

typedef struct frame {
  unsigned magic, type, version, sequence;
  unsigned announced; /* bytes of the payload, as the header says */
  int64_t time_ns;
  int32_t code;
} frame;

static void put_header(unsigned char* header, frame f) {
  orrery_put_u32(header, f.magic);
  orrery_put_u32(header + 4, f.type | f.version << 16);
  orrery_put_u32(header + 8, f.sequence);
  orrery_put_u32(header + 12, f.announced);
  orrery_put_i64(header + 16, f.time_ns);
  orrery_put_u32(header + 24, (uint32_t)f.code);
  orrery_put_u32(header + 28, orrery_crc32(header, 28) ^ (is("header crc") ? 1u : 0u));
}

static void send_many(frame f) {
  static unsigned char frames[2048 * ORRERY_WIRE_HEADER_BYTES];
  size_t i;
  for (i = 0; i < sizeof frames; i += ORRERY_WIRE_HEADER_BYTES) put_header(frames + i, f);
  for (;;) send_all(frames, sizeof frames);
}

static void send_frame(frame f, const void* payload, unsigned bytes) {
  unsigned char header[ORRERY_WIRE_HEADER_BYTES], crc[4];
  put_header(header, f);
  send_all(header, sizeof header);
  if (bytes == 0) return;
  send_all(payload, bytes);
  orrery_put_u32(crc, orrery_crc32(payload, bytes) ^ (is("payload crc") ? 1u : 0u));
  send_all(crc, sizeof crc);
}

static frame a_frame(unsigned type, unsigned sequence, unsigned bytes) {
  const frame f = {ORRERY_WIRE_MAGIC, type, ORRERY_ABI_VERSION, sequence, bytes, -1, 0};
  return f;
}

/* name "bad", version "1", one output port 7 of 16 bytes named "say" */
static void say_hello(void) {
  static const unsigned char hello[] = {0,   16, 0,  0, 3, 0, 'b', 'a', 'd', 1,   0,
                                        '1', 1,  0,  0, 0, 7, 0,   0,   0,   1,   0,
                                        0,   0,  16, 0, 0, 0, 3,   0,   's', 'a', 'y'};
  frame f = a_frame(ORRERY_W_HELLO, 0, sizeof hello);
  if (is("version")) f.version = 2;
  if (is("short hello")) {
    f.announced = 20;
    send_frame(f, hello, 20);
    return;
  }
  if (is("endless hello")) f.announced = 0xFFFFFFF0u;
  if (is("no hello")) f.type = ORRERY_W_DONE;
  send_frame(f, hello, sizeof hello);
}

static unsigned char request[8192];

static unsigned receive_request(void) {
  unsigned bytes;
  receive(request, ORRERY_WIRE_HEADER_BYTES);
  bytes = orrery_get_u32(request + 12);
  if (bytes > sizeof request - 64) exit(8);
  if (bytes > 0) receive(request + ORRERY_WIRE_HEADER_BYTES, bytes + 4);
  return orrery_get_u32(request + 8);
}

static void answer(unsigned sequence) {
  static unsigned char done[ORRERY_WIRE_DONE_BYTES];
  send_frame(a_frame(ORRERY_W_DONE, sequence, sizeof done), done, sizeof done);
}

static void misbehave(unsigned sequence) {
  frame f = a_frame(ORRERY_W_OUTPUT, sequence, 4);
  f.code = 7;
  if (is("killed")) raise(SIGKILL);
  if (is("stopped")) raise(SIGSTOP);
  if (is("exits")) exit(3);
  if (is("silent")) sleep(1000);
  if (is("late")) sleep(3);
  if (is("garbage")) {
    memset(request, 0x5A, sizeof request);
    for (;;) send_all(request, sizeof request);
  }
  if (is("half a frame")) {
    send_all((const unsigned char*)"ORRY", 4);
    sleep(1000);
  }
  if (is("wrong sequence")) f.sequence = sequence + 1;
  if (is("unknown type")) f.type = 99;
  if (is("unknown port")) f.code = 8;
  if (is("too large")) f.announced = 17;
  if (is("huge")) f.announced = 0x7FFFFFFFu;
  if (is("twice")) answer(sequence);
  if (is("endless")) {
    f.type = ORRERY_W_LOG;
    f.announced = 0;
    send_many(f);
  }
  send_frame(f, "abcd", 4);
  answer(sequence);
}

int main(int argc, char** argv) {
  way = argc == 2 ? argv[1] : "";
  say_hello();
  for (;;) misbehave(receive_request());
}
