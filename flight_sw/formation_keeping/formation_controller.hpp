/// Decides what the deputy does: waits for navigation, reconfigures on command, keeps the
/// formation.
///
/// Goal        A command is a goal with an end epoch. While it lasts, the controller predicts what
///             will be missing at the end, and plans from the present estimate whenever that is
///             worth a burn. Only the first burn of a plan is ever commanded; the rest is planned
///             again from what the first one really did. So a lost or weak burn needs no special
///             case.
/// Worth it    Far from the end only large misses are (they are cheap to make up early and small
///             ones are still noise); in the last revolutions the trims are.
/// Keeping     After the end the same goal is pursued over a horizon of a few revolutions, as soon
///             as a prediction leaves its deadband.
/// Checked by  test_suites/unit/flight_sw/formation_controller_test.cpp
#pragma once

#include "configuration.hpp"
#include "formation_keeping_messages.h"

namespace formation_keeping {

enum class Mode : std::uint32_t {
  kPassive = FORMATION_MODE_PASSIVE,
  kAcquiring = FORMATION_MODE_ACQUIRING,
  kStandby = FORMATION_MODE_STANDBY,
  kReconfiguring = FORMATION_MODE_RECONFIGURING,
  kKeeping = FORMATION_MODE_KEEPING
};

class FormationController {
 public:
  FormationController(const ControlOptions& control, const PlannerOptions& planner)
      : control_(control), planner_options_(planner), planner_(planner) {}

  enum class Acceptance {
    kAccepted,
    kNotSafe,    ///< the goal's radial/cross-track distance is below the planner's limit
    kOutOfRange  ///< not finite, above 5 km, drifting, or the end is less than a revolution ahead
  };
  Acceptance accept(const Goal& goal, std::int64_t now_ns);
  /// As accept(), for a goal accepted in an earlier life: its end may have passed.
  void resume(const Goal& goal);
  /// Drops the goal. A burn already commanded is not called back.
  void halt();

  struct Decision {
    bool burn = false;
    Burn what;                      ///< if `burn`
    std::int64_t next_ns = 0;       ///< decide again at this time
    const char* trouble = nullptr;  ///< a reason why nothing could be planned, or null
  };
  /// @param now  The estimate at the present.
  Decision decide(const FormationState& now);
  /// The burn decided last was handed to the thruster.
  void commanded(const Burn& burn);

  Mode mode() const { return mode_; }

 private:
  bool is_converged(const FormationState& now, double change_m) const;
  void choose_mode(const FormationState& now);
  RelativeElements thresholds_m(const FormationState& now) const;
  bool is_worth_it(const FormationState& now, const Goal& goal, RelativeElements* miss) const;
  Decision plan(const FormationState& now, const Goal& goal);

  ControlOptions control_;
  PlannerOptions planner_options_;
  ReconfigurationPlanner planner_;
  Mode mode_ = Mode::kAcquiring;
  bool has_goal_ = false;
  Goal goal_;
  std::int64_t correction_end_ns_ = 0;  // keeping: a correction is under way until then
  std::int64_t settled_ns_ = 0;         // after a burn: wait until the filter has seen it
};

}  // namespace formation_keeping
