/// Writes and reads little-endian numbers one after the other, in a buffer of fixed size.
#pragma once

#include <cstdint>

#include "orrery_messages.h"

namespace formation_gnc {

/// What does not fit is not written, and fits() says so.
class ByteWriter {
 public:
  ByteWriter(unsigned char* data, std::uint32_t capacity) : data_(data), capacity_(capacity) {}
  void u8(unsigned value) {
    if (room(1)) data_[bytes_++] = static_cast<unsigned char>(value & 0xFFu);
  }
  void u32(std::uint32_t value) {
    if (room(4)) orrery_put_u32(data_ + bytes_, value), bytes_ += 4;
  }
  void i64(std::int64_t value) {
    if (room(8)) orrery_put_i64(data_ + bytes_, value), bytes_ += 8;
  }
  void f64(double value) {
    if (room(8)) orrery_put_f64(data_ + bytes_, value), bytes_ += 8;
  }
  bool fits() const { return fits_; }
  std::uint32_t bytes() const { return bytes_; }

 private:
  bool room(std::uint32_t count) {
    fits_ = fits_ && bytes_ + count <= capacity_;
    return fits_;
  }
  unsigned char* data_;
  std::uint32_t capacity_, bytes_ = 0;
  bool fits_ = true;
};

/// Beyond the end everything reads as 0, and whole() is false.
class ByteReader {
 public:
  ByteReader(const unsigned char* data, std::uint32_t bytes) : data_(data), left_(bytes) {}
  unsigned u8() {
    const unsigned char* at = take(1);
    return at != nullptr ? *at : 0;
  }
  std::uint32_t u32() {
    const unsigned char* at = take(4);
    return at != nullptr ? orrery_get_u32(at) : 0;
  }
  std::int64_t i64() {
    const unsigned char* at = take(8);
    return at != nullptr ? orrery_get_i64(at) : 0;
  }
  double f64() {
    const unsigned char* at = take(8);
    return at != nullptr ? orrery_get_f64(at) : 0.0;
  }
  /// Everything was there, and nothing is left.
  bool whole() const { return !overrun_ && left_ == 0; }

 private:
  const unsigned char* take(std::uint32_t count) {
    if (overrun_ || count > left_) {
      overrun_ = true;
      return nullptr;
    }
    const unsigned char* at = data_;
    data_ += count;
    left_ -= count;
    return at;
  }
  const unsigned char* data_;
  std::uint32_t left_;
  bool overrun_ = false;
};

}  // namespace formation_gnc
