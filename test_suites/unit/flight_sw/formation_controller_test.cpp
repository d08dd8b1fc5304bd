#include "formation_keeping/formation_controller.hpp"

#include <gtest/gtest.h>

#include "flight_test_support.hpp"

namespace formation_keeping {

using namespace flight_support;

namespace {

using flight_test::kEpoch_ns;
using flight_test::roe;
using Acceptance = FormationController::Acceptance;

constexpr std::int64_t kTenRevolutions_ns = 57400 * kSecond_ns;

FormationState known(const RelativeElements& a_roe, double sigma_m, std::int64_t t_ns = kEpoch_ns) {
  FormationState state{};
  state.t_ns = t_ns;
  state.chief = propagate_mean(flight_test::reference_chief(), seconds(t_ns - kEpoch_ns));
  state.relative.mean = a_roe;
  for (int k = 0; k < 6; ++k) state.relative.covariance(k, k) = sigma_m * sigma_m;
  return state;
}

struct FormationControllerTest : testing::Test {
  FormationController controller{ControlOptions(), PlannerOptions()};
  Goal goal{roe(0, 0, 0, 100, 0, 100), kEpoch_ns + kTenRevolutions_ns};
};

TEST_F(FormationControllerTest, RefusesGoalsThatAreUnsafeOrOutOfRange) {
  const auto accepts = [&](const RelativeElements& a_roe, std::int64_t after_s) {
    return controller.accept({a_roe, kEpoch_ns + after_s * kSecond_ns}, kEpoch_ns);
  };
  EXPECT_EQ(accepts(roe(0, 0, 0, 100, 100, 0), 57400), Acceptance::kNotSafe);  // perpendicular
  EXPECT_EQ(accepts(roe(0, 0, 0, 50, 0, 50), 57400), Acceptance::kNotSafe);    // 50 m
  EXPECT_EQ(accepts(roe(0, 0, 0, 6000, 0, 100), 57400), Acceptance::kOutOfRange);
  EXPECT_EQ(accepts(roe(0, NAN, 0, 100, 0, 100), 57400), Acceptance::kOutOfRange);
  EXPECT_EQ(accepts(roe(60, 0, 0, 300, 0, 300), 57400), Acceptance::kOutOfRange);  // drifts
  EXPECT_EQ(accepts(roe(0, 0, 0, 100, 0, 100), 3000), Acceptance::kOutOfRange);
  EXPECT_EQ(accepts(roe(0, 0, 0, 100, 0, 100), 57400), Acceptance::kAccepted);
}

TEST_F(FormationControllerTest, WaitsForNavigationThenForACommand) {
  EXPECT_FALSE(controller.decide(known(roe(0, 0, 0, 300, 0, 300), 1.0)).burn);
  EXPECT_EQ(controller.mode(), Mode::kAcquiring);
  EXPECT_FALSE(controller.decide(known(roe(0, 0, 0, 300, 0, 300), 0.1)).burn);
  EXPECT_EQ(controller.mode(), Mode::kStandby);
  ASSERT_EQ(controller.accept(goal, kEpoch_ns), Acceptance::kAccepted);
  controller.decide(known(roe(0, 0, 0, 300, 0, 300), 0.1));
  EXPECT_EQ(controller.mode(), Mode::kReconfiguring);
}

// Drives the controller by its own wishes until it burns; no burn within `limit_ns` gives none.
FormationController::Decision first_burn(FormationController* controller,
                                         const RelativeElements& a_roe, std::int64_t from_ns,
                                         std::int64_t limit_ns, std::int64_t* decided_ns) {
  FormationController::Decision decision;
  for (std::int64_t t_ns = from_ns; t_ns < from_ns + limit_ns; t_ns = decision.next_ns) {
    const Matrix6 Phi = state_transition(flight_test::reference_chief(), seconds(t_ns - from_ns));
    decision = controller->decide(known(Phi * a_roe, 0.05, t_ns));
    EXPECT_GT(decision.next_ns, t_ns) << "never busy";
    *decided_ns = t_ns;
    if (decision.burn || decision.next_ns <= t_ns) break;
  }
  return decision;
}

// The thruster needs 20 s of notice; the window opens half the lead ahead, so 30 s is the least.
TEST_F(FormationControllerTest, CommandsTheFirstBurnAheadOfIt) {
  ASSERT_EQ(controller.accept(goal, kEpoch_ns), Acceptance::kAccepted);
  std::int64_t decided_ns = 0;
  const auto decision = first_burn(&controller, roe(0, 0, 0, 300, 0, 300), kEpoch_ns,
                                   kTenRevolutions_ns, &decided_ns);
  ASSERT_TRUE(decision.burn);
  EXPECT_GE(decision.what.t_ns - decided_ns, 29 * kSecond_ns);
  EXPECT_LE(decision.what.t_ns - decided_ns, 61 * kSecond_ns);
  // A quarter of the change: n a (50 m of a*di, 25 m of a*de).
  EXPECT_NEAR(norm(decision.what.dv_RTN), 1.0948e-3 * std::hypot(50, 25), 0.003);
  controller.commanded(decision.what);
  const auto after = controller.decide(known(roe(0, 0, 0, 300, 0, 300), 0.05, decided_ns + 1));
  EXPECT_FALSE(after.burn) << "the filter must see the first burn before the second";
}

TEST_F(FormationControllerTest, AHaltDropsTheGoal) {
  ASSERT_EQ(controller.accept(goal, kEpoch_ns), Acceptance::kAccepted);
  controller.decide(known(roe(0, 0, 0, 300, 0, 300), 0.05));
  controller.halt();
  std::int64_t decided_ns = 0;
  EXPECT_FALSE(
      first_burn(&controller, roe(0, 0, 0, 300, 0, 300), kEpoch_ns, kTenRevolutions_ns, &decided_ns)
          .burn);
  EXPECT_EQ(controller.mode(), Mode::kStandby);
}

TEST_F(FormationControllerTest, KeepingLeavesSmallErrorsAlone) {
  controller.resume(goal);
  const std::int64_t later_ns = goal.end_ns + 1000 * kSecond_ns;
  std::int64_t decided_ns = 0;
  // Within a quarter of an orbit nothing leaves a deadband of 4 m (1 m of a*da, 20 m of a*dl).
  EXPECT_FALSE(
      first_burn(&controller, roe(0.2, 5, 1, 101, 1, 99), later_ns, 1400 * kSecond_ns, &decided_ns)
          .burn);
  EXPECT_EQ(controller.mode(), Mode::kKeeping);
  const auto decision =
      first_burn(&controller, roe(0, 0, 0, 110, 0, 100), later_ns, 12000 * kSecond_ns, &decided_ns);
  ASSERT_TRUE(decision.burn);
  EXPECT_LT(norm(decision.what.dv_RTN), 1.0948e-3 * 10);
}

}  // namespace
}  // namespace formation_keeping
