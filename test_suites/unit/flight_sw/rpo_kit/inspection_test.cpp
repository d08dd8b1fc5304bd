#include "rpo_kit/near_range/inspection.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "../flight_test_support.hpp"
#include "star_scene.hpp"
#include "support/symmetric.hpp"

namespace rpo_kit {
namespace {

using namespace flight_support;
using flight_test::kEpoch_ns;
using flight_test::Noise;

InspectionOptions with_target() {
  InspectionOptions options;
  const double x[2] = {0.3, -0.3}, y[2] = {0.2, -0.2}, z[2] = {0.15, -0.15};
  for (int k = 0; k < 8; ++k) {
    options.points_B[options.points++] = vec3(x[k & 1], y[k >> 1 & 1], z[k >> 2]);
  }
  return options;
}

// A target at rest in ECI seen by a chaser that flies past it, both numerically.
class Passage {
 public:
  explicit Passage(std::uint64_t seed) : noise_(seed) {
    const OrbitElements orbit = flight_test::reference_chief();
    target_ = flight_test::state_of_mean(orbit);
    chaser_ = flight_test::state_of_mean(
        apply_relative_elements(orbit, flight_test::roe(0, -30, 4, 8, 4, 8)));
  }
  void run_for(double dt_s) {
    target_ = flight_test::propagate_oblate(target_, dt_s);
    chaser_ = flight_test::propagate_oblate(chaser_, dt_s);
    t_s_ += dt_s;
  }
  void burn(const Vec3& dv_RTN) {
    chaser_.v_ECI = chaser_.v_ECI + transpose(eci_to_rtn(chaser_)) * dv_RTN;
  }
  Sighting look(const InspectionOptions& options) {
    const Vec3 d = target_.r_ECI - chaser_.r_ECI;
    Sighting s;
    s.t_ns = now_ns();
    s.R_CI = flight_test::looking_along((1.0 / norm(d)) * d, 0.2);
    s.attitude_sigma_rad = 1e-6;
    for (int k = 0; k < options.points; ++k) {
      Pixel pixel;
      if (!project(options.camera, s.R_CI * (d + options.points_B[k]), &pixel)) continue;
      pixel.u += 0.5 * noise_.normal();
      pixel.v += 0.5 * noise_.normal();
      s.seen.push_back({k, pixel, 0.5});
    }
    return s;
  }
  Observer own() const { return observer_from_state(now_ns(), chaser_); }
  std::int64_t now_ns() const { return kEpoch_ns + nanoseconds(t_s_); }
  Vec3 r_TO_ECI() const { return target_.r_ECI - chaser_.r_ECI; }
  Vec3 v_TO_ECI() const { return target_.v_ECI - chaser_.v_ECI; }

 private:
  Noise noise_;
  StateEci target_, chaser_;
  double t_s_ = 0.0;
};

// Squared normalised errors of the places handed to the fusion: 3 degrees of freedom, 60 of them:
// 3 +- 0.32, less what widening by large residuals takes (13 % at most). So is the state that the
// track would start the filter of the whole range with.
TEST(InspectionTest, HandsOnPlacesAndAStateThatAreHonest) {
  const InspectionOptions options = with_target();
  Passage scene(71);
  Inspection inspection(options);
  double places = 0.0;
  int count = 0;
  for (; count < 60; ++count) {
    scene.run_for(10.0);
    const Sighted sighted = inspection.look(scene.look(options), scene.own());
    ASSERT_TRUE(sighted.pose && sighted.place);
    places += squared_mahalanobis(sighted.measurement.covariance,
                                  sighted.measurement.r_TO_ECI - scene.r_TO_ECI());
  }
  EXPECT_NEAR(places / count, 2.8, 1.0);
  EXPECT_TRUE(inspection.settled());
  Matrix6 covariance;
  const StateMeasurement state = inspection.state(scene.own(), &covariance);
  const Mat3 R_HI = eci_to_rtn(state_from_osculating(osculating_from_mean(scene.own().mean)));
  const Vec3 dr = R_HI * (state.r_TO_ECI - scene.r_TO_ECI());
  const Vec3 dv = R_HI * (state.v_TO_ECI - scene.v_TO_ECI());
  Vector<6> error;
  for (int k = 0; k < 3; ++k) error[k] = dr[k], error[3 + k] = dv[k];
  // 1e-4 of chi-square with 6 degrees of freedom is 27.9.
  EXPECT_LT(squared_mahalanobis(covariance, error), 27.9);
  EXPECT_LT(norm(dv), 1e-3);
  EXPECT_EQ(inspection.lost(), 0);
  EXPECT_EQ(inspection.poses(), 60);
}

// Told ahead, a burn counts when the next image lies behind it: without, the place would be 2 m off
// after 20 s.
TEST(InspectionTest, BurnToldAheadCountsAtItsTime) {
  const InspectionOptions options = with_target();
  Passage scene(72);
  Inspection inspection(options);
  for (int k = 0; k < 30; ++k) {
    scene.run_for(10.0);
    inspection.look(scene.look(options), scene.own());
  }
  const Vec3 dv = vec3(0.0, 0.0, 0.1);
  inspection.burn(scene.now_ns() + nanoseconds(25.0), dv, burn_covariance(dv, 0.01, 0.01));
  for (int k = 0; k < 2; ++k) {
    scene.run_for(10.0);
    EXPECT_TRUE(inspection.look(scene.look(options), scene.own()).place);
  }
  scene.run_for(5.0);
  scene.burn(dv);
  scene.run_for(20.0);
  EXPECT_TRUE(inspection.look(scene.look(options), scene.own()).place);
  EXPECT_EQ(inspection.filter().rejected(), 0);
  Matrix6 covariance;
  const StateMeasurement state = inspection.state(scene.own(), &covariance);
  EXPECT_LT(norm(state.v_TO_ECI - scene.v_TO_ECI()), 0.01);
}

// 1 is taken from the variance of one axis, which leaves it negative.
TEST(InspectionTest, CovarianceThatIsNoneStopsTheFilter) {
  const InspectionOptions options = with_target();
  Passage scene(73);
  PoseFilter filter;
  Pose pose;
  const Sighting s = scene.look(options);
  const std::vector<Vec3> points(options.points_B, options.points_B + options.points);
  ASSERT_TRUE(estimate_pose(options.camera, points, s.seen, {}, &pose));
  const ChaserFrame frame{s.t_ns, 1.0948e-3, s.R_CI,
                          eci_to_rtn(state_from_osculating(osculating_from_mean(scene.own().mean))),
                          1e-6};
  filter.start(frame, pose);
  EXPECT_TRUE(filter.healthy());
  Pose none = pose;
  none.covariance(kPosePosition, kPosePosition) -= 1.0;
  EXPECT_EQ(filter.update(frame, none), PoseVerdict::kRejected);
  EXPECT_FALSE(filter.healthy());
  EXPECT_EQ(filter.update(frame, pose), PoseVerdict::kRejected);
  filter.start(frame, pose);
  EXPECT_TRUE(filter.healthy());
  EXPECT_EQ(filter.update(frame, pose), PoseVerdict::kUsed);
}

TEST(InspectionTest, UnknownTargetGivesNothing) {
  Passage scene(74);
  Inspection inspection;
  EXPECT_FALSE(inspection.look(scene.look(with_target()), scene.own()).pose);
  EXPECT_FALSE(inspection.tracking() || inspection.settled());
}

}  // namespace
}  // namespace rpo_kit
