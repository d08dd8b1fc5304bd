#include "formation_gnc/mission/mission_manager.hpp"

#include <algorithm>
#include <limits>

namespace formation_gnc {
namespace {

std::int64_t nanoseconds(double seconds) {
  return static_cast<std::int64_t>(seconds * 1e9);
}

bool needs_partner(Mode mode) {
  return mode == Mode::kTransfer || mode == Mode::kScience;
}

}  // namespace

MissionManager::MissionManager(Role role, const MissionOptions& options,
                               const TransitionRecord& record, const CommandPlan& plan,
                               std::int64_t boot_ns)
    : role_(role),
      options_(options),
      protocol_(role, options.transition, record),
      plan_(plan),
      boot_ns_(boot_ns),
      navigation_valid_ns_(boot_ns) {}

bool MissionManager::plan_changed() {
  const bool was = plan_changed_;
  plan_changed_ = false;
  return was;
}

const char* MissionManager::command(const formation_gnc_command& command) {
  if (!is_valid(command)) return "a field is out of range";
  switch (command.opcode) {
    case FORMATION_GNC_UPLOAD:
      if (!plan_.upload(command)) return "the plan is full";
      break;
    case FORMATION_GNC_REMOVE:
      if (!plan_.remove(command.number)) return "no such entry";
      break;
    default:
      plan_.clear();
      protocol_.withdraw();
  }
  plan_changed_ = true;
  return nullptr;
}

// A restart gives navigation and the partner as long again.
void MissionManager::watch(std::int64_t now_ns, const Health& health) {
  if (health.navigation_valid) navigation_valid_ns_ = now_ns;
  if (health.must_escape) {
    protocol_.emergency(Mode::kEscape, FORMATION_GNC_SEPARATION, now_ns);
    return;
  }
  if (!needs_partner(mode())) return;
  const std::int64_t heard_ns = std::max(health.partner_heard_ns, boot_ns_);
  std::uint32_t fault = FORMATION_GNC_NO_FAULT;
  if (health.delta_v_mps > options_.delta_v_budget_mps) fault = FORMATION_GNC_PROPELLANT_LOW;
  if (now_ns - heard_ns > nanoseconds(options_.partner_timeout_s)) {
    fault = FORMATION_GNC_PARTNER_SILENT;
  }
  if (now_ns - navigation_valid_ns_ > nanoseconds(options_.navigation_timeout_s)) {
    fault = FORMATION_GNC_NAVIGATION_INVALID;
  }
  if (fault != FORMATION_GNC_NO_FAULT) protocol_.emergency(Mode::kSafe, fault, now_ns);
}

void MissionManager::poll(std::int64_t now_ns, ReliableLink* link) {
  if (role_ == Role::kChief) follow_plan(now_ns);
  protocol_.poll(now_ns, link);
}

Event MissionManager::event_of(const formation_gnc_command& entry, std::int64_t now_ns) const {
  Event event;
  event.kind = Event::Kind::kMode;
  event.mode = static_cast<Mode>(entry.mode);
  event.begin_ns = std::max(entry.t_ns, now_ns + nanoseconds(options_.transition.lead_s));
  event.end_ns = entry.end_ns;
  event.a_m = entry.a_m;
  event.b_m = entry.b_m;
  event.observations = static_cast<std::uint8_t>(entry.observations);
  event.every = static_cast<std::uint8_t>(entry.every);
  return event;
}

void MissionManager::follow_plan(std::int64_t now_ns) {
  if (plan_.size() == 0) return;
  const formation_gnc_command entry = plan_.entry(0);
  const Mode target = static_cast<Mode>(entry.mode);
  const bool at_once = target == Mode::kSafe;
  const std::int64_t lead_ns = at_once ? 0 : nanoseconds(options_.transition.lead_s);
  if (entry.t_ns - now_ns > lead_ns) return;
  const auto done = [this, &entry] {
    plan_.remove(entry.number);
    plan_changed_ = true;
  };
  if (at_once) {
    protocol_.emergency(Mode::kSafe, FORMATION_GNC_COMMANDED, now_ns);
    done();
    return;
  }
  // Out of safe and escape leads standby alone.
  if (is_emergency(mode()) && target != Mode::kStandby) return done();
  // The ground comes before an exposure that is not committed.
  if (protocol_.has_pending() && protocol_.pending().kind == Event::Kind::kObservation) {
    protocol_.withdraw();
  }
  if (protocol_.announce(event_of(entry, now_ns), now_ns)) done();
}

std::int64_t MissionManager::next_ns() const {
  std::int64_t next = protocol_.next_ns();
  if (role_ == Role::kChief && plan_.size() > 0 && !protocol_.has_pending()) {
    next = std::min(next, plan_.entry(0).t_ns - nanoseconds(options_.transition.lead_s));
  }
  return next;
}

bool MissionManager::wants_observation(std::int64_t now_ns, double period_s,
                                       std::int64_t* earliest_ns) const {
  const TransitionRecord& record = protocol_.record();
  if (role_ != Role::kChief || record.mode != Mode::kScience || record.has_pending) return false;
  if (record.observation >= record.current.observations) return false;
  std::int64_t earliest = record.current.begin_ns + nanoseconds(options_.first_observation_s);
  if (record.last_window_ns > 0) {
    earliest = record.last_window_ns + nanoseconds((record.current.every - 0.5) * period_s);
  }
  *earliest_ns = std::max(earliest, now_ns + nanoseconds(options_.observation_least_lead_s));
  return true;
}

bool MissionManager::place_observation(std::int64_t middle_ns, std::int64_t now_ns) {
  if (middle_ns - now_ns > nanoseconds(options_.observation_lead_s)) return false;
  // On a whole second: alignment is for that instant, whatever the geometry's best one is.
  constexpr std::int64_t kSecond_ns = 1000000000;
  middle_ns = (middle_ns + kSecond_ns / 2) / kSecond_ns * kSecond_ns;
  const std::int64_t half_ns = nanoseconds(options_.observation_s) / 2;
  Event event;
  event.kind = Event::Kind::kObservation;
  event.mode = Mode::kScience;
  event.observations = static_cast<std::uint8_t>(protocol_.record().observation + 1);
  event.begin_ns = middle_ns - half_ns;
  event.end_ns = middle_ns + half_ns;
  return protocol_.announce(event, now_ns);
}

}  // namespace formation_gnc
