#include <orrery/models/gnss/novatel.hpp>

#include <bit>
#include <stdexcept>
#include <string>

namespace orrery::novatel {

namespace {

constexpr std::array<std::uint32_t, 256> make_crc_table() {
  std::array<std::uint32_t, 256> table{};
  for (std::uint32_t i = 0; i < 256; ++i) {
    std::uint32_t value = i;
    for (int bit = 0; bit < 8; ++bit) {
      value = (value & 1u) != 0 ? (value >> 1) ^ 0xEDB88320u : value >> 1;
    }
    table[i] = value;
  }
  return table;
}

constexpr std::array<std::uint32_t, 256> kCrcTable = make_crc_table();

/// Puts values one after another, least significant byte first. The caller provides the room.
class Writer {
 public:
  explicit Writer(std::byte* at) : at_(at) {}

  void u8(std::uint8_t value) { *at_++ = std::byte{value}; }
  void u16(std::uint16_t value) { put(value, 2); }
  void u32(std::uint32_t value) { put(value, 4); }
  void f32(float value) { put(std::bit_cast<std::uint32_t>(value), 4); }
  void f64(double value) { put(std::bit_cast<std::uint64_t>(value), 8); }
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

 private:
  void put(std::uint64_t value, int bytes) {
    for (int i = 0; i < bytes; ++i) {
      *at_++ = static_cast<std::byte>((value >> (8 * i)) & 0xFFu);
    }
  }

  std::byte* at_;
};

/// GPS time as NovAtel counts it; the week is not reduced modulo 1024.
struct WeekTime {
  std::uint16_t week;
  std::uint32_t ms;
};

WeekTime to_week_time(SimTime t) {
  constexpr std::int64_t kNsPerMs = 1'000'000;
  constexpr std::int64_t kMsPerWeek = 604'800'000;
  if (to_ns(t) < 0) {
    throw std::invalid_argument("novatel::append_frame: t = " + std::to_string(to_ns(t)) +
                                " ns is before the GPS epoch, 0 ns");
  }
  const std::int64_t ms = to_ns(t) / kNsPerMs;
  return {static_cast<std::uint16_t>(ms / kMsPerWeek), static_cast<std::uint32_t>(ms % kMsPerWeek)};
}

void put_header(const Header& header, std::uint16_t body_bytes, std::byte* at) {
  const WeekTime time = to_week_time(header.t);
  Writer w(at);
  w.u8(0xAA);
  w.u8(0x44);
  w.u8(0x12);
  w.u8(kHeaderBytes);
  w.u16(header.message_id);
  w.u8(header.message_type);
  w.u8(header.port_address);
  w.u16(body_bytes);
  w.u16(header.sequence);
  w.u8(header.idle_time_half_percent);
  w.u8(static_cast<std::uint8_t>(header.time_status));
  w.u16(time.week);
  w.u32(time.ms);
  w.u32(header.receiver_status);
  w.u16(header.reserved);
  w.u16(header.software_build);
}

}  // namespace

std::uint32_t crc32(Bytes bytes, std::uint32_t crc) {
  for (const std::byte b : bytes) {
    crc = (crc >> 8) ^ kCrcTable[(crc ^ std::to_integer<std::uint32_t>(b)) & 0xFFu];
  }
  return crc;
}

std::array<std::byte, kBestXyzBytes> encode(const BestXyz& message) {
  std::array<std::byte, kBestXyzBytes> body;
  Writer w(body.data());
  w.u32(static_cast<std::uint32_t>(message.position_status));
  w.u32(static_cast<std::uint32_t>(message.position_type));
  w.f64(message.r_ECEF);
  w.f32(message.sigma_r_ECEF);
  w.u32(static_cast<std::uint32_t>(message.velocity_status));
  w.u32(static_cast<std::uint32_t>(message.velocity_type));
  w.f64(message.v_ECEF);
  w.f32(message.sigma_v_ECEF);
  for (const char c : message.station_id) w.u8(static_cast<std::uint8_t>(c));
  w.f32(message.velocity_latency_s);
  w.f32(message.differential_age_s);
  w.f32(message.solution_age_s);
  w.u8(message.satellites_tracked);
  w.u8(message.satellites_used);
  w.u8(message.satellites_used_L1);
  w.u8(message.satellites_used_multi_frequency);
  w.u8(0);  // reserved
  w.u8(message.extended_solution_status);
  w.u8(message.galileo_beidou_mask);
  w.u8(message.gps_glonass_mask);
  return body;
}

void append_frame(const Header& header, Bytes body, ByteBuffer& out) {
  if (body.size() > 0xFFFF) {
    throw std::invalid_argument("novatel::append_frame: body of " + std::to_string(body.size()) +
                                " bytes; the length field holds 0 to 65535");
  }
  std::array<std::byte, kHeaderBytes> head;
  put_header(header, static_cast<std::uint16_t>(body.size()), head.data());
  std::array<std::byte, kCrcBytes> tail;
  Writer(tail.data()).u32(crc32(body, crc32(head)));
  out.insert(out.end(), head.begin(), head.end());
  out.insert(out.end(), body.begin(), body.end());
  out.insert(out.end(), tail.begin(), tail.end());
}

void append(const Header& header, const BestXyz& message, ByteBuffer& out) {
  Header with_id = header;
  with_id.message_id = kBestXyzId;
  append_frame(with_id, encode(message), out);
}

}  // namespace orrery::novatel
