#include <orrery/models/gnss/log_schedule.hpp>

#include <algorithm>
#include <stdexcept>

namespace orrery::novatel {

namespace {

void check(const LogRequest& request) {
  if (request.trigger != LogTrigger::kOnTime) return;
  if (request.period <= 0ns) {
    throw std::invalid_argument("LogSchedule::log: period = " + to_string(request.period) +
                                " of an ONTIME log; accepted: above 0");
  }
  if (request.offset < 0ns || request.offset >= request.period) {
    throw std::invalid_argument("LogSchedule::log: offset = " + to_string(request.offset) +
                                "; accepted: 0 to below the period, " + to_string(request.period));
  }
}

}  // namespace

bool LogSchedule::log(const LogRequest& request) {
  check(request);
  const auto same = [&](const Entry& entry) {
    return entry.request.message_id == request.message_id;
  };
  const auto at = std::find_if(entries_.begin(), entries_.end(), same);
  if (at != entries_.end()) {
    *at = {request};
    return true;
  }
  if (entries_.size() >= kMaxLogs) return false;
  entries_.push_back({request});
  return true;
}

bool LogSchedule::unlog(std::uint16_t message_id) {
  return std::erase_if(entries_, [&](const Entry& entry) {
           return entry.request.message_id == message_id;
         }) > 0;
}

void LogSchedule::unlog_all(bool held) {
  std::erase_if(entries_, [&](const Entry& entry) { return held || !entry.request.hold; });
}

void LogSchedule::note_change(std::uint16_t message_id) {
  for (Entry& entry : entries_) {
    if (entry.request.message_id == message_id) entry.changed = true;
  }
}

bool LogSchedule::is_due(const Entry& entry, SimTime t) {
  if (entry.request.trigger != LogTrigger::kOnTime) return !entry.sent || entry.changed;
  return (t.time_since_epoch() - entry.request.offset) % entry.request.period == 0ns;
}

std::span<const DueLog> LogSchedule::due(SimTime t) {
  due_.clear();
  for (Entry& entry : entries_) {
    if (!is_due(entry, t)) continue;
    const bool only_changed = entry.request.trigger == LogTrigger::kOnChanged && entry.sent;
    due_.push_back({entry.request.message_id, only_changed});
    entry.sent = true;
    entry.changed = false;
  }
  std::erase_if(entries_, [](const Entry& entry) {
    return entry.sent && entry.request.trigger == LogTrigger::kOnce;
  });
  return due_;
}

}  // namespace orrery::novatel
