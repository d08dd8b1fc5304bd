/// The deputy's manoeuvres: which burn is to be commanded next, in each mode.
///
/// Transfer    to the goal by the planner, anew every few hours with what navigation has learnt.
/// Science     between observations likewise, to the science orbit of the next observation; in the
///             last 40 min trims by numerical prediction (fine_alignment.hpp).
/// Escape      the escape of separation_monitor.hpp, within the thruster's limits as they are here,
///             at once; anew when navigation knows the orbit far better than it did then (the burn
///             that made it necessary may have been nobody's), and when the plan is over and left
///             too small vectors or a drift.
/// Standby, safe  nothing.
/// A plan that cannot be made, or costs more than propellant allows, leaves the one before in
/// force: that leads to the goal it had.
/// One burn is commanded at a time, `burn_lead_s` ahead.
#pragma once

#include <cstdint>

#include "formation_gnc/control/fine_alignment.hpp"
#include "formation_gnc/control/reconfiguration_planner.hpp"
#include "formation_gnc/control/separation_monitor.hpp"
#include "formation_gnc/mission/event.hpp"

namespace formation_gnc {

struct ManeuverOptions {
  double separation_m = 40.0;
  /// A margin to what the thruster accepts: it takes 3 mm/s at most, 120 s from end to begin.
  ImpulseLimits limits = {2.8e-3, 0.25e-3 / 11.0, 124.0};
  ThrusterErrors errors = {};
  double burn_lead_s = 60.0;   ///< a burn is commanded so long before its middle
  double least_lead_s = 25.0;  ///< and no later; the thruster wants 20 s
  double settle_s = 60.0;      ///< after a burn: navigation looks before the next plan
  double transfer_replan_s = 7200.0;
  double science_replan_s = 2870.0;  ///< half an orbit
  double alignment_s = 2400.0;       ///< before an observation: trims instead of plans
  double last_trim_s = 180.0;
  double planning_sigma_r_m = 1.0;    ///< 1-sigma, 3D, of the relative estimate that plans need
  double alignment_sigma_r_m = 0.05;  ///< and that trims need
  double escape_m = 80.0;             ///< a*de and a*di of an escape that is over, at least
  double escape_da_m = 4.0;           ///< and a*da, at most
  double escape_replan_s = 300.0;     ///< between two plans of an escape
  int waypoints = 3;
};

/// What the deputy's navigation knows now.
struct Situation {
  std::int64_t t_ns = 0;
  flight_support::StateEci chief, deputy;
  flight_support::Matrix6 relative_covariance_RTN;
  double sigma_r_m = 0.0;      ///< 3D
  double a_da_rate_mps = 0.0;  ///< d(a*da)/dt by differential drag, of the deputy
  double budget_mps = 1e3;     ///< what propellant is left for; an escape does not ask
};

class ManeuverManager {
 public:
  /// @param gravity  Outlives this object.
  explicit ManeuverManager(const GravityModel& gravity, const ManeuverOptions& options = {});

  /// A mode begins, or is resumed after a restart.
  void enter(const Event& event);
  /// The middle of the exposure that is announced; 0: none is.
  void set_observation(std::int64_t middle_ns) { observation_ns_ = middle_ns; }

  /// The burn to command now, as it is wanted. False: none now.
  bool next(const Situation& now, Impulse* wanted);
  /// What became of it. An escape that the thruster refused a burn of is planned anew.
  void commanded(const Impulse& wanted, bool accepted);

  /// Null, or what went wrong with the last plan. Each once.
  const char* trouble();
  std::uint32_t plans() const { return plans_; }
  const TransferPlan& plan() const { return plan_; }

  /// First instant after `after_ns` at which an observation can be made.
  std::int64_t next_observation_ns(const Situation& now, std::int64_t after_ns) const;

 private:
  void plan_transfer(const Situation& now);
  void plan_science(const Situation& now);
  void plan_escape(const Situation& now);
  bool must_plan_escape(const Situation& now) const;
  void take(TransferPlan&& plan);
  void plan_to(const Situation& now, const TransferGoal& goal, std::int64_t last_ns);
  bool align(const Situation& now, Impulse* wanted);
  bool next_of_plan(const Situation& now, Impulse* wanted);
  std::int64_t earliest_ns(const Situation& now) const;
  std::int64_t soonest_ns(const Situation& now) const;
  flight_support::RelativeElements science_goal(const Situation& now,
                                                std::int64_t observation_ns) const;

  const GravityModel& gravity_;
  ManeuverOptions options_;
  Event event_;
  std::int64_t observation_ns_ = 0;
  TransferPlan plan_;
  std::size_t next_burn_ = 0;
  bool planned_ = false, from_plan_ = false;
  std::int64_t replan_ns_ = 0, realign_ns_ = 0;
  double escape_sigma_da_m_ = 0.0;  // when it was planned
  std::int64_t last_burn_ns_ = 0;
  std::uint32_t plans_ = 0;
  const char* trouble_ = nullptr;
};

/// Mean relative elements of a situation.
flight_support::RelativeOrbit relative_orbit(const Situation& now);

}  // namespace formation_gnc
