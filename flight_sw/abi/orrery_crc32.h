/* CRC-32 of reflected polynomial 0xEDB88320, with the starting value and final inversion left open.
 * C89, a table of 64 bytes.
 *
 * The common CRC-32 (zlib, IEEE 802.3) starts at 0xFFFFFFFF and inverts: "123456789" gives
 * 0xCBF43926. */
#ifndef ORRERY_CRC32_H
#define ORRERY_CRC32_H

#include <stddef.h>
#include <stdint.h>

#include "orrery_messages.h"

/* Four bits per step. */
ORRERY_MAYBE_UNUSED static uint32_t orrery_crc32_update(uint32_t crc, const unsigned char* data,
                                                        size_t bytes) {
  static const uint32_t kNibble[16] = {0x00000000u, 0x1DB71064u, 0x3B6E20C8u, 0x26D930ACu,
                                       0x76DC4190u, 0x6B6B51F4u, 0x4DB26158u, 0x5005713Cu,
                                       0xEDB88320u, 0xF00F9344u, 0xD6D6A3E8u, 0xCB61B38Cu,
                                       0x9B64C2B0u, 0x86D3D2D4u, 0xA00AE278u, 0xBDBDF21Cu};
  size_t k;
  for (k = 0; k < bytes; k++) {
    crc ^= data[k];
    crc = (crc >> 4) ^ kNibble[crc & 0xFu];
    crc = (crc >> 4) ^ kNibble[crc & 0xFu];
  }
  return crc;
}

ORRERY_MAYBE_UNUSED static uint32_t orrery_crc32(const unsigned char* data, size_t bytes) {
  return orrery_crc32_update(0xFFFFFFFFu, data, bytes) ^ 0xFFFFFFFFu;
}

#endif
