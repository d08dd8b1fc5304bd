/// The attitude of a spacecraft that always points where it was told: modes, and slews between
/// them.
#pragma once

#include <orrery/harness/kernel/random.hpp>
#include <orrery/models/attitude/pointing.hpp>
#include <orrery/models/attitude/slew.hpp>
#include <orrery/models/attitude/sun_track.hpp>
#include <orrery/models/orbit/thrust.hpp>

#include <string>

namespace orrery {

/// Where to point.
class AttitudeMode {
 public:
  static AttitudeMode zenith() { return {Kind::kZenith, {}}; }  // +Z up, +X along track
  static AttitudeMode sun() { return {Kind::kSun, {}}; }  // +X to the Sun, +Z nearest the zenith
  /// A fixed attitude. @throws std::invalid_argument  |q| not within 1e-3 of 1; it is normalised.
  static AttitudeMode target(const Quaternion& q_BI);

  std::string to_string() const;  // "zenith", "Sun", "target (w, x, y, z)"
  friend bool operator==(const AttitudeMode&, const AttitudeMode&) = default;

 private:
  friend class PointingLaw;
  enum class Kind { kZenith, kSun, kTarget };
  AttitudeMode(Kind kind, const Quaternion& q_BI) : kind_(kind), q_BI_(q_BI) {}
  Kind kind_;
  Quaternion q_BI_;
};

/// An analytic function of the instant and the orbit: nothing is integrated, and asking costs the
/// state at that instant alone.
///
/// Modes  The attitude is that of AttitudeMode exactly (pointing.hpp).
/// Slews  From one mode to the next about the eigenaxis, in the frame of the mode that it goes to:
///        R_BI(t) = Q(e, angle - phi(t)) R_target(t), where e and angle turn the target's attitude
///        into the body's at the begin of the slew, and phi runs from rest to rest (slew.hpp). So a
///        target that moves is met without a chase; the attitude is continuous throughout, and the
///        rate at the end. At the begin the rate jumps by that of the two frames relative to each
///        other (0.06 deg/s from zenith to a fixed attitude; an interrupted slew stops at once): no
///        dynamics here. Half a turn, which has no unique axis, takes that of to_quaternion.
/// Checked by test_suites/unit/models/attitude/pointing_law_test.cpp
class PointingLaw final : public AttitudeLaw {
 public:
  /// In mode `initial` since ever. @throws std::invalid_argument  a slew limit out of range.
  explicit PointingLaw(const AttitudeMode& initial = AttitudeMode::zenith(),
                       const SlewLimits& limits = {});

  /// From `t` on turns to `mode`, starting from the attitude at `t`, where the orbit is at `state`.
  /// Already there, or on the way there: nothing changes.
  /// @throws std::logic_error  `t` before the last change.
  void point(SimTime t, const InertialState& state, const AttitudeMode& mode);

  /// @throws std::logic_error  `t` before the last change. @throws std::domain_error  no orbit
  /// plane.
  BodyAttitude at(SimTime t, const InertialState& state) const;
  Mat3 R_BI(SimTime t, const InertialState& state) const override { return at(t, state).R_BI; }
  std::optional<SimTime> next_discontinuity(SimTime t) const override;

  const AttitudeMode& mode() const { return mode_; }
  bool is_slewing(SimTime t) const { return t < end_; }
  SimTime slew_end() const { return end_; }

 private:
  BodyAttitude target_at(SimTime t, const InertialState& state) const;
  void check_not_past(const char* function, SimTime t) const;

  AttitudeMode mode_;
  SlewLimits limits_;
  SlewProfile profile_;
  Vec3 axis_B_{1, 0, 0};
  double angle_rad_ = 0;            // at the begin of the slew
  SimTime begin_ = SimTime::min();  // of the last slew
  SimTime end_ = SimTime::min();
  SunTrack sun_;
};

/// What the attitude is taken for on board: the true one turned by an error whose components about
/// the body axes are normal with this 1-sigma. Three draws.
Quaternion with_knowledge_error(const Quaternion& q_BI, double sigma_deg, RandomStream& random);

}  // namespace orrery
