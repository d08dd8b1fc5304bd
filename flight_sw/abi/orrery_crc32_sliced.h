/* The CRC-32 of orrery_crc32.h four bytes per step, with 4 KiB of tables that the caller supplies:
 * for whoever sums all that comes and goes. C89; allocates nothing. */
#ifndef ORRERY_CRC32_SLICED_H
#define ORRERY_CRC32_SLICED_H

#include "orrery_crc32.h"

typedef struct orrery_crc32_tables { /* [k]: of a byte that k bytes of 0 follow */
  uint32_t of[4][256];
} orrery_crc32_tables;

ORRERY_MAYBE_UNUSED static void orrery_crc32_fill(orrery_crc32_tables* tables) {
  uint32_t* const of_byte = tables->of[0];
  uint32_t crc = 1, bit, byte, before;
  of_byte[0] = 0;
  for (bit = 128; bit > 0; bit >>= 1) { /* of a byte with two bits: both bits' sums */
    crc = (crc >> 1) ^ ((crc & 1u) * 0xEDB88320u);
    for (byte = 0; byte < 256; byte += 2 * bit) of_byte[byte + bit] = of_byte[byte] ^ crc;
  }
  for (byte = 0; byte < 256; byte++) {
    before = of_byte[byte];
    tables->of[1][byte] = before = (before >> 8) ^ of_byte[before & 0xFFu];
    tables->of[2][byte] = before = (before >> 8) ^ of_byte[before & 0xFFu];
    tables->of[3][byte] = (before >> 8) ^ of_byte[before & 0xFFu];
  }
}

ORRERY_MAYBE_UNUSED static uint32_t orrery_crc32_sliced_update(const orrery_crc32_tables* tables,
                                                               uint32_t crc,
                                                               const unsigned char* data,
                                                               size_t bytes) {
  for (; bytes >= 4; bytes -= 4, data += 4) {
    crc ^= (uint32_t)data[0] | (uint32_t)data[1] << 8 | (uint32_t)data[2] << 16 |
           (uint32_t)data[3] << 24; /* one load where the processor has it, and no loop */
    crc = tables->of[3][crc & 0xFFu] ^ tables->of[2][(crc >> 8) & 0xFFu] ^
          tables->of[1][(crc >> 16) & 0xFFu] ^ tables->of[0][crc >> 24];
  }
  for (; bytes > 0; bytes--, data++) crc = (crc >> 8) ^ tables->of[0][(crc ^ *data) & 0xFFu];
  return crc;
}

ORRERY_MAYBE_UNUSED static uint32_t orrery_crc32_sliced(const orrery_crc32_tables* tables,
                                                        const unsigned char* data, size_t bytes) {
  return orrery_crc32_sliced_update(tables, 0xFFFFFFFFu, data, bytes) ^ 0xFFFFFFFFu;
}

#endif
