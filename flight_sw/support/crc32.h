/* The CRC-32s that flight packages meet. C89.
 *
 * NovAtel frames start at 0 and invert nothing: CRC("123456789") = 0x2DFD2D88.
 * The common CRC-32 (zlib, IEEE 802.3): 0xCBF43926.
 */
#ifndef FLIGHT_SUPPORT_CRC32_H
#define FLIGHT_SUPPORT_CRC32_H

#include "orrery_crc32.h"

ORRERY_MAYBE_UNUSED static uint32_t flight_crc32_novatel(const unsigned char* data, size_t bytes) {
  return orrery_crc32_update(0u, data, bytes);
}

ORRERY_MAYBE_UNUSED static uint32_t flight_crc32_common(const unsigned char* data, size_t bytes) {
  return orrery_crc32(data, bytes);
}

#endif
