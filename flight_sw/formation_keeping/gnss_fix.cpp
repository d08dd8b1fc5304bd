#include "bestxyz_parser.hpp"

#include <cmath>
#include <cstring>

#include "constants.hpp"
#include "orrery_messages.h"
#include "support/crc32.h"

namespace formation_keeping {
namespace {

constexpr unsigned char kSync[3] = {0xAA, 0x44, 0x12};
constexpr int kHeaderBytes = 28;
constexpr unsigned kBestxyz = 241;
constexpr unsigned kBodyBytes = 112;
constexpr unsigned kTimeUnknown = 20;  // time status: week and milliseconds mean nothing
constexpr std::uint32_t kSolutionComputed = 0;

// Anything outside is not a spacecraft near the Earth; it would only poison the filter.
constexpr double kMinRadius_m = 6.3e6;
constexpr double kMaxRadius_m = 5.0e7;
constexpr double kMaxSpeed_mps = 1.2e4;
constexpr std::int64_t kMaxEpoch_ns = 6200 * kWeek_ns;

unsigned u16_at(const unsigned char* at) {
  return static_cast<unsigned>(at[0]) | (static_cast<unsigned>(at[1]) << 8);
}

double f32_at(const unsigned char* at) {
  const std::uint32_t bits = orrery_get_u32(at);
  float value = 0.0f;
  std::memcpy(&value, &bits, sizeof value);
  return static_cast<double>(value);
}

flight_support::Vec3 f64x3_at(const unsigned char* at) {
  return flight_support::vec3(orrery_get_f64(at), orrery_get_f64(at + 8), orrery_get_f64(at + 16));
}

double rms_f32x3_at(const unsigned char* at) {
  const flight_support::Vec3 s = flight_support::vec3(f32_at(at), f32_at(at + 4), f32_at(at + 8));
  return std::sqrt(flight_support::dot(s, s) / 3.0);
}

}  // namespace

bool is_plausible(const GnssFix& fix) {
  const double r = flight_support::norm(fix.r_ECEF);
  const double v = flight_support::norm(fix.v_ECEF);
  // Written so that a NaN is not plausible.
  return r > kMinRadius_m && r < kMaxRadius_m && v < kMaxSpeed_mps && fix.sigma_r_m > 0.0 &&
         std::isfinite(fix.sigma_r_m) && fix.epoch_ns > 0 && fix.epoch_ns < kMaxEpoch_ns &&
         fix.sigma_v_mps > 0.0 && std::isfinite(fix.sigma_v_mps);
}

BestxyzParser::Event BestxyzParser::push(unsigned char byte) {
  held_[count_] = byte;
  ++count_;
  if (!could_be_frame()) {
    drop_first_and_resynchronise();
    return Event::kNothing;
  }
  if (count_ < kFrameBytes) return Event::kNothing;
  const std::uint32_t expected = orrery_get_u32(held_ + kFrameBytes - 4);
  if (flight_crc32_novatel(held_, kFrameBytes - 4) != expected) {
    drop_first_and_resynchronise();
    return Event::kBadFrame;
  }
  count_ = 0;
  return decode() ? Event::kFix : Event::kNoFix;
}

// Do the bytes held so far fit the start of a BESTXYZ frame?
bool BestxyzParser::could_be_frame() const {
  for (int k = 0; k < 3 && k < count_; ++k) {
    if (held_[k] != kSync[k]) return false;
  }
  if (count_ > 3 && held_[3] != kHeaderBytes) return false;
  if (count_ > 5 && u16_at(held_ + 4) != kBestxyz) return false;
  // Bits 5-6: binary format; bit 7: a response to a command, not a log.
  if (count_ > 6 && (held_[6] & 0xE0u) != 0) return false;
  if (count_ > 9 && u16_at(held_ + 8) != kBodyBytes) return false;
  return true;
}

void BestxyzParser::drop_first_and_resynchronise() {
  do {
    --count_;
    std::memmove(held_, held_ + 1, static_cast<std::size_t>(count_));
  } while (count_ > 0 && !could_be_frame());
}

bool BestxyzParser::decode() {
  const unsigned char* body = held_ + kHeaderBytes;
  const unsigned week = u16_at(held_ + 14);
  const std::uint32_t ms = orrery_get_u32(held_ + 16);
  const bool has_time = held_[13] != kTimeUnknown && week != 0 && ms < 604800000u;
  const bool has_position =
      orrery_get_u32(body) == kSolutionComputed && orrery_get_u32(body + 4) != 0;
  const bool has_velocity =
      orrery_get_u32(body + 44) == kSolutionComputed && orrery_get_u32(body + 48) != 0;
  if (!has_time || !has_position || !has_velocity) return false;

  GnssFix fix;
  fix.epoch_ns =
      static_cast<std::int64_t>(week) * kWeek_ns + static_cast<std::int64_t>(ms) * 1000000;
  fix.r_ECEF = f64x3_at(body + 8);
  fix.sigma_r_m = rms_f32x3_at(body + 32);
  fix.v_ECEF = f64x3_at(body + 52);
  fix.sigma_v_mps = rms_f32x3_at(body + 76);
  if (!is_plausible(fix)) return false;
  fix_ = fix;
  return true;
}

}  // namespace formation_keeping
