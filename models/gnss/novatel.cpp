#include <orrery/models/gnss/crc_fold.hpp>
#include <orrery/models/gnss/novatel.hpp>
#include <orrery/models/gnss/novatel_frame.hpp>

#include <algorithm>
#include <stdexcept>
#include <string>

namespace orrery::novatel {

namespace {

constexpr std::size_t kSlices = 8;
using CrcTable = std::array<std::uint32_t, 256>;

constexpr std::uint32_t one_byte(std::uint32_t value) {
  for (int bit = 0; bit < 8; ++bit) {
    value = (value & 1u) != 0 ? (value >> 1) ^ 0xEDB88320u : value >> 1;
  }
  return value;
}

// Table k: the remainder of a byte that k more zero bytes follow.
constexpr std::array<CrcTable, kSlices> make_crc_tables() {
  std::array<CrcTable, kSlices> tables{};
  for (std::uint32_t i = 0; i < 256; ++i) tables[0][i] = one_byte(i);
  for (std::size_t k = 1; k < kSlices; ++k) {
    for (std::size_t i = 0; i < 256; ++i) {
      const std::uint32_t before = tables[k - 1][i];
      tables[k][i] = (before >> 8) ^ tables[0][before & 0xFFu];
    }
  }
  return tables;
}

constexpr std::array<CrcTable, kSlices> kCrcTables = make_crc_tables();

std::uint32_t u32_at(const std::byte* at) {
  std::uint32_t value = 0;
  for (int i = 0; i < 4; ++i) value |= std::to_integer<std::uint32_t>(at[i]) << (8 * i);
  return value;
}

// Eight bytes per step: the division is linear, so the remainders of the single bytes add up
// (Kounavis & Berry, "Novel Table Lookup-Based Algorithms for High-Performance CRC Generation",
// 2008). Byte by byte a RANGE of 12 satellites would cost more than encoding it.
std::uint32_t crc32_of_eight(const std::byte* at, std::uint32_t crc) {
  const std::uint32_t low = u32_at(at) ^ crc;
  const std::uint32_t high = u32_at(at + 4);
  return kCrcTables[7][low & 0xFFu] ^ kCrcTables[6][(low >> 8) & 0xFFu] ^
         kCrcTables[5][(low >> 16) & 0xFFu] ^ kCrcTables[4][low >> 24] ^
         kCrcTables[3][high & 0xFFu] ^ kCrcTables[2][(high >> 8) & 0xFFu] ^
         kCrcTables[1][(high >> 16) & 0xFFu] ^ kCrcTables[0][high >> 24];
}

/// GPS time as NovAtel counts it; the week is not reduced modulo 1024.
struct WeekTime {
  std::uint16_t week;
  std::uint32_t ms;
};

WeekTime to_week_time(SimTime t) {
  constexpr std::int64_t kNsPerMs = 1'000'000;
  constexpr std::int64_t kMsPerWeek = 604'800'000;
  if (to_ns(t) < 0) {
    throw std::invalid_argument("novatel: header.t = " + std::to_string(to_ns(t)) +
                                " ns is before the GPS epoch, 0 ns");
  }
  const std::int64_t ms = to_ns(t) / kNsPerMs;
  return {static_cast<std::uint16_t>(ms / kMsPerWeek), static_cast<std::uint32_t>(ms % kMsPerWeek)};
}

void check_body_size(std::size_t bytes) {
  if (bytes <= 0xFFFF) return;
  throw std::invalid_argument("novatel: body of " + std::to_string(bytes) +
                              " bytes; the length field holds 0 to 65535");
}

void put_header(const Header& header, std::uint16_t message_id, WeekTime time,
                std::uint16_t body_bytes, Writer w) {
  w.u8(0xAA);
  w.u8(0x44);
  w.u8(0x12);
  w.u8(kHeaderBytes);
  w.u16(message_id);
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

void put(const BestXyz& message, Writer w) {
  w.u32(static_cast<std::uint32_t>(message.position_status));
  w.u32(static_cast<std::uint32_t>(message.position_type));
  w.f64(message.r_ECEF);
  w.f32(message.sigma_r_ECEF);
  w.u32(static_cast<std::uint32_t>(message.velocity_status));
  w.u32(static_cast<std::uint32_t>(message.velocity_type));
  w.f64(message.v_ECEF);
  w.f32(message.sigma_v_ECEF);
  w.text({message.station_id.data(), message.station_id.size()}, 4);
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
}

// By carry-less products where the processor has them (__builtin_cpu_supports asks the operating
// system, too): as many bytes as that takes, and what they leave as a remainder of the next ones.
std::uint32_t crc32_of_blocks(Bytes& bytes, std::uint32_t crc) {
#if defined(ORRERY_CRC_CLMUL)
  if (bytes.size() < kCrcFoldBytes || __builtin_cpu_supports("pclmul") == 0) return crc;
  const CrcFold fold = crc_fold_clmul(bytes, crc);
  bytes = bytes.subspan(fold.consumed);
  return crc32(fold.remainder, 0);
#else
  (void)bytes;
  return crc;
#endif
}

}  // namespace

std::uint32_t crc32(Bytes bytes, std::uint32_t crc) {
  crc = crc32_of_blocks(bytes, crc);
  const std::byte* at = bytes.data();
  std::size_t left = bytes.size();
  for (; left >= kSlices; at += kSlices, left -= kSlices) crc = crc32_of_eight(at, crc);
  for (; left > 0; ++at, --left) {
    crc = (crc >> 8) ^ kCrcTables[0][(crc ^ std::to_integer<std::uint32_t>(*at)) & 0xFFu];
  }
  return crc;
}

Frame::Frame(const Header& header, std::uint16_t message_id, std::size_t body_bytes,
             ByteBuffer& out)
    : out_(&out), start_(out.size()) {
  check_body_size(body_bytes);
  const WeekTime time = to_week_time(header.t);
  out.resize(start_ + kHeaderBytes + body_bytes + kCrcBytes);
  put_header(header, message_id, time, static_cast<std::uint16_t>(body_bytes),
             Writer(out.data() + start_));
}

void Frame::close() {
  const std::size_t crc_at = out_->size() - kCrcBytes;
  Writer(out_->data() + crc_at).u32(crc32(Bytes(*out_).subspan(start_, crc_at - start_)));
}

void append_frame(const Header& header, Bytes body, ByteBuffer& out) {
  Frame frame(header, header.message_id, body.size(), out);
  frame.body().bytes(body);
  frame.close();
}

void append(const Header& header, const BestXyz& message, ByteBuffer& out) {
  Frame frame(header, kBestXyzId, kBestXyzBytes, out);
  put(message, frame.body());
  frame.close();
}

}  // namespace orrery::novatel
