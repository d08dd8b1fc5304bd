/// Modes, and the events that both spacecraft execute at one GPS epoch.
#pragma once

#include <cstdint>

#include "formation_gnc/formation_gnc_messages.h"
#include "formation_gnc/mission/byte_stream.hpp"

namespace formation_gnc {

/// The chief leads: it alone announces events. The deputy manoeuvres.
enum class Role : std::uint8_t { kChief = 0, kDeputy = 1 };

enum class Mode : std::uint8_t {
  kStandby = FORMATION_GNC_STANDBY,
  kTransfer = FORMATION_GNC_TRANSFER,
  kScience = FORMATION_GNC_SCIENCE,
  kSafe = FORMATION_GNC_SAFE,
  kEscape = FORMATION_GNC_ESCAPE
};
/// Safe and escape are entered at once, by either, and left by command only.
inline bool is_emergency(Mode mode) {
  return mode == Mode::kSafe || mode == Mode::kEscape;
}

struct Event {
  enum class Kind : std::uint8_t { kMode = 1, kObservation = 2 };

  std::uint32_t id = 0;  ///< given by the leader, growing; 0: none, or an emergency
  Kind kind = Kind::kMode;
  Mode mode = Mode::kStandby;  ///< of kMode: from begin_ns on
  /// Of science: how many, and in every how manieth orbit. Of an observation: its number, from 1.
  std::uint8_t observations = 0, every = 0;
  std::int64_t begin_ns = 0;    ///< GPS
  std::int64_t end_ns = 0;      ///< of an observation its end; of a transfer the arrival
  double a_m = 0.0, b_m = 0.0;  ///< goal of a transfer, as in the command
};

constexpr std::uint32_t kEventBytes = 40;
void put(ByteWriter* to, const Event& event);
/// False if a field is out of range; `event` is unchanged then.
bool get(ByteReader* from, Event* event);

}  // namespace formation_gnc
