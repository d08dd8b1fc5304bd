/// Which mode the formation is in and what comes next: plan, faults, observations.
///
/// The leader turns the ground's plan into announcements (transition_protocol.hpp) and places the
/// observations of a science campaign; both watch for reasons to go to safe or to escape.
#pragma once

#include <cstdint>

#include "formation_gnc/mission/command_plan.hpp"
#include "formation_gnc/mission/transition_protocol.hpp"

namespace formation_gnc {

struct MissionOptions {
  TransitionOptions transition = {};
  double observation_s = 10.0;         ///< length of an exposure
  double observation_lead_s = 5400.0;  ///< an observation is announced so long ahead, at most,
  double observation_least_lead_s = 3000.0;  ///< and at least: alignment takes that long
  double first_observation_s = 5739.0;       ///< from the beginning of science, at least
  double navigation_timeout_s = 900.0;       ///< without a valid estimate, in transfer and science
  double partner_timeout_s = 1800.0;         ///< without a packet, likewise
  double delta_v_budget_mps = 15.0;          ///< commanded in all; 0.5 kg of gas give 20 m/s
};

class MissionManager {
 public:
  /// What the rest of the package knows of itself.
  struct Health {
    bool navigation_valid = false;
    bool must_escape = false;
    std::int64_t partner_heard_ns = 0;  ///< 0: never
    double delta_v_mps = 0.0;
  };

  MissionManager(Role role, const MissionOptions& options, const TransitionRecord& record,
                 const CommandPlan& plan, std::int64_t boot_ns);

  TransitionProtocol& protocol() { return protocol_; }
  const TransitionProtocol& protocol() const { return protocol_; }
  const CommandPlan& plan() const { return plan_; }
  Mode mode() const { return protocol_.mode(); }
  /// True once after each change of the plan.
  bool plan_changed();

  /// Of the ground, on the leader; the follower passes commands on. @return null, or why it was
  /// rejected.
  const char* command(const formation_gnc_command& command);
  /// Enters safe or escape if there is reason to.
  void watch(std::int64_t now_ns, const Health& health);
  /// Announces what is due and runs the protocol.
  void poll(std::int64_t now_ns, ReliableLink* link);
  std::int64_t next_ns() const;

  /// The leader, in a campaign with observations left, nothing pending: true, and the earliest
  /// middle of the next exposure.
  /// @param period_s  Of the orbit.
  bool wants_observation(std::int64_t now_ns, double period_s, std::int64_t* earliest_ns) const;
  /// The middle of an exposure whose geometry is right. False: not yet, or not now.
  bool place_observation(std::int64_t middle_ns, std::int64_t now_ns);

 private:
  void follow_plan(std::int64_t now_ns);
  Event event_of(const formation_gnc_command& entry, std::int64_t now_ns) const;

  Role role_;
  MissionOptions options_;
  TransitionProtocol protocol_;
  CommandPlan plan_;
  bool plan_changed_ = false;
  std::int64_t boot_ns_;
  std::int64_t navigation_valid_ns_;
};

}  // namespace formation_gnc
