#include "formation_keeping/reconfiguration_planner.hpp"

#include <gtest/gtest.h>

#include "flight_test_support.hpp"

namespace formation_keeping {

using namespace flight_support;

namespace {

using flight_test::kEpoch_ns;
using flight_test::roe;

constexpr double kRevolution_s = 5739.0;

FormationState formation(const RelativeElements& a_roe) {
  FormationState state{};
  state.t_ns = kEpoch_ns;
  state.chief = flight_test::reference_chief();
  state.relative.mean = a_roe;
  return state;
}

struct ReconfigurationPlannerTest : testing::Test {
  // Plans all of the miss, with the whole time for it.
  bool plan_to(const RelativeElements& target, double revolutions) {
    goal = {target, now.t_ns + nanoseconds(revolutions * kRevolution_s)};
    return ReconfigurationPlanner(options).plan(now, goal, predicted_miss(now, goal),
                                                {now.t_ns + 30 * kSecond_ns, goal.end_ns}, &plan);
  }
  // What the plan does to two spacecraft above an oblate Earth, propagated in Cartesian
  // coordinates.
  RelativeElements flown() const {
    StateEci chief = flight_test::state_of_mean(now.chief);
    StateEci deputy =
        flight_test::state_of_mean(apply_relative_elements(now.chief, now.relative.mean));
    std::int64_t t_ns = now.t_ns;
    const auto coast_to = [&](std::int64_t until_ns) {
      chief = flight_test::propagate_oblate(chief, seconds(until_ns - t_ns));
      deputy = flight_test::propagate_oblate(deputy, seconds(until_ns - t_ns));
      t_ns = until_ns;
    };
    for (int k = 0; k < plan.count; ++k) {
      coast_to(plan.burns[k].t_ns);
      deputy.v_ECI = deputy.v_ECI + transpose(eci_to_rtn(deputy)) * plan.burns[k].dv_RTN;
    }
    coast_to(goal.end_ns);
    return relative_elements(flight_test::mean_of_state(chief), flight_test::mean_of_state(deputy));
  }

  double na() const { return mean_motion_radps(now.chief.a_m); }  // m/s per m of a_roe

