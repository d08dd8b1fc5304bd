#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "../flight_test_support.hpp"
#include "rpo_kit/near_range/pose_filter.hpp"
#include "star_scene.hpp"
#include "support/symmetric.hpp"

namespace rpo_kit {
namespace {

using namespace flight_support;
using flight_test::kEpoch_ns;
using flight_test::Noise;

// A body of 0.6 x 0.4 x 0.3 m with two panels: half a turn about z looks the same.
const std::vector<Vec3> kTarget = {
    vec3(0.3, 0.2, 0.15),  vec3(0.3, 0.2, -0.15),  vec3(0.3, -0.2, 0.15),  vec3(0.3, -0.2, -0.15),
    vec3(-0.3, 0.2, 0.15), vec3(-0.3, 0.2, -0.15), vec3(-0.3, -0.2, 0.15), vec3(-0.3, -0.2, -0.15),
    vec3(0.1, 0.9, 0.0),   vec3(-0.1, 0.9, 0.0),   vec3(0.1, -0.9, 0.0),   vec3(-0.1, -0.9, 0.0)};

int half_turn_about_z(int point) {
  const Vec3 turned = vec3(-kTarget[static_cast<std::size_t>(point)][0],
                           -kTarget[static_cast<std::size_t>(point)][1],
                           kTarget[static_cast<std::size_t>(point)][2]);
  for (std::size_t k = 0; k < kTarget.size(); ++k) {
    if (norm(kTarget[k] - turned) < 1e-9) return static_cast<int>(k);
  }
  return -1;
}

Camera pose_camera() {
  Camera camera;
  camera.k1 = -0.05, camera.p1 = 2e-4;
  return camera;
}

struct Look {
  double sigma_px = 0.7;
  double visible = 0.75, outlier = 0.15;  // probabilities per keypoint
  bool flipped = false;
};

std::vector<Keypoint> look(const Vec3& r_BC_C, const Mat3& R_CB, const Look& how, Noise* noise) {
  std::vector<Keypoint> seen;
  for (std::size_t k = 0; k < kTarget.size(); ++k) {
    double u = 0.0, v = 0.0;
    const bool hidden = noise->uniform() > how.visible;
    const bool wrong = noise->uniform() < how.outlier;
    if (!flight_test::pinhole(pose_camera(), r_BC_C + R_CB * kTarget[k], &u, &v)) continue;
    u += (wrong ? 40.0 : how.sigma_px) * noise->normal();
    v += (wrong ? 40.0 : how.sigma_px) * noise->normal();
    const int point = static_cast<int>(k);
    if (!hidden)
      seen.push_back({how.flipped ? half_turn_about_z(point) : point, {u, v}, how.sigma_px});
  }
  return seen;
}

double angle_rad(const Mat3& a, const Mat3& b) {
  const Mat3 D = a * transpose(b);
  return std::acos(std::clamp(0.5 * (D(0, 0) + D(1, 1) + D(2, 2) - 1.0), -1.0, 1.0));
}

// One of the solutions is the pose; rounding of a quartic with nearly double roots, at 2 m to 60 m.
TEST(ThreePointTest, OneSolutionIsThePose) {
  Noise noise(41);
  int near = 0;
  for (int k = 0; k < 200; ++k) {
    const Mat3 R_CB =
        flight_test::axis_rotation(flight_test::random_direction(&noise), kTwoPi * noise.uniform());
    const double z = 2.0 + 58.0 * noise.uniform();
    const Vec3 r = vec3(0.1 * z * noise.uniform(), -0.05 * z, z);
    const Vec3 points[3] = {kTarget[0], kTarget[5], kTarget[8]};
    Vec3 directions[3];
    for (int j = 0; j < 3; ++j) {
      const Vec3 p = r + R_CB * points[j];
      directions[j] = (1.0 / norm(p)) * p;
    }
    Pose poses[4];
    const int count = solve_three_points(points, directions, poses);
    double best = INFINITY;
    for (int j = 0; j < count; ++j) {
      best = std::min(best, norm(poses[j].r_BC_C - r) / z + angle_rad(poses[j].R_CB, R_CB));
    }
    near += best < 1e-3 ? 1 : 0;
  }
  // The rest have a double root (a direction in the plane of the danger cylinder).
  EXPECT_GE(near, 195);
}

// Squared normalised errors of 200 poses: chi-square of 6 degrees of freedom, mean 6 +- 0.25. The
// order of position and rotation and the signs of their correlation are in it.
TEST(PoseEstimatorTest, CovarianceIsHonest) {
  Noise noise(42);
  double nees = 0.0;
  int poses = 0;
  for (int k = 0; k < 200; ++k) {
    const Mat3 R_CB =
        flight_test::axis_rotation(flight_test::random_direction(&noise), kTwoPi * noise.uniform());
    const Vec3 r = vec3(0.5, -0.4, 8.0 + 12.0 * noise.uniform());
    Pose pose;
    if (!estimate_pose(pose_camera(), kTarget, look(r, R_CB, {0.5, 1.0, 0.0, false}, &noise), {},
                       &pose)) {
      continue;
    }
    ++poses;
    Vector<6> error;
    const Vec3 turn = flight_test::small_turn(pose.R_CB, R_CB);
    for (int j = 0; j < 3; ++j) {
      error[kPosePosition + j] = r[j] - pose.r_BC_C[j];
      error[kPoseRotation + j] = turn[j];
    }
    nees += squared_mahalanobis(pose.covariance, error);
  }
  EXPECT_EQ(poses, 200);
  // Widening where residuals are large by chance makes it smaller: 18 degrees of freedom, up to
  // 13 % on average.
  EXPECT_NEAR(nees / poses, 5.6, 0.8);
  RecordProperty("nees", std::to_string(nees / poses));
}

// A third of the keypoints wrong.
TEST(PoseEstimatorTest, OutliersAreLeftOut) {
  Noise noise(43);
  int found = 0, wrong = 0;
  for (int k = 0; k < 100; ++k) {
    const Mat3 R_CB =
        flight_test::axis_rotation(flight_test::random_direction(&noise), kTwoPi * noise.uniform());
    const Vec3 r = vec3(0.5, -0.4, 15.0);
    Pose pose;
    if (!estimate_pose(pose_camera(), kTarget, look(r, R_CB, {0.7, 1.0, 0.33, false}, &noise), {},
                       &pose)) {
      continue;
    }
    ++found;
    wrong += norm(pose.r_BC_C - r) > 0.6 || angle_rad(pose.R_CB, R_CB) > 0.15 ? 1 : 0;
  }
  EXPECT_GE(found, 90);
  EXPECT_LE(wrong, 1);
}

TEST(PoseEstimatorTest, TooLittleOrUnknownKeypointsAreRefused) {
  Noise noise(44);
  const Vec3 r = vec3(0, 0, 10.0);
  std::vector<Keypoint> seen = look(r, identity<3>(), {0.5, 1.0, 0.0, false}, &noise);
  Pose pose;
  EXPECT_TRUE(estimate_pose(pose_camera(), kTarget, seen, {}, &pose));
  std::vector<Keypoint> few(seen.begin(), seen.begin() + 3);
  EXPECT_FALSE(estimate_pose(pose_camera(), kTarget, few, {}, &pose));
  seen[0].point = 99;
  EXPECT_FALSE(estimate_pose(pose_camera(), kTarget, seen, {}, &pose));
}

// The two spacecraft numerically, and the target as a rigid body (RK4 of quaternion-free Euler's
// equations and of the rotation matrix, 0.1 s).
class InspectionScene {
 public:
  explicit InspectionScene(std::uint64_t seed) : noise_(seed) {
    const OrbitElements target = flight_test::reference_chief();
    // 57 m to 17 m in one revolution: a*da = -4 m leads 38 m along the track.
    target_ = flight_test::state_of_mean(target);
    chaser_ = flight_test::state_of_mean(
        apply_relative_elements(target, flight_test::roe(-4, -55, 6, 12, 6, 12)));
    R_BI_ = flight_test::axis_rotation(flight_test::random_direction(&noise_), 2.0);
    omega_ = vec3(0.012, 0.008, -0.009);  // 1 deg/s
  }
  void run_for(double dt_s) {
    target_ = flight_test::propagate_oblate(target_, dt_s);
    chaser_ = flight_test::propagate_oblate(chaser_, dt_s);
    const int steps = static_cast<int>(std::lround(dt_s / 0.1));
    for (int k = 0; k < steps; ++k) tumble(dt_s / steps);
    t_s_ += dt_s;
  }
  // Camera towards the target, 1 deg off; R_CI known to 3e-5 rad.
  ChaserFrame frame() {
    const Vec3 d = target_.r_ECI - chaser_.r_ECI;
    const Vec3 off = (1.0 / norm(d)) * d + noise_.normal3(0.01);
    true_R_CI_ = flight_test::looking_along((1.0 / norm(off)) * off, 0.3);
    const Vec3 e = noise_.normal3(3e-5);
    const Mat3 known = flight_test::axis_rotation((1.0 / norm(e)) * e, norm(e)) * true_R_CI_;
    return {kEpoch_ns + nanoseconds(t_s_), 1.0948e-3, known, eci_to_rtn(chaser_), 3e-5};
  }
  // After frame().
  std::vector<Keypoint> look(const Look& how) {
    const Vec3 r_BC_C = true_R_CI_ * (target_.r_ECI - chaser_.r_ECI);
    return rpo_kit::look(r_BC_C, true_R_CI_ * transpose(R_BI_), how, &noise_);
  }
  RelativeStateRtn relative() const { return relative_state_rtn(chaser_, target_); }
  const Mat3& R_BI() const { return R_BI_; }
  const Vec3& omega() const { return omega_; }
  double t_s() const { return t_s_; }

