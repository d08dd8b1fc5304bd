#include "crosslink_protocol.hpp"

#include <cmath>

#include "orrery_messages.h"
#include "support/crc32.h"

namespace formation_keeping {

using namespace flight_support;

namespace {

constexpr unsigned char kMagicAndVersion[3] = {0x46, 0x4B, 1};
constexpr std::uint32_t kCrcAt = kCrosslinkBytes - 4;
constexpr std::uint32_t kWindow = 64;

bool is_sound(const unsigned char* message, std::uint32_t bytes, Role peer) {
  if (bytes != kCrosslinkBytes) return false;
  if (orrery_get_u32(message + kCrcAt) != flight_crc32_common(message, kCrcAt)) return false;
  for (int k = 0; k < 3; ++k) {
    if (message[k] != kMagicAndVersion[k]) return false;
  }
  return message[3] == static_cast<unsigned char>(peer);
}

GnssFix fix_in(const unsigned char* message) {
  GnssFix fix;
  fix.epoch_ns = orrery_get_i64(message + 12);
  for (int k = 0; k < 3; ++k) {
    fix.r_ECEF[k] = orrery_get_f64(message + 20 + 8 * k);
    fix.v_ECEF[k] = orrery_get_f64(message + 44 + 8 * k);
  }
  fix.sigma_r_m = orrery_get_f64(message + 68);
  fix.sigma_v_mps = orrery_get_f64(message + 76);
  return fix;
}

}  // namespace

void CrosslinkSender::pack(const GnssFix& fix, unsigned char (&message)[kCrosslinkBytes]) {
  for (int k = 0; k < 3; ++k) message[k] = kMagicAndVersion[k];
  message[3] = static_cast<unsigned char>(role_);
  orrery_put_u32(message + 4, boot_count_);
  orrery_put_u32(message + 8, next_sequence_);
  orrery_put_i64(message + 12, fix.epoch_ns);
  for (int k = 0; k < 3; ++k) {
    orrery_put_f64(message + 20 + 8 * k, fix.r_ECEF[k]);
    orrery_put_f64(message + 44 + 8 * k, fix.v_ECEF[k]);
  }
  orrery_put_f64(message + 68, fix.sigma_r_m);
  orrery_put_f64(message + 76, fix.sigma_v_mps);
  orrery_put_u32(message + kCrcAt, flight_crc32_common(message, kCrcAt));
  ++next_sequence_;
}

CrosslinkReceiver::Verdict CrosslinkReceiver::receive(const unsigned char* message,
                                                      std::uint32_t bytes) {
  if (!is_sound(message, bytes, peer_)) return Verdict::kMalformed;
  const GnssFix fix = fix_in(message);
  if (!is_plausible(fix)) return Verdict::kMalformed;
  const Verdict verdict = admit(orrery_get_u32(message + 4), orrery_get_u32(message + 8));
  if (verdict == Verdict::kAccepted) fix_ = fix;
  return verdict;
}

CrosslinkReceiver::Verdict CrosslinkReceiver::admit(std::uint32_t boot_count,
                                                    std::uint32_t sequence) {
  if (heard_ && boot_count < boot_count_) return Verdict::kStale;
  if (!heard_ || boot_count > boot_count_) {
    heard_ = true;
    boot_count_ = boot_count;
    newest_ = sequence;
    seen_ = 1;
    return Verdict::kAccepted;
  }
  // Modulo 2^32: less than half the range ahead is newer.
  const std::uint32_t ahead = sequence - newest_;
  if (ahead != 0 && ahead < 0x80000000u) {
    seen_ = ahead < kWindow ? (seen_ << ahead) | 1u : 1u;
    newest_ = sequence;
    return Verdict::kAccepted;
  }
  const std::uint32_t behind = newest_ - sequence;
  if (behind >= kWindow) return Verdict::kStale;
  const std::uint64_t bit = std::uint64_t{1} << behind;
  if ((seen_ & bit) != 0) return Verdict::kDuplicate;
  seen_ |= bit;
  return Verdict::kAccepted;
}

}  // namespace formation_keeping
