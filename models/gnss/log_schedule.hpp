/// Which logs a NovAtel receiver sends when: the LOG, UNLOG and UNLOGALL commands.
///
/// Source      OEM7 Commands and Logs Reference Manual (NovAtel OM-20000169), commands LOG (1),
///             UNLOG (36), UNLOGALL (38)
/// Checked by  test_suites/unit/models/gnss/log_schedule_test.cpp
#pragma once

#include <orrery/harness/kernel/bytes.hpp>
#include <orrery/harness/kernel/time.hpp>

#include <cstdint>
#include <span>
#include <vector>

namespace orrery::novatel {

/// The manual's numbers. ONNEW, ONNEXT and ONMARK are refused: LogSchedule knows these three.
enum class LogTrigger : std::uint32_t { kOnChanged = 1, kOnTime = 2, kOnce = 4 };

struct LogRequest {
  std::uint16_t message_id = 0;
  LogTrigger trigger = LogTrigger::kOnce;
  Duration period = 0ns;  // ONTIME only, above 0
  Duration offset = 0ns;  // ONTIME only, 0 to below the period
  bool hold = false;      // true: UNLOGALL leaves it

  bool operator==(const LogRequest&) const = default;
};

/// A log that is to be sent now.
struct DueLog {
  std::uint16_t message_id = 0;
  /// Of a message that is sent once per satellite: only for those that changed since `due` was last
  /// asked. False: for all of them.
  bool only_changed = false;

  bool operator==(const DueLog&) const = default;
};

/// The list of requested logs of one port, in the order in which they were requested; a request for
/// a message that is in the list replaces it in its place.
class LogSchedule {
 public:
  static constexpr std::size_t kMaxLogs = 30;  // as the receiver

  /// False if the list is full; it is unchanged then.
  /// @throws std::invalid_argument  ONTIME with a period or offset outside its range.
  bool log(const LogRequest& request);
  /// False if the message is not in the list.
  bool unlog(std::uint16_t message_id);
  /// `held`: also those requested with HOLD.
  void unlog_all(bool held = false);

  /// What the message says is not what it said before: ONCHANGED sends it at the next epoch.
  void note_change(std::uint16_t message_id);

  /// What to send at an epoch of the receiver. ONTIME: when t - offset is a multiple of the period
  /// in GPS time. ONCHANGED: at the first epoch, and after each note_change. ONCE: at the first
  /// epoch. Valid until the next call of a member. No allocation once the list has had its longest.
  std::span<const DueLog> due(SimTime t);

  std::size_t size() const { return entries_.size(); }

 private:
  struct Entry {
    LogRequest request;
    bool sent = false;
    bool changed = false;
  };
  static bool is_due(const Entry& entry, SimTime t);

  std::vector<Entry> entries_;
  std::vector<DueLog> due_;
};

}  // namespace orrery::novatel