 private:
  static Vec3 rate(const Vec3& w) {
    return vec3((1.4 - 1.7) / 1.0 * w[1] * w[2], (1.7 - 1.0) / 1.4 * w[2] * w[0],
                (1.0 - 1.4) / 1.7 * w[0] * w[1]);
  }
  static Mat3 turning(const Vec3& w, const Mat3& R) {
    const Mat3 h{{{0, -w[2], w[1]}, {w[2], 0, -w[0]}, {-w[1], w[0], 0}}};
    return -1.0 * (h * R);
  }
  void tumble(double h) {
    const Vec3 w1 = omega_, k1 = rate(w1), w2 = w1 + 0.5 * h * k1, k2 = rate(w2);
    const Vec3 w3 = w1 + 0.5 * h * k2, k3 = rate(w3), w4 = w1 + h * k3, k4 = rate(w4);
    const Mat3 m1 = turning(w1, R_BI_), m2 = turning(w2, R_BI_ + 0.5 * h * m1);
    const Mat3 m3 = turning(w3, R_BI_ + 0.5 * h * m2), m4 = turning(w4, R_BI_ + h * m3);
    R_BI_ = R_BI_ + (h / 6.0) * (m1 + 2.0 * m2 + 2.0 * m3 + m4);
    omega_ = w1 + (h / 6.0) * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
  }

