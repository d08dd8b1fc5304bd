/// What both ends of the wire need to make frames.
#pragma once

#include <cstddef>
#include <cstdint>
#include <orrery_crc32_sliced.h>
#include <vector>

using Buffer = std::vector<unsigned char>;

inline std::uint32_t crc32(const unsigned char* data, std::size_t bytes) {
  static const orrery_crc32_tables tables = [] {
    orrery_crc32_tables filled;
    orrery_crc32_fill(&filled);
    return filled;
  }();
  return orrery_crc32_sliced(&tables, data, bytes);
}

inline void append_u32(Buffer& to, std::uint32_t value) {
  unsigned char bytes[4];
  orrery_put_u32(bytes, value);
  to.insert(to.end(), bytes, bytes + 4);
}
