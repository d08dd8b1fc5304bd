#include "rpo_kit/near_range/inspection.hpp"

#include <algorithm>
#include <cmath>

#include "support/orbit/constants.hpp"
#include "support/symmetric.hpp"

namespace rpo_kit {
namespace {

using namespace flight_support;

ChaserFrame frame_of(const Sighting& sighting, const Observer& own) {
  const StateEci state = state_from_osculating(osculating_from_mean(own.mean));
  return {sighting.t_ns, mean_motion_radps(own.mean.a_m), sighting.R_CI, eci_to_rtn(state),
          sighting.attitude_sigma_rad};
}

// The camera's own attitude moves the place across the line of sight.
PlaceMeasurement place_of(const Pose& pose, const ChaserFrame& frame, double scale_error) {
  const Mat3 R_IC = transpose(frame.R_CI);
  const Vec3& r = pose.r_BC_C;
  const Mat3 lever{{{0, -r[2], r[1]}, {r[2], 0, -r[0]}, {-r[1], r[0], 0}}};
  const Vec3 stretch = scale_error * r;
  Mat3 C = (frame.attitude_sigma_rad * frame.attitude_sigma_rad) * (lever * transpose(lever)) +
           stretch * transpose(stretch);
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) C(i, j) += pose.covariance(kPosePosition + i, kPosePosition + j);
  }
  return {frame.t_ns, R_IC * r, symmetric(R_IC * C * frame.R_CI)};
}

}  // namespace

Inspection::Inspection(const InspectionOptions& options)
    : options_(options),
      points_B_(options.points_B, options.points_B + options.points),
      filter_(options.filter) {}

void Inspection::burn(std::int64_t t_ns, const Vec3& dv_RTN, const Mat3& covariance_RTN) {
  burns_.push_back({t_ns, dv_RTN, covariance_RTN});
}

void Inspection::burn_until(std::int64_t t_ns, double orbital_rate_radps) {
  std::size_t done = 0;
  for (; done < burns_.size() && burns_[done].t_ns <= t_ns; ++done) {
    if (!filter_.started()) continue;
    filter_.predict(burns_[done].t_ns, orbital_rate_radps);
    filter_.burn(burns_[done].dv_RTN, burns_[done].covariance_RTN);
  }
  burns_.erase(burns_.begin(), burns_.begin() + static_cast<std::ptrdiff_t>(done));
}

Sighted Inspection::look(const Sighting& sighting, const Observer& own) {
  Sighted result;
  if (points_B_.empty()) return result;
  const ChaserFrame frame = frame_of(sighting, own);
  burn_until(frame.t_ns, frame.orbital_rate_radps);
  Pose pose;
  const Camera& camera = sighting.camera != nullptr ? *sighting.camera : options_.camera;
  if (!estimate_pose(camera, points_B_, sighting.seen, options_.pose, &pose)) {
    return result;
  }
  ++poses_;
  result.pose = true;
  const PoseVerdict verdict = filter_.update(frame, pose);
  if (!filter_.healthy()) {
    ++lost_;
    filter_ = PoseFilter(options_.filter);
    return result;
  }
  result.place = verdict != PoseVerdict::kRejected;
  if (result.place) result.measurement = place_of(pose, frame, options_.filter.scale_error);
  return result;
}

// Burns in between are told to a copy, as the sighting itself is still to come.
bool Inspection::expect(std::int64_t t_ns, const Mat3& R_CI, const Observer& own,
                        ExpectedPose* expected) const {
  if (!filter_.started() || t_ns < filter_.t_ns()) return false;
  const StateEci state = state_from_osculating(osculating_from_mean(own.mean));
  const double n = mean_motion_radps(own.mean.a_m);
  PoseFilter ahead = filter_;
  for (const PendingBurn& burn : burns_) {
    if (burn.t_ns > t_ns) break;
    ahead.predict(burn.t_ns, n);
    ahead.burn(burn.dv_RTN, burn.covariance_RTN);
  }
  ahead.predict(t_ns, n);
  expected->pose.r_BC_C = R_CI * (transpose(eci_to_rtn(state)) * ahead.r_RTN());
  expected->pose.R_CB = R_CI * transpose(ahead.R_BI());
  const Vec3 u = (1.0 / norm(ahead.r_RTN())) * ahead.r_RTN();
  const auto& P = ahead.covariance();
  double along = 0.0, all = 0.0, turn = 0.0;
  for (int i = 0; i < 3; ++i) {
    all += P(kNearPosition + i, kNearPosition + i);
    turn += P(kNearRotation + i, kNearRotation + i);
    for (int j = 0; j < 3; ++j) along += u[i] * P(kNearPosition + i, kNearPosition + j) * u[j];
  }
  expected->rotation_sigma_rad = std::sqrt(turn);
  expected->along_sigma_m = std::sqrt(std::max(0.0, along));
  expected->across_sigma_m = std::sqrt(std::max(0.0, all - along));
  return true;
}

bool Inspection::settled() const {
  if (!filter_.started()) return false;
  const double limit = options_.settled_mps * options_.settled_mps;
  for (int k = 0; k < 3; ++k) {
    if (!(filter_.covariance()(kNearVelocity + k, kNearVelocity + k) < limit)) return false;
  }
  return true;
}

StateMeasurement Inspection::state(const Observer& own, Matrix6* covariance_RTN) const {
  const Mat3 R_HI = eci_to_rtn(state_from_osculating(osculating_from_mean(own.mean)));
  const double n = mean_motion_radps(own.mean.a_m);
  // v_inertial = v_RTN + n x r, both in axes of RTN.
  const Mat3 turning{{{0, -n, 0}, {n, 0, 0}, {0, 0, 0}}};
  StateMeasurement state;
  state.t_ns = filter_.t_ns();
  state.r_TO_ECI = transpose(R_HI) * filter_.r_RTN();
  state.v_TO_ECI = transpose(R_HI) * (filter_.v_RTN() + turning * filter_.r_RTN());
  Matrix<6, kNearStates> T;
  for (int r = 0; r < 3; ++r) {
    T(r, kNearPosition + r) = T(3 + r, kNearVelocity + r) = 1.0;
    for (int c = 0; c < 3; ++c) T(3 + r, kNearPosition + c) = turning(r, c);
  }
  *covariance_RTN = symmetric(T * filter_.covariance() * transpose(T));
  return state;
}

}  // namespace rpo_kit
