/// A row of a flight library's port table.
#pragma once

#include <orrery/harness/kernel/simulator_only.hpp>

#include <cstdint>
#include <string>

namespace orrery {

enum class PortDirection : std::uint8_t { kIn, kOut };
enum class PortKind : std::uint8_t { kPacket, kStream };

struct FlightPort {
  std::string name = {};
  PortDirection direction = PortDirection::kIn;
  PortKind kind = PortKind::kPacket;
  std::uint32_t id = 0;         // the library's own number
  std::uint32_t max_bytes = 0;  // of one call
};

/// Levels of log lines, as the ABI numbers them.
enum class LogLevel : std::int32_t { kDebug = 0, kInfo = 1, kWarning = 2, kError = 3 };

}  // namespace orrery
