#include <orrery/models/attitude/pointing_law.hpp>

#include <cmath>
#include <cstdio>
#include <numbers>
#include <stdexcept>

namespace orrery {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

// Turns components by angle_rad about the axis, right-handed.
Quaternion turn(const Vec3& axis, double angle_rad) {
  const Vec3 v = std::sin(angle_rad / 2) * axis;
  return {std::cos(angle_rad / 2), v.x, v.y, v.z};
}

SimTime after(SimTime begin, double span_s) {
  return begin + from_seconds(span_s);
}

}  // namespace

AttitudeMode AttitudeMode::target(const Quaternion& q) {
  const double length = std::sqrt(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
  if (!(std::abs(length - 1) <= 1e-3)) {
    throw std::invalid_argument("AttitudeMode::target: |q_BI| = " + std::to_string(length) +
                                "; accepted: within 0.001 of 1");
  }
  return {Kind::kTarget, {q.w / length, q.x / length, q.y / length, q.z / length}};
}

std::string AttitudeMode::to_string() const {
  if (kind_ == Kind::kZenith) return "zenith";
  if (kind_ == Kind::kSun) return "Sun";
  char text[96];
  std::snprintf(text, sizeof text, "target (%.6f, %.6f, %.6f, %.6f)", q_BI_.w, q_BI_.x, q_BI_.y,
                q_BI_.z);
  return text;
}

PointingLaw::PointingLaw(const AttitudeMode& initial, const SlewLimits& limits)
    : mode_(initial), limits_(limits), profile_(0, limits) {}

void PointingLaw::check_not_past(const char* function, SimTime t) const {
  if (t >= begin_) return;
  throw std::logic_error("PointingLaw::" + std::string(function) + ": t = " + orrery::to_string(t) +
                         "; accepted: from the last change of mode on, " +
                         orrery::to_string(begin_));
}

void PointingLaw::point(SimTime t, const InertialState& state, const AttitudeMode& mode) {
  check_not_past("point", t);
  if (mode == mode_) return;
  const Mat3 R_BI = at(t, state).R_BI;
  mode_ = mode;
  const Quaternion q = to_quaternion(R_BI * transpose(target_at(t, state).R_BI));
  const Vec3 v{q.x, q.y, q.z};
  angle_rad_ = 2 * std::atan2(norm(v), q.w);
  axis_B_ = norm(v) > 0 ? unit(v) : Vec3{1, 0, 0};
  profile_ = SlewProfile(angle_rad_, limits_);
  begin_ = t;
  end_ = after(t, profile_.duration_s());
}

BodyAttitude PointingLaw::target_at(SimTime t, const InertialState& state) const {
  switch (mode_.kind_) {
    case AttitudeMode::Kind::kZenith:
      return zenith_pointing(state);
    case AttitudeMode::Kind::kSun:
      return sun_pointing(state, sun_.at(t));
    case AttitudeMode::Kind::kTarget:
      break;
  }
  return {to_matrix(mode_.q_BI_), {}};
}

BodyAttitude PointingLaw::at(SimTime t, const InertialState& state) const {
  check_not_past("at", t);
  const BodyAttitude target = target_at(t, state);
  if (t >= end_) return target;
  const double elapsed_s = to_seconds(t - begin_);
  const Mat3 Q = to_matrix(turn(axis_B_, angle_rad_ - profile_.angle_rad(elapsed_s)));
  return {Q * target.R_BI, profile_.rate_radps(elapsed_s) * axis_B_ + Q * target.omega_BI_B};
}

std::optional<SimTime> PointingLaw::next_discontinuity(SimTime t) const {
  if (t >= end_) return {};
  for (const double corner_s : profile_.corners_s()) {
    const SimTime corner = after(begin_, corner_s);
    if (corner > t) return corner;
  }
  return {};
}

Quaternion with_knowledge_error(const Quaternion& q_BI, double sigma_deg, RandomStream& random) {
  Vec3 error_B;
  error_B.x = random.normal(0, sigma_deg * kDegree);
  error_B.y = random.normal(0, sigma_deg * kDegree);
  error_B.z = random.normal(0, sigma_deg * kDegree);
  const double angle = norm(error_B);
  if (angle == 0) return q_BI;
  return turn(error_B / angle, angle) * q_BI;
}

}  // namespace orrery
