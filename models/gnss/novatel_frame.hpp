/// Inside of the NovAtel encoder: puts one frame at the end of a buffer.
#pragma once

#include <orrery/models/gnss/novatel.hpp>

#include <bit>
#include <span>
#include <string_view>

namespace orrery::novatel {

/// Puts values one after another, least significant byte first. The caller provides the room.
class Writer {
 public:
  explicit Writer(std::byte* at) : at_(at) {}

  void u8(std::uint8_t value) { *at_++ = std::byte{value}; }
  void u16(std::uint16_t value) { put<2>(value); }
  void u32(std::uint32_t value) { put<4>(value); }
  void i32(std::int32_t value) { put<4>(static_cast<std::uint32_t>(value)); }
  void f32(float value) { put<4>(std::bit_cast<std::uint32_t>(value)); }
  void f64(double value) { put<8>(std::bit_cast<std::uint64_t>(value)); }
  void f64(const Vec3& value) {
    f64(value.x);
    f64(value.y);
    f64(value.z);
  }
  void f32(const Vec3& value) {
    f32(static_cast<float>(value.x));
    f32(static_cast<float>(value.y));
    f32(static_cast<float>(value.z));
  }
  void bytes(Bytes value) {
    for (const std::byte b : value) *at_++ = b;
  }
  /// `width` bytes: the start of the text, then zeros.
  void text(std::string_view value, std::size_t width) {
    for (std::size_t i = 0; i < width; ++i) {
      u8(i < value.size() ? static_cast<std::uint8_t>(value[i]) : std::uint8_t{0});
    }
  }

 private:
  template <int kBytes>
  void put(std::uint64_t value) {
    for (int i = 0; i < kBytes; ++i) at_[i] = static_cast<std::byte>((value >> (8 * i)) & 0xFFu);
    at_ += kBytes;
  }

  std::byte* at_;
};

/// A frame under construction: the header is there, the body is to be filled, close() adds the CRC.
class Frame {
 public:
  /// @throws std::invalid_argument  as append_frame; `out` is unchanged.
  Frame(const Header& header, std::uint16_t message_id, std::size_t body_bytes, ByteBuffer& out);

  Writer body() { return Writer(out_->data() + start_ + kHeaderBytes); }
  void close();

 private:
  ByteBuffer* out_;
  std::size_t start_;
};

/// A frame whose body is a count and so many entries; put(entry, writer) puts `entry_bytes`.
template <class Entry, class Put>
void append_array(const Header& header, std::uint16_t message_id, std::span<const Entry> entries,
                  std::size_t entry_bytes, Put put, ByteBuffer& out) {
  Frame frame(header, message_id, 4 + entries.size() * entry_bytes, out);
  Writer w = frame.body();
  w.u32(static_cast<std::uint32_t>(entries.size()));
  for (const Entry& entry : entries) put(entry, w);
  frame.close();
}

}  // namespace orrery::novatel