  Noise noise_;
  StateEci target_, chaser_;
  Mat3 R_BI_, true_R_CI_;
  Vec3 omega_;
  double t_s_ = 0.0;
};

PoseFilterOptions tumbler() {
  PoseFilterOptions options;
  options.inertia[1] = 1.4;
  options.inertia[2] = 1.7;
  return options;
}

Vector<kNearStates> error_of(const PoseFilter& filter, const InspectionScene& scene) {
  const RelativeStateRtn truth = scene.relative();
  const Vec3 turn = flight_test::small_turn(filter.R_BI(), scene.R_BI());
  Vector<kNearStates> e;
  for (int k = 0; k < 3; ++k) {
    e[kNearPosition + k] = truth.r_DC_RTN[k] - filter.r_RTN()[k];
    e[kNearVelocity + k] = truth.v_DC_RTN[k] - filter.v_RTN()[k];
    e[kNearRotation + k] = turn[k];
    e[kNearRate + k] = scene.omega()[k] - filter.omega_BI_B()[k];
  }
  return e;
}

// Required (issue): position below 1 % of range, attitude below 2 deg (median), no undetected
// flip. A pose every 20 s, that is every 20 deg, a quarter of the keypoints hidden, 15 % wrong,
// every eighth image taken for its mirror image, 5 min without any.
TEST(PoseFilterTest, FollowsATumblingTargetThroughFlipsAndGaps) {
  for (std::uint64_t seed : {1, 2}) {
    InspectionScene scene(seed);
    PoseFilter filter(tumbler());
    std::vector<double> attitude_deg, place;
    double nees = 0.0, worst_deg = 0.0;
    int injected = 0, frames = 0;
    for (int k = 1; k <= 285; ++k) {
      scene.run_for(20.0);
      const ChaserFrame frame = scene.frame();
      Look how;
      how.flipped = k > 12 && k % 8 == 0;
      const std::vector<Keypoint> seen = scene.look(how);
      Pose pose;
      const bool gap = k > 150 && k < 166;
      if (!gap && estimate_pose(pose_camera(), kTarget, seen, {}, &pose)) {
        filter.update(frame, pose);
        injected += how.flipped ? 1 : 0;
      } else {
        filter.predict(frame.t_ns, frame.orbital_rate_radps);
      }
      if (k < 15) continue;
      const Vector<kNearStates> e = error_of(filter, scene);
      ++frames;
      nees += squared_mahalanobis(filter.covariance(), e);
      attitude_deg.push_back(angle_rad(filter.R_BI(), scene.R_BI()) * 180.0 / kPi);
      worst_deg = std::max(worst_deg, attitude_deg.back());
      place.push_back(std::sqrt(e[0] * e[0] + e[1] * e[1] + e[2] * e[2]) /
                      norm(scene.relative().r_DC_RTN));
    }
    std::sort(attitude_deg.begin(), attitude_deg.end());
    double squares = 0.0;
    for (double p : place) squares += p * p / static_cast<double>(place.size());
    EXPECT_LT(std::sqrt(squares), 0.01) << seed;
    EXPECT_LT(attitude_deg[attitude_deg.size() / 2], 2.0) << seed;
    EXPECT_LT(worst_deg, 20.0) << seed;
    EXPECT_GT(injected, 20) << seed;
    EXPECT_GE(filter.flips(), injected) << seed;
    // Twelve states; correlated from frame to frame. The floor on rotations keeps it below 12.
    EXPECT_LT(nees / frames, 16.0) << seed;
    EXPECT_GT(nees / frames, 4.0) << seed;
    RecordProperty("place_percent_" + std::to_string(seed),
                   std::to_string(100 * std::sqrt(squares)));
    RecordProperty("attitude_deg_" + std::to_string(seed),
                   std::to_string(attitude_deg[attitude_deg.size() / 2]) + ", worst " +
                       std::to_string(worst_deg));
    RecordProperty("nees_" + std::to_string(seed), std::to_string(nees / frames));
  }
}

// It begins with mirrored poses and must find out: once six of the other kind agree.
TEST(PoseFilterTest, RecoversFromAFlippedStart) {
  InspectionScene scene(5);
  PoseFilter filter(tumbler());
  bool restarted = false;
  for (int k = 1; k <= 60; ++k) {
    scene.run_for(10.0);
    const ChaserFrame frame = scene.frame();
    Pose pose;
    Look how;
    how.flipped = k <= 5;
    if (!estimate_pose(pose_camera(), kTarget, scene.look(how), {}, &pose)) continue;
    restarted |= filter.update(frame, pose) == PoseVerdict::kRestarted && k > 1;
  }
  EXPECT_TRUE(restarted);
  EXPECT_TRUE(filter.healthy());  // the hand-over once lost it (rpo_kit_defect_two_orders)
  EXPECT_LT(angle_rad(filter.R_BI(), scene.R_BI()), 0.1);
}

// One mirrored pose to begin with, and images 20 deg of tumbling apart: its rate unknown, the
// filter would see another turn each time.
TEST(PoseFilterTest, RecoversFromAFlippedFirstPose) {
  InspectionScene scene(7);
  PoseFilter filter(tumbler());
  for (int k = 1; k <= 30; ++k) {
    scene.run_for(20.0);
    const ChaserFrame frame = scene.frame();
    Pose pose;
    Look how;
    how.flipped = k == 1;
    if (!estimate_pose(pose_camera(), kTarget, scene.look(how), {}, &pose)) continue;
    filter.update(frame, pose);
  }
  EXPECT_LT(angle_rad(filter.R_BI(), scene.R_BI()), 0.1);
  EXPECT_GE(filter.used(), 20);
}

TEST(PoseFilterTest, PoseElsewhereOrOfThePastIsRejected) {
  InspectionScene scene(6);
  PoseFilter filter(tumbler());
  Pose pose;
  ChaserFrame frame;
  for (int k = 1; k <= 10; ++k) {
    scene.run_for(10.0);
    frame = scene.frame();
    if (estimate_pose(pose_camera(), kTarget, scene.look({}), {}, &pose))
      filter.update(frame, pose);
  }
  const Vec3 before = filter.r_RTN();
  Pose elsewhere = pose;
  elsewhere.r_BC_C[2] += 20.0;
  EXPECT_EQ(filter.update(frame, elsewhere), PoseVerdict::kRejected);
  frame.t_ns -= kSecond_ns;
  EXPECT_EQ(filter.update(frame, pose), PoseVerdict::kRejected);
  EXPECT_EQ(norm(filter.r_RTN() - before), 0.0);
}

}  // namespace
}  // namespace rpo_kit
