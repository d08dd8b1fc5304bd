/// NovAtel OEM binary messages as a receiver sends them: framing, CRC and the BESTXYZ log.
///
/// Layout      OEM7 Commands and Logs Reference Manual (NovAtel OM-20000169), "Binary" and
///             "BESTXYZ"; little-endian and packed. Values are put byte by byte: no struct overlay,
///             so neither padding nor the host's byte order can leak in.
/// Checked by  test_suites/unit/models/gnss/novatel_test.cpp, also against real receivers' logs
#pragma once

#include <orrery/harness/kernel/bytes.hpp>
#include <orrery/harness/kernel/time.hpp>
#include <orrery/models/frames/vector.hpp>

#include <array>
#include <cstddef>
#include <cstdint>

namespace orrery::novatel {

constexpr std::size_t kHeaderBytes = 28;
constexpr std::size_t kCrcBytes = 4;
constexpr std::size_t kBestXyzBytes = 112;  // of the body

constexpr std::uint16_t kBestXyzId = 241;

/// Quality of the receiver's own time. The manual has more states; a reader drops kUnknown.
enum class TimeStatus : std::uint8_t { kUnknown = 20, kCoarse = 100, kFineSteering = 180 };

enum class SolutionStatus : std::uint32_t { kComputed = 0, kInsufficientObservations = 1 };
enum class SolutionType : std::uint32_t { kNone = 0, kDopplerVelocity = 8, kSingle = 16 };

/// The 28 bytes before each body. Defaults are those of a healthy receiver on COM1.
struct Header {
  std::uint16_t message_id = 0;
  SimTime t;  // sent as GPS week and milliseconds; what is below a millisecond is cut off
  std::uint8_t message_type = 0;  // bits 0-4 source (0: primary antenna), 5-6 format, 7 response
  std::uint8_t port_address = 0x20;
  std::uint16_t sequence = 0;
  std::uint8_t idle_time_half_percent = 100;
  TimeStatus time_status = TimeStatus::kFineSteering;
  std::uint32_t receiver_status = 0;
  std::uint16_t reserved = 0;
  std::uint16_t software_build = 16000;
};

/// Position and velocity of the antenna, log 241.
struct BestXyz {
  SolutionStatus position_status = SolutionStatus::kComputed;
  SolutionType position_type = SolutionType::kSingle;
  Vec3 r_ECEF;        // [m]
  Vec3 sigma_r_ECEF;  // 1-sigma per axis [m], sent as float
  SolutionStatus velocity_status = SolutionStatus::kComputed;
  SolutionType velocity_type = SolutionType::kDopplerVelocity;
  Vec3 v_ECEF;        // relative to the rotating Earth [m/s]
  Vec3 sigma_v_ECEF;  // 1-sigma per axis [m/s], sent as float
  std::array<char, 4> station_id{};
  float velocity_latency_s = 0;  // to subtract from the header's time for the velocity's
  float differential_age_s = 0;
  float solution_age_s = 0;
  std::uint8_t satellites_tracked = 0;
  std::uint8_t satellites_used = 0;
  std::uint8_t satellites_used_L1 = 0;
  std::uint8_t satellites_used_multi_frequency = 0;
  std::uint8_t extended_solution_status = 0;
  std::uint8_t galileo_beidou_mask = 0;
  std::uint8_t gps_glonass_mask = 0;  // 0x01: GPS L1 used
};

/// CRC-32 with the reflected polynomial 0xEDB88320, initial value 0 and no final inversion (zlib's
/// starts from all ones and inverts). `crc` continues an earlier call.
std::uint32_t crc32(Bytes bytes, std::uint32_t crc = 0);

/// Appends header, body and CRC to `out`. Allocates only if `out` has to grow.
/// @throws std::invalid_argument  `header.t` before the GPS epoch; a body above 65535 bytes.
void append_frame(const Header& header, Bytes body, ByteBuffer& out);

/// The same for a message: its id goes into the header in place of `header.message_id`.
void append(const Header& header, const BestXyz& message, ByteBuffer& out);

}  // namespace orrery::novatel
