#include <string.h>

#include "novatel.h"
#include "orrery_messages.h"
#include "support/crc32.h"

#define SHORT_HEADER_BYTES 12u
#define ENOUGH_BYTES 10u /* of a header to know the frame's length */

static uint16_t u16_at(const unsigned char* at) {
  return (uint16_t)(at[0] | (at[1] << 8));
}

int novatel_framer_init(novatel_framer* framer, unsigned char* room, size_t capacity) {
  memset(framer, 0, sizeof *framer);
  framer->room = room;
  framer->capacity = capacity >= NOVATEL_HEADER_BYTES + NOVATEL_CRC_BYTES ? capacity : 0;
  return framer->capacity > 0;
}

static void drop_given(novatel_framer* framer) {
  framer->begin += framer->given;
  framer->given = 0;
}

size_t novatel_framer_write(novatel_framer* framer, const unsigned char* bytes, size_t count) {
  size_t room;
  drop_given(framer);
  if (framer->capacity == 0) return count; /* nothing is ever found */
  if (framer->begin > 0) {
    memmove(framer->room, framer->room + framer->begin, framer->end - framer->begin);
    framer->end -= framer->begin;
    framer->begin = 0;
  }
  room = framer->capacity - framer->end;
  if (count > room) count = room;
  if (count > 0) memcpy(framer->room + framer->end, bytes, count);
  framer->end += count;
  return count;
}

/* Do `count` bytes, at least one, fit the start of a header? */
static int could_be_header(const unsigned char* at, size_t count) {
  if (at[0] != 0xAA) return 0;
  if (count > 1 && at[1] != 0x44) return 0;
  if (count > 2 && at[2] == 0x13) return 1;
  if (count > 2 && at[2] != 0x12) return 0;
  if (count > 3 && at[3] != NOVATEL_HEADER_BYTES) return 0;
  if (count > 6 && (at[6] & 0x60u) != 0) return 0; /* format: not binary */
  return 1;
}

static int is_short(const unsigned char* at) {
  return at[2] == 0x13;
}

/* Header, body and CRC, from the first ENOUGH_BYTES. */
static size_t frame_bytes(const unsigned char* at) {
  if (is_short(at)) return SHORT_HEADER_BYTES + at[3] + NOVATEL_CRC_BYTES;
  return NOVATEL_HEADER_BYTES + (size_t)u16_at(at + 8) + NOVATEL_CRC_BYTES;
}

static int crc_is_right(const unsigned char* at, size_t total) {
  const size_t crc_at = total - NOVATEL_CRC_BYTES;
  return flight_crc32_novatel(at, crc_at) == orrery_get_u32(at + crc_at);
}

static void give(const unsigned char* at, novatel_frame* frame) {
  novatel_header* header = &frame->header;
  header->message_id = u16_at(at + 4);
  header->message_type = at[6];
  header->port_address = at[7];
  header->body_bytes = u16_at(at + 8);
  header->sequence = u16_at(at + 10);
  header->idle_time_half_percent = at[12];
  header->time_status = at[13];
  header->week = u16_at(at + 14);
  header->ms = orrery_get_u32(at + 16);
  header->receiver_status = orrery_get_u32(at + 20);
  header->reserved = u16_at(at + 24);
  header->software_build = u16_at(at + 26);
  frame->body = at + NOVATEL_HEADER_BYTES;
}

static void pass_over_one(novatel_framer* framer) {
  framer->begin++;
  framer->passed_over++;
}

int novatel_framer_next(novatel_framer* framer, novatel_frame* frame) {
  drop_given(framer);
  while (framer->begin < framer->end) {
    const unsigned char* at = framer->room + framer->begin;
    const size_t held = framer->end - framer->begin;
    size_t total;
    if (!could_be_header(at, held)) {
      pass_over_one(framer);
      continue;
    }
    if (held < ENOUGH_BYTES) return 0;
    total = frame_bytes(at);
    if (total > framer->capacity) {
      pass_over_one(framer);
      continue;
    }
    if (held < total) return 0;
    if (!crc_is_right(at, total)) {
      framer->bad_frames++;
      pass_over_one(framer);
      continue;
    }
    framer->given = total;
    if (is_short(at)) {
      framer->short_frames++;
      drop_given(framer);
      continue;
    }
    framer->frames++;
    give(at, frame);
    return 1;
  }
  return 0;
}
