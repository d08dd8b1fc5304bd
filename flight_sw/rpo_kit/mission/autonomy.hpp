/// What the spacecraft is doing, and why it changes.
///
/// A mode is left for the first reason below that holds; each is a pure function of the situation
/// and of how long it has lasted.
///
///   standby      go                                          -> acquiring
///   acquiring    estimate good enough, three times in a row  -> approaching
///   approaching  unsafe, three times in a row                -> aborting
///                no estimate, or a poor one                  -> holding
///                last waypoint reached                       -> inspecting
///   inspecting   as approaching; waypoint left               -> approaching
///   holding      unsafe, three times in a row                -> aborting
///                estimate good enough again                  -> approaching, unless commanded
///                longer than `hold_limit_s`                  -> safe
///   aborting     safe ellipse reached                        -> safe
///   safe         go                                          -> acquiring
///   any but standby and safe: commanded abort                -> aborting, without estimate safe
///
/// Holding, safe and every stage of an approach are passively safe orbits: to do nothing is always
/// allowed.
/// Checked by  test_suites/unit/flight_sw/rpo_kit/relative_navigation_test.cpp
#pragma once

#include <cstdint>

namespace rpo_kit {

enum class Mode : std::uint32_t {
  kStandby = 0,
  kAcquiring = 1,
  kApproaching = 2,
  kInspecting = 3,
  kHolding = 4,
  kAborting = 5,
  kSafe = 6
};

enum class Order : std::uint8_t { kNone = 0, kGo = 1, kHold = 2, kAbort = 3 };

struct AutonomyOptions {
  double good_fraction = 0.1;  ///< 1-sigma of the range, of the range, to begin with
  double poor_fraction = 0.2;  ///< and to hold
  double abort_m = 8.0;        ///< least radial/cross-track distance less 3 sigma
  double hold_limit_s = 43200.0;
  int confirmations = 3;
};

struct Situation {
  std::int64_t t_ns = 0;
  bool estimate = false;
  double range_m = 0.0, range_sigma_m = 0.0;
  double safe_m = 0.0;  ///< of two revolutions, less 3 sigma
  bool arrived = false, aborted = false;
};

class Autonomy {
 public:
  explicit Autonomy(const AutonomyOptions& options = {}) : options_(options) {}

  /// @return the mode from now on.
  Mode decide(const Situation& now, Order order);
  Mode mode() const { return mode_; }
  /// Of the last change: a literal, for the log.
  const char* reason() const { return reason_; }

 private:
  void enter(Mode mode, const char* reason, std::int64_t t_ns);
  void under_way(const Situation& now);

  AutonomyOptions options_;
  Mode mode_ = Mode::kStandby;
  const char* reason_ = "boot";
  std::int64_t since_ns_ = 0;
  int good_ = 0, unsafe_ = 0;
  bool hold_commanded_ = false;
};

}  // namespace rpo_kit
