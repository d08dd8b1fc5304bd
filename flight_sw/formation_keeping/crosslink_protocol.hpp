/// What the two spacecraft say to each other, and which of it still counts when it arrives.
///
/// Message     88 bytes, little-endian: 0 u16 magic 0x4B46 | 2 u8 version | 3 u8 role of the sender
///             | 4 u32 boot count | 8 u32 sequence | 12 i64 GNSS epoch, GPS ns | 20 f64 r_ECEF[3] m
///             | 44 f64 v_ECEF[3] m/s | 68 f64 sigma_r m | 76 f64 sigma_v m/s | 84 u32 CRC-32 of
///             the rest.
/// Delivery    Messages may be lost, late, doubled and overtake each other. Each is a full state
///             with the epoch it belongs to, so nothing is acknowledged or sent twice: a late one
///             is as good a measurement as a prompt one, and the next one replaces a lost one.
/// Receiving   A window of the last 64 sequence numbers, as in RFC 4303, tells late from doubled. A
///             restarted sender counts from zero again under a higher boot count; what its previous
///             life sent is stale. The sequence wraps.
#pragma once

#include <cstdint>

#include "support/gnss_fix.hpp"

namespace formation_keeping {

using flight_support::GnssFix;

enum class Role : std::uint8_t { kChief = 0, kDeputy = 1 };

constexpr std::uint32_t kCrosslinkBytes = 88;

class CrosslinkSender {
 public:
  CrosslinkSender(Role role, std::uint32_t boot_count) : role_(role), boot_count_(boot_count) {}
  /// Writes the next message.
  void pack(const GnssFix& fix, unsigned char (&message)[kCrosslinkBytes]);

 private:
  Role role_;
  std::uint32_t boot_count_;
  std::uint32_t next_sequence_ = 0;
};

class CrosslinkReceiver {
 public:
  enum class Verdict {
    kAccepted,   ///< new, in or out of order: fix() holds it
    kMalformed,  ///< length, CRC, magic, version, sender or numbers are wrong
    kDuplicate,  ///< accepted before
    kStale       ///< older than the window, or from before the sender's restart
  };

  /// @param peer  Role of the sender to listen to.
  explicit CrosslinkReceiver(Role peer) : peer_(peer) {}

  Verdict receive(const unsigned char* message, std::uint32_t bytes);
  /// The state in the last accepted message.
  const GnssFix& fix() const { return fix_; }

 private:
  Verdict admit(std::uint32_t boot_count, std::uint32_t sequence);

  Role peer_;
  bool heard_ = false;
  std::uint32_t boot_count_ = 0;
  std::uint32_t newest_ = 0;
  std::uint64_t seen_ = 0;  // bit k: sequence newest_ - k was accepted
  GnssFix fix_;
};

}  // namespace formation_keeping
