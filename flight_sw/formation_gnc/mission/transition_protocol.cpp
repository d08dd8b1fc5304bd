#include "formation_gnc/mission/transition_protocol.hpp"

#include <algorithm>
#include <limits>

#include "support/crc32.h"

namespace formation_gnc {
namespace {

enum PayloadType : unsigned { kAnnouncement = 1, kWithdrawal = 2, kEmergency = 3, kSync = 4 };

constexpr std::int64_t kNever_ns = std::numeric_limits<std::int64_t>::max();
constexpr unsigned kRecordVersion = 1;

std::int64_t nanoseconds(double seconds) {
  return static_cast<std::int64_t>(seconds * 1e9);
}

bool get_mode(ByteReader* from, Mode* mode) {
  const unsigned value = from->u8();
  if (value > FORMATION_GNC_ESCAPE) return false;
  *mode = static_cast<Mode>(value);
  return true;
}

}  // namespace

std::uint32_t store(const TransitionRecord& record, unsigned char (&to)[kTransitionRecordBytes]) {
  ByteWriter writer(to, sizeof to - 4);
  writer.u8(kRecordVersion);
  writer.u8(static_cast<unsigned>(record.mode));
  writer.u8(record.has_pending ? 1 : 0);
  writer.u32(record.executed_id);
  writer.u32(record.committed_id);
  writer.u32(record.last_id);
  writer.u32(record.emergencies);
  writer.u32(record.peer_emergencies);
  writer.u32(record.fault);
  writer.u32(record.observation);
  writer.i64(record.last_window_ns);
  put(&writer, record.current);
  put(&writer, record.pending);
  orrery_put_u32(to + writer.bytes(), flight_crc32_common(to, writer.bytes()));
  return writer.bytes() + 4;
}

bool restore(const unsigned char* from, std::uint32_t bytes, TransitionRecord* record) {
  if (bytes < 4 || bytes > kTransitionRecordBytes) return false;
  if (orrery_get_u32(from + bytes - 4) != flight_crc32_common(from, bytes - 4)) return false;
  ByteReader reader(from, bytes - 4);
  TransitionRecord read;
  if (reader.u8() != kRecordVersion || !get_mode(&reader, &read.mode)) return false;
  read.has_pending = reader.u8() != 0;
  read.executed_id = reader.u32();
  read.committed_id = reader.u32();
  read.last_id = reader.u32();
  read.emergencies = reader.u32();
  read.peer_emergencies = reader.u32();
  read.fault = reader.u32();
  read.observation = reader.u32();
  read.last_window_ns = reader.i64();
  if (!get(&reader, &read.current) || !get(&reader, &read.pending) || !reader.whole()) return false;
  *record = read;
  return true;
}

TransitionProtocol::TransitionProtocol(Role role, const TransitionOptions& options,
                                       const TransitionRecord& record)
    : role_(role), options_(options), record_(record) {
  needs_announcement_ = leads() && record_.has_pending && !is_committed();
}

bool TransitionProtocol::changed() {
  const bool was = changed_;
  changed_ = false;
  return was;
}

std::int64_t TransitionProtocol::deadline_ns() const {
  return record_.pending.begin_ns - nanoseconds(options_.guard_s);
}

bool TransitionProtocol::announce(const Event& event, std::int64_t now_ns) {
  if (!leads() || record_.has_pending) return false;
  if (event.begin_ns - now_ns < nanoseconds(options_.guard_s)) return false;
  record_.pending = event;
  record_.pending.id = ++record_.last_id;
  record_.has_pending = true;
  if (event.kind == Event::Kind::kObservation) record_.last_window_ns = event.begin_ns;
  needs_announcement_ = true;
  announced_ = false;
  change();
  return true;
}

bool TransitionProtocol::withdraw() {
  if (!leads() || !record_.has_pending || is_committed()) return false;
  needs_withdrawal_ = record_.pending.id;
  ++withdrawn_;
  drop_pending();
  return true;
}

void TransitionProtocol::drop_pending() {
  record_.has_pending = false;
  needs_announcement_ = announced_ = false;
  change();
}

void TransitionProtocol::emergency(Mode mode, std::uint32_t fault, std::int64_t now_ns) {
  if (record_.mode == mode) return;
  ++record_.emergencies;
  record_.fault = fault;
  needs_emergency_ = true;
  Event event;
  event.mode = mode;
  event.begin_ns = now_ns;
  drop_pending();
  enter(mode, event);
  push({event, false, true});
}

void TransitionProtocol::enter(Mode mode, const Event& event) {
  record_.mode = mode;
  record_.current = event;
  record_.observation = 0;
  record_.last_window_ns = 0;
  change();
}

// More events than places between two calls of take() cannot be: one poll() executes at most two.
void TransitionProtocol::push(const Execution& execution) {
  if (executions_count_ == kExecutions) return;
  executions_[(executions_first_ + executions_count_) % kExecutions] = execution;
  ++executions_count_;
}

bool TransitionProtocol::take(Execution* execution) {
  if (executions_count_ == 0) return false;
  *execution = executions_[executions_first_];
  executions_first_ = (executions_first_ + 1) % kExecutions;
  --executions_count_;
  return true;
}

void TransitionProtocol::execute(std::int64_t now_ns) {
  const Event event = record_.pending;
  const bool late = now_ns - event.begin_ns > nanoseconds(options_.late_s);
  drop_pending();
  record_.executed_id = event.id;
  record_.committed_id = std::max(record_.committed_id, event.id);
  if (event.kind == Event::Kind::kMode) {
    enter(event.mode, event);
  } else {
    record_.observation = event.observations;
    record_.last_window_ns = event.begin_ns;
  }
  if (late) ++late_;
  push({event, late, false});
}

void TransitionProtocol::hear_committed(std::uint32_t id) {
  if (leads() || id <= record_.committed_id) return;
  record_.committed_id = id;
  change();
}

void TransitionProtocol::poll(std::int64_t now_ns, ReliableLink* link) {
  send_all(link);
  if (leads()) decide(now_ns, *link);
  if (is_committed() && now_ns >= record_.pending.begin_ns) execute(now_ns);
  send_all(link);
}

void TransitionProtocol::decide(std::int64_t now_ns, const ReliableLink& link) {
  if (!record_.has_pending || is_committed()) return;
  const bool acknowledged = link.delivered() >= announcement_mark_;
  if (announced_ && (acknowledged || !options_.await_acknowledgement) &&
      now_ns < record_.pending.begin_ns) {
    record_.committed_id = record_.pending.id;
    change();
    return;
  }
  if (now_ns < deadline_ns()) return;
  if (record_.pending.kind == Event::Kind::kObservation) {
    withdraw();
    return;
  }
  record_.pending.begin_ns = now_ns + nanoseconds(options_.lead_s);
  needs_announcement_ = true;
  announced_ = false;
  ++postponed_;
  change();
}

std::int64_t TransitionProtocol::next_ns() const {
  if (!record_.has_pending) return kNever_ns;
  if (is_committed()) return record_.pending.begin_ns;
  return leads() ? deadline_ns() : kNever_ns;
}

// ---- what is said

void TransitionProtocol::send_all(ReliableLink* link) {
  Payload payload;
  const auto send = [&](bool* needed, auto write) {
    if (!*needed) return;
    ByteWriter writer(payload.data, sizeof payload.data);
    write(&writer);
    payload.bytes = writer.bytes();
    if (link->send(payload)) *needed = false;
  };
  send(&needs_emergency_, [this](ByteWriter* w) {
    w->u8(kEmergency);
    w->u32(record_.emergencies);
    w->u8(static_cast<unsigned>(record_.mode));
  });
  send(&needs_sync_, [this](ByteWriter* w) {
    w->u8(kSync);
    w->u32(record_.executed_id);
    w->u32(record_.emergencies);
    w->u32(record_.peer_emergencies);
    w->u8(static_cast<unsigned>(record_.mode));
    put(w, record_.current);
  });
  bool withdrawal = needs_withdrawal_ != 0;
  send(&withdrawal, [this](ByteWriter* w) {
    w->u8(kWithdrawal);
    w->u32(needs_withdrawal_);
  });
  if (!withdrawal) needs_withdrawal_ = 0;
  const bool announcing = needs_announcement_ && record_.has_pending;
  needs_announcement_ = announcing;
  send(&needs_announcement_, [this](ByteWriter* w) {
    w->u8(kAnnouncement);
    w->u32(record_.peer_emergencies);
    put(w, record_.pending);
  });
  if (announcing && !needs_announcement_) {
    announced_ = true;
    announcement_mark_ = link->queued();
  }
}

// ---- what is heard

bool TransitionProtocol::receive(const Payload& payload, std::int64_t now_ns) {
  ByteReader reader(payload.data, payload.bytes);
  switch (reader.u8()) {
    case kAnnouncement:
      return receive_announcement(&reader, now_ns);
    case kWithdrawal:
      return receive_withdrawal(&reader);
    case kEmergency:
      return receive_emergency(&reader, now_ns);
    case kSync:
      return receive_sync(&reader, now_ns);
    default:
      return false;
  }
}

bool TransitionProtocol::receive_announcement(ByteReader* from, std::int64_t now_ns) {
  const std::uint32_t emergencies_known = from->u32();
  Event event;
  if (leads() || !get(from, &event) || !from->whole() || event.id == 0) return false;
  if (event.id <= record_.executed_id) return true;  // again, after a restart
  if (emergencies_known < record_.emergencies) return true;
  // The leader announces another one only when it has executed or withdrawn the one before.
  if (record_.has_pending && event.id > record_.pending.id) execute(now_ns);
  record_.pending = event;
  record_.has_pending = true;
  change();
  return true;
}

bool TransitionProtocol::receive_withdrawal(ByteReader* from) {
  const std::uint32_t id = from->u32();
  if (leads() || !from->whole()) return false;
  if (record_.has_pending && record_.pending.id == id) drop_pending();
  return true;
}

bool TransitionProtocol::receive_emergency(ByteReader* from, std::int64_t now_ns) {
  const std::uint32_t count = from->u32();
  Mode mode = Mode::kSafe;
  if (!get_mode(from, &mode) || !from->whole()) return false;
  follow_emergency(count, mode, now_ns);
  return true;
}

// Whoever left the emergency since did so by the leader's announcement, which is in the order of
// events; so an emergency is followed even if the other's mode is a usual one by now.
void TransitionProtocol::follow_emergency(std::uint32_t count, Mode mode, std::int64_t now_ns) {
  if (count <= record_.peer_emergencies) return;
  record_.peer_emergencies = count;
  drop_pending();
  if (is_emergency(record_.mode)) return;
  Event event;
  event.mode = is_emergency(mode) ? mode : Mode::kSafe;
  event.begin_ns = now_ns;
  record_.fault = FORMATION_GNC_PARTNER_FAULT;
  enter(event.mode, event);
  push({event, false, true});
}

bool TransitionProtocol::receive_sync(ByteReader* from, std::int64_t now_ns) {
  const std::uint32_t executed = from->u32();
  const std::uint32_t emergencies = from->u32(), known = from->u32();
  Mode mode = Mode::kStandby;
  Event current;
  if (!get_mode(from, &mode) || !get(from, &current) || !from->whole()) return false;
  // After a loss of its record one of the two counts from zero again.
  if (known > record_.emergencies) record_.emergencies = known, change();
  if (emergencies < record_.peer_emergencies) record_.peer_emergencies = emergencies, change();
  follow_emergency(emergencies, mode, now_ns);
  if (leads()) {
    if (executed > record_.last_id) record_.last_id = record_.executed_id = executed, change();
    return true;
  }
  if (executed <= record_.executed_id || known < record_.emergencies) return true;
  if (record_.has_pending && record_.pending.id == executed) {
    execute(now_ns);
    return true;
  }
  record_.executed_id = executed;
  record_.committed_id = std::max(record_.committed_id, executed);
  if (record_.has_pending && record_.pending.id < executed) drop_pending();
  change();
  if (mode == record_.mode) return true;
  enter(mode, current);
  ++late_;
  push({current, true, is_emergency(mode)});
  return true;
}

}  // namespace formation_gnc