  FormationState now = formation(roe(0, 0, 0, 300, 0, 300));
  PlannerOptions options;
  Goal goal;
  Plan plan;
};

// The first flight. bound_joint of the reference mission is 0.245 m/s: here sqrt(di^2 + (de/2)^2) n
// a, a vector impulse at each passage. 2 % for J2, which turns a*de by 2.5 deg on the way.
TEST_F(ReconfigurationPlannerTest, TheReferenceReconfigurationCostsTheJointBound) {
  ASSERT_TRUE(plan_to(roe(0, 0, 0, 100, 0, 100), 10));
  const double bound_mps = na() * std::hypot(200.0, 100.0);
  EXPECT_NEAR(bound_mps, 0.245, 0.001);
  EXPECT_GE(plan.delta_v_mps, 0.999 * bound_mps);
  EXPECT_LE(plan.delta_v_mps, 1.02 * bound_mps);
}

// In an oblate field the plan ends where it should. Its own model is linear: 2nd-order terms are
// a_roe^2/a = 13 mm, times 9.4 per revolution in a*dl; an error of da is worth 94 times itself in
// a*dl after ten.
TEST_F(ReconfigurationPlannerTest, TheReferenceReconfigurationArrives) {
  ASSERT_TRUE(plan_to(roe(0, 0, 0, 100, 0, 100), 10));
  const RelativeElements end = flown();
  EXPECT_NEAR(end[kDa], 0.0, 0.3);
  EXPECT_NEAR(end[kDl], 0.0, 10.0);
  EXPECT_NEAR(end[kDex], 0.0, 1.0);
  EXPECT_NEAR(end[kDey], 100.0, 1.0);
  EXPECT_NEAR(end[kDix], 0.0, 1.0);
  EXPECT_NEAR(end[kDiy], 100.0, 1.0);
}

// A correct plan keeps 89-100 m, says the reference mission; the issue asks for 60 m.
TEST_F(ReconfigurationPlannerTest, TheReferenceReconfigurationIsSafeIfABurnIsLost) {
  ASSERT_TRUE(plan_to(roe(0, 0, 0, 100, 0, 100), 10));
  EXPECT_GT(plan.safe_distance_m, 89.0);
  EXPECT_LT(plan.safe_distance_m, 100.5);
}

// Bounds of single elements, guide and D'Amico (2010): n a |ddi|, n a |dde|/2, n a |dda|/2. The
// planner may spend 2 % and 0.5 mm/s more to end early.
TEST_F(ReconfigurationPlannerTest, SingleElementsCostTheirLowerBounds) {
  ASSERT_TRUE(plan_to(roe(0, 0, 0, 300, 0, 200), 5));
  EXPECT_NEAR(plan.delta_v_mps, na() * 100, 0.02 * na() * 100 + 5e-4);
  ASSERT_TRUE(plan_to(roe(0, 0, 0, 400, 0, 300), 5));
  // J2 turns a*de by 1.2 deg: 6 m across, 3.3 mm/s radially and 1.6 in quadrature at most.
  EXPECT_NEAR(plan.delta_v_mps, na() * 50, 0.05 * na() * 50 + 5e-4);
}

// a*dl alone: a tangential impulse p raises a*da by 2p/n, which drifts by 3 p per second; the
// opposite one m revolutions later takes both a*da and its a*de back. So 2 |ddl| / (3 m P), and the
// planner looks six revolutions ahead, m = 5. It may spend 2 % and 0.5 mm/s more.
TEST_F(ReconfigurationPlannerTest, AShiftAlongTrackIsADriftAndItsEnd) {
  const RelativeElements start = now.relative.mean;
  // Targets that the vectors reach by themselves.
  goal = {state_transition(now.chief, 8 * kRevolution_s) * start, 0};
  RelativeElements target = goal.a_roe;
  target[kDl] += 1000.0;
  ASSERT_TRUE(plan_to(target, 8));
  const double least_mps = 2.0 * 1000.0 / (3.0 * 5.0 * kRevolution_s);
  EXPECT_NEAR(plan.delta_v_mps, least_mps, 0.02 * least_mps + 5e-4);
  EXPECT_NEAR(flown()[kDl], target[kDl], 10.0);
  EXPECT_NEAR(flown()[kDa], 0.0, 0.3);
}

// de and di with phases 60 deg apart cannot share burns; the goal is reached all the same.
TEST_F(ReconfigurationPlannerTest, UnparallelChangesAreFlownApart) {
  options.min_radial_normal_m = 0.0;
  ASSERT_TRUE(plan_to(roe(0, 0, 60, 260, -120, 230), 8));
  const RelativeElements end = flown();
  EXPECT_NEAR(end[kDa], 0.0, 0.3);
  EXPECT_NEAR(end[kDex], 60.0, 1.0);
  EXPECT_NEAR(end[kDey], 260.0, 1.0);
  EXPECT_NEAR(end[kDix], -120.0, 1.0);
  EXPECT_NEAR(end[kDiy], 230.0, 1.0);
  EXPECT_LT(plan.delta_v_mps,
            1.05 * na() * (std::hypot(120, 70) + 0.5 * std::hypot(60, 40)) + 2e-3);
}

TEST_F(ReconfigurationPlannerTest, AnImpulseLimitSpreadsThePlan) {
  options.max_impulse_mps = 0.04;
  ASSERT_TRUE(plan_to(roe(0, 0, 0, 100, 0, 100), 10));
  EXPECT_GE(plan.count, 7);  // 0.245 / 0.04
  for (int k = 0; k < plan.count; ++k) EXPECT_LE(norm(plan.burns[k].dv_RTN), 0.04);
  EXPECT_LE(plan.delta_v_mps, 1.02 * na() * std::hypot(200.0, 100.0));
  EXPECT_NEAR(flown()[kDey], 100.0, 1.0);
  options.max_impulse_mps = 0.005;  // 49 burns do not fit into 20 passages
  EXPECT_FALSE(plan_to(roe(0, 0, 0, 100, 0, 100), 10));
}

TEST_F(ReconfigurationPlannerTest, AWindowWithoutPassageHasNoPlan) {
  goal = {roe(0, 0, 0, 100, 0, 100), now.t_ns + nanoseconds(5 * kRevolution_s)};
  const BurnWindow empty{now.t_ns, now.t_ns - 1};
  EXPECT_FALSE(
      ReconfigurationPlanner(options).plan(now, goal, predicted_miss(now, goal), empty, &plan));
}

// Taking all of a*di away first, and a*de later, leaves nothing across when a burn in between is
// lost.
TEST_F(ReconfigurationPlannerTest, SafetySeesAPlanThatLeansOnABurn) {
  Plan leaning;
  // A normal impulse at u = 90 deg changes a*diy by dv/n: 300 m down to nothing, then back to -100
  // m.
  const double u = now.chief.u_rad, n = mean_motion_radps(now.chief.a_m);
  const std::int64_t at_90_ns = now.t_ns + nanoseconds((kPi / 2 - u) / n);
  leaning.burns[0] = {at_90_ns, flight_support::vec3(0, 0, -300 * n)};
  leaning.burns[1] = {at_90_ns + nanoseconds(kPi / n), flight_support::vec3(0, 0, 100 * n)};
  leaning.count = 2;
  EXPECT_LT(plan_safe_distance_m(now, leaning), 5.0);
  leaning.count = 0;
  EXPECT_NEAR(plan_safe_distance_m(now, leaning), 300.0, 2.0);
}

}  // namespace
}  // namespace formation_keeping
