#include "rpo_kit/mission/autonomy.hpp"

#include "support/orbit/constants.hpp"

namespace rpo_kit {

void Autonomy::enter(Mode mode, const char* reason, std::int64_t t_ns) {
  mode_ = mode;
  reason_ = reason;
  since_ns_ = t_ns;
  good_ = unsafe_ = 0;
}

// Of approaching, inspecting and holding.
void Autonomy::under_way(const Situation& now) {
  const bool poor = !now.estimate || now.range_sigma_m > options_.poor_fraction * now.range_m;
  if (unsafe_ >= options_.confirmations) {
    return enter(Mode::kAborting, "predicted distance below the limit", now.t_ns);
  }
  if (mode_ == Mode::kHolding) {
    if (good_ >= options_.confirmations && !hold_commanded_) {
      return enter(Mode::kApproaching, "target found again", now.t_ns);
    }
    const double held_s = flight_support::seconds(now.t_ns - since_ns_);
    if (held_s > options_.hold_limit_s && !hold_commanded_) {
      enter(Mode::kSafe, "held too long", now.t_ns);
    }
    return;
  }
  if (poor) return enter(Mode::kHolding, "target lost", now.t_ns);
  if (mode_ == Mode::kApproaching && now.arrived) {
    return enter(Mode::kInspecting, "arrived", now.t_ns);
  }
  if (mode_ == Mode::kInspecting && !now.arrived) {
    enter(Mode::kApproaching, "waypoint left", now.t_ns);
  }
}

Mode Autonomy::decide(const Situation& now, Order order) {
  const bool good = now.estimate && now.range_sigma_m < options_.good_fraction * now.range_m;
  good_ = good ? good_ + 1 : 0;
  unsafe_ = now.estimate && now.safe_m < options_.abort_m ? unsafe_ + 1 : 0;
  const bool idle = mode_ == Mode::kStandby || mode_ == Mode::kSafe;
  if (order == Order::kGo) hold_commanded_ = false;
  if (order == Order::kHold) hold_commanded_ = true;
  if (order == Order::kGo && idle) {
    enter(Mode::kAcquiring, "commanded", now.t_ns);
  } else if (order == Order::kAbort && !idle && mode_ != Mode::kAborting) {
    enter(now.estimate ? Mode::kAborting : Mode::kSafe, "commanded", now.t_ns);
  } else if (order == Order::kHold && (mode_ == Mode::kApproaching || mode_ == Mode::kInspecting)) {
    enter(Mode::kHolding, "commanded", now.t_ns);
  } else if (mode_ == Mode::kAcquiring) {
    if (good_ >= options_.confirmations) enter(Mode::kApproaching, "target acquired", now.t_ns);
  } else if (mode_ == Mode::kAborting) {
    if (now.aborted) enter(Mode::kSafe, "safe ellipse reached", now.t_ns);
  } else if (!idle) {
    under_way(now);
  }
  return mode_;
}

}  // namespace rpo_kit
