/// The ground's command plan: requests for modes, each at its time, kept over restarts.
#pragma once

#include <cstdint>

#include "formation_gnc/formation_gnc_messages.h"

namespace formation_gnc {

/// Kept by the leader, in order of time; of equal times in order of their numbers.
class CommandPlan {
 public:
  static constexpr std::uint32_t kCapacity = 16;
  static constexpr std::uint32_t kStoredBytes =
      8 + kCapacity * FORMATION_GNC_COMMAND_BYTES;  // version, count, entries, CRC

  /// Adds an entry, or replaces the one of that number. False if there is no room.
  bool upload(const formation_gnc_command& entry);
  /// False if there was no such entry.
  bool remove(std::uint32_t number);
  void clear() { count_ = 0; }

  std::uint32_t size() const { return count_; }
  /// 0 is the next one.
  const formation_gnc_command& entry(std::uint32_t index) const { return entries_[index]; }
  bool contains(std::uint32_t number) const;

  /// @return the bytes written.
  std::uint32_t store(unsigned char (&to)[kStoredBytes]) const;
  /// False, and the plan as it was, if the bytes are not a plan, whole and sound.
  bool restore(const unsigned char* from, std::uint32_t bytes);

 private:
  formation_gnc_command entries_[kCapacity];
  std::uint32_t count_ = 0;
};

/// A command whose fields make sense: opcode, mode (not escape, which needs a reason on board),
/// times, sizes of ellipses up to 10 km.
bool is_valid(const formation_gnc_command& command);

}  // namespace formation_gnc
