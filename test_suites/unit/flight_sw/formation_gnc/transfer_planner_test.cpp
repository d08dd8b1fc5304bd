#include <gtest/gtest.h>

#include "../flight_test_support.hpp"
#include "formation_gnc/control/reconfiguration_planner.hpp"
#include "formation_gnc/control/science_orbit.hpp"
#include "formation_gnc/control/sun_direction.hpp"

namespace formation_gnc {
namespace {

using namespace flight_support;
using flight_test::kEpoch_ns;
using flight_test::roe;

constexpr double kDegree_rad = kPi / 180.0;
constexpr std::int64_t kHour_ns = 3600 * kSecond_ns;

// The chief of `visors_like`: RAAN 45 deg west of the Sun.
OrbitElements visors_chief() {
  OrbitElements chief = flight_test::reference_chief();
  const Vec3 sun = sun_direction_EME2000(kEpoch_ns);
  chief.raan_rad = wrap_two_pi(std::atan2(sun[1], sun[0]) - 45.0 * kDegree_rad);
  return chief;
}

// Both above an oblate Earth, propagated in Cartesian coordinates, with an acceleration of the
// deputy along its velocity.
struct Flown {
  StateEci chief, deputy;
  std::int64_t t_ns;

  explicit Flown(const RelativeOrbit& at)
      : chief(flight_test::state_of_mean(at.chief)),
        deputy(flight_test::state_of_mean(apply_relative_elements(at.chief, at.a_roe))),
        t_ns(at.t_ns) {}
  void coast_to(std::int64_t until_ns, double drag_mps2 = 0.0) {
    while (t_ns < until_ns) {
      const std::int64_t next_ns =
          drag_mps2 == 0.0 ? until_ns : std::min(until_ns, t_ns + 20 * kSecond_ns);
      const double dt_s = seconds(next_ns - t_ns);
      const auto kick = [&] {
        deputy.v_ECI = deputy.v_ECI + (0.5 * dt_s * drag_mps2 / norm(deputy.v_ECI)) * deputy.v_ECI;
      };
      kick();
      chief = flight_test::propagate_oblate(chief, dt_s);
      deputy = flight_test::propagate_oblate(deputy, dt_s);
      kick();
      t_ns = next_ns;
    }
  }
  void fly(const std::vector<Burn>& burns) {
    for (const Burn& burn : burns) {
      coast_to(burn.t_ns);
      deputy.v_ECI = deputy.v_ECI + transpose(eci_to_rtn(deputy)) * burn.dv_RTN;
    }
  }
  RelativeElements a_roe() const {
    return relative_elements(flight_test::mean_of_state(chief), flight_test::mean_of_state(deputy));
  }
};

// Standby to science in 20 h: the transfer of the case study.
struct TransferPlannerTest : testing::Test {
  TransferPlannerTest() {
    start.orbit = {kEpoch_ns, visors_chief(), roe(0, 0, 0, -200, 0, -200)};
    const Vec3 sun = sun_direction_EME2000(kEpoch_ns + 20 * kHour_ns);
    goal.end_ns =
        observation_epoch_ns(start.orbit.chief, kEpoch_ns, sun, kEpoch_ns + 19 * kHour_ns);
    const OrbitElements then = propagate_mean(start.orbit.chief, seconds(goal.end_ns - kEpoch_ns));
    goal.a_roe = science_elements(then, sun, 40.0);
    options.last_ns = goal.end_ns - kHour_ns;
  }
  TransferPlan plan() const { return ReconfigurationPlanner(options).plan(start, goal); }

  void expect_within_limits(const TransferPlan& plan) const {
    for (std::size_t k = 0; k < plan.burns.size(); ++k) {
      const double size_mps = norm(plan.burns[k].dv_RTN);
      EXPECT_LE(size_mps, options.limits.max_mps * (1.0 + 1e-6));
      EXPECT_GE(size_mps, options.limits.min_mps);
      EXPECT_LE(plan.burns[k].t_ns, options.last_ns);
      if (k == 0) continue;
      EXPECT_GE(plan.burns[k].t_ns - plan.burns[k - 1].t_ns, nanoseconds(options.limits.spacing_s));
    }
  }

  TransferStart start;
  TransferGoal goal;
  TransferOptions options;
};

// The guide's section 6: a*da = 0, a*de = T (sin u, -cos u), a*di = N (sin u, -cos u), a*dl = -T.
// J2 adds its short-period differences, 40 m * 1e-3 of each.
TEST_F(TransferPlannerTest, ScienceOrbitIsTheOneOfTheGuide) {
  const OrbitElements then = propagate_mean(start.orbit.chief, seconds(goal.end_ns - kEpoch_ns));
  const StateEci chief = flight_test::state_of_mean(then);
  const Vec3 sun_RTN = eci_to_rtn(chief) * sun_direction_EME2000(kEpoch_ns + 20 * kHour_ns);
  EXPECT_NEAR(sun_RTN[0], 0.0, 1e-6);
  EXPECT_GT(chief.v_ECI[2], 0.0);
  const double u = true_argument_of_latitude_rad(then);
  EXPECT_NEAR(u / kDegree_rad, 82.0, 2.0);
  const double T = 40.0 * sun_RTN[1], N = 40.0 * sun_RTN[2];
  EXPECT_NEAR(T * T + N * N, 1600.0, 1e-3);
  const double s = std::sin(u), c = std::cos(u);
  const RelativeElements expected = roe(0, -T, T * s, -T * c, N * s, -N * c);
  for (int k = 0; k < 6; ++k) EXPECT_NEAR(goal.a_roe[k], expected[k], 0.15) << k;
  EXPECT_NEAR(minimum_radial_normal_m(goal.a_roe), std::fmin(std::fabs(T), std::fabs(N)), 0.5);
}

// The guide gives 0.326 m/s for bound_sep, n a (|ddi| + |dde|/2), of changes by 198.5 m; here they
// are 204.4 and 205.6 m, which makes 0.337. Burns of 3 mm/s spread over arcs of 15 deg to each side
// of the phase, on average 1 % less than at it. Observed 0.2553 m/s, between joint 0.2519 and 1.2 *
// 0.3369, with 89 burns.
TEST_F(TransferPlannerTest, StandbyToScienceCostsWhatItMust) {
  const TransferPlan planned = plan();
  ASSERT_EQ(planned.status, PlanStatus::kPlanned) << to_string(planned.status);
  const DeltaVBounds bounds = delta_v_bounds(start, goal, options);
  RecordProperty("delta_v_mps", std::to_string(planned.delta_v_mps));
  RecordProperty("joint_mps", std::to_string(bounds.joint_mps));
  RecordProperty("separate_mps", std::to_string(bounds.separate_mps));
  EXPECT_GE(planned.delta_v_mps, bounds.joint_mps * (1.0 - 1e-6));
  EXPECT_LE(planned.delta_v_mps, 1.03 * bounds.joint_mps);
  // Changes in parallel, by one vector at one phase: n a (|ddi|^2 + |dde|^2/4)^(1/2).
  EXPECT_NEAR(bounds.joint_mps, bounds.separate_mps * std::sqrt(1.25) / 1.5, 2e-3);
  EXPECT_LT(bounds.separate_mps, 1.2 * 0.326);
  expect_within_limits(planned);
  for (int k = 0; k < 6; ++k) EXPECT_NEAR(planned.miss[k], 0.0, 1e-3) << k;
}

// The model is linear in 200 m out of 6928 km (3e-5 of it, 10 mm) and of first order in e (1e-3 of
// a burn's effect). a*dl sums up errors of a*da of centimetres over 13 revolutions, 9.4 m per metre
// and revolution. Observed 0.02 m in a*da, 1.2 m in a*dl, 0.23 m in a*di.
TEST_F(TransferPlannerTest, StandbyToScienceArrivesAboveAnOblateEarth) {
  const TransferPlan planned = plan();
  ASSERT_TRUE(planned.usable());
  Flown flown(start.orbit);
  flown.fly(planned.burns);
  flown.coast_to(goal.end_ns);
  const RelativeElements found = flown.a_roe();
  for (int k = 0; k < 6; ++k) {
    RecordProperty("miss_" + std::to_string(k), std::to_string(found[k] - goal.a_roe[k]));
  }
  EXPECT_NEAR(found[kDa], goal.a_roe[kDa], 0.05);
  EXPECT_NEAR(found[kDl], goal.a_roe[kDl], 3.0);
  for (int k = kDex; k <= kDiy; ++k) EXPECT_NEAR(found[k], goal.a_roe[k], 0.4) << k;
}

// Radial and cross-track distance on the way, sampled in the Cartesian truth: never below what the
// plan says of itself, which counts lost burns, too. Observed 18.5 m, said 16.2 m; the science
// orbit itself has 27.0 m, and a*da of 8 m at the end of an arc takes its part of that.
TEST_F(TransferPlannerTest, StandbyToScienceKeepsItsDistance) {
  const TransferPlan planned = plan();
  ASSERT_TRUE(planned.usable());
  EXPECT_GT(planned.safe_distance_m, 12.0);
  Flown flown(start.orbit);
  double least_m = INFINITY;
  std::size_t next = 0;
  for (std::int64_t t_ns = kEpoch_ns; t_ns < goal.end_ns; t_ns += 60 * kSecond_ns) {
    std::vector<Burn> due;
    while (next < planned.burns.size() && planned.burns[next].t_ns <= t_ns) {
      due.push_back(planned.burns[next++]);
    }
    flown.fly(due);
    flown.coast_to(t_ns);
    const Vec3 r = relative_state_rtn(flown.chief, flown.deputy).r_DC_RTN;
    least_m = std::fmin(least_m, std::hypot(r[0], r[2]));
  }
  RecordProperty("least_m", std::to_string(least_m));
  EXPECT_GT(least_m, planned.safe_distance_m - 0.2) << planned.safe_distance_m;
}

// e and i vectors stay parallel: at every burn of the plan, by the model.
TEST_F(TransferPlannerTest, StandbyToScienceKeepsVectorsParallel) {
  const TransferPlan planned = plan();
  ASSERT_TRUE(planned.usable());
  RelativeOrbit at = start.orbit;
  double worst_rad = 0.0;
  for (const Burn& burn : planned.burns) {
    const double dt_s = seconds(burn.t_ns - at.t_ns);
    at.a_roe = state_transition(at.chief, dt_s) * at.a_roe;
    at.chief = propagate_mean(at.chief, dt_s);
    at.t_ns = burn.t_ns;
    at.a_roe = at.a_roe + control_input(at.chief) * burn.dv_RTN;
    const double apart_rad =
        std::atan2(at.a_roe[kDey], at.a_roe[kDex]) - std::atan2(at.a_roe[kDiy], at.a_roe[kDix]);
    worst_rad = std::fmax(worst_rad, std::fabs(wrap_pi(apart_rad)));
  }
  // Near the end a burn moves vectors of 28 m by 2.5 m; along them, but for the arc. Observed 2.1
  // deg.
  RecordProperty("worst_deg", std::to_string(worst_rad / kDegree_rad));
  EXPECT_LT(worst_rad, 5.0 * kDegree_rad) << worst_rad / kDegree_rad;
}

// The loop closed: ROE 5 m off (1 sigma; a*da 0.3 m, or the drift alone would be 200 m), a thruster
// with its errors, planned anew every two hours and at last half an orbit before the end. What is
// left at the observation is for the trims, which take 1 m easily. Observed 0.275 m/s on average.
TEST_F(TransferPlannerTest, PlanningAnewTakesOutDispersions) {
  const DeltaVBounds bounds = delta_v_bounds(start, goal, options);
  const Vec3 sun = sun_direction_EME2000(goal.end_ns);
  const int seeds = 5;
  double sum_mps = 0.0;
  for (int seed = 1; seed <= seeds; ++seed) {
    flight_test::Noise noise(static_cast<std::uint64_t>(seed));
    const double scale = 1.0 + 0.02 * noise.normal();
    const Vec3 tilt = noise.normal3(8.7e-3);
    RelativeOrbit orbit = start.orbit;
    for (int k = 0; k < 6; ++k) orbit.a_roe[k] += (k == kDa ? 0.3 : 5.0) * noise.normal();
    Flown flown(orbit);
    while (flown.t_ns < options.last_ns - 600 * kSecond_ns) {
      TransferStart now;
      now.orbit = {flown.t_ns, flight_test::mean_of_state(flown.chief), flown.a_roe()};
      const TransferPlan planned = ReconfigurationPlanner(options).plan(now, goal);
      ASSERT_EQ(planned.status, PlanStatus::kPlanned) << seed << to_string(planned.status);
      const double left_s = seconds(options.last_ns - flown.t_ns);
      const std::int64_t until_ns =
          std::min(options.last_ns, flown.t_ns + (left_s < 9000.0 ? 2870 : 7200) * kSecond_ns);
      for (const Burn& burn : planned.burns) {
        if (burn.t_ns > until_ns) break;
        const double size = scale * (1.0 + 0.01 * noise.normal());
        sum_mps += size * norm(burn.dv_RTN);
        flown.fly({{burn.t_ns, size * (burn.dv_RTN + cross(tilt, burn.dv_RTN))}});
      }
      flown.coast_to(until_ns);
    }
    flown.coast_to(goal.end_ns);
    EXPECT_LT(norm(flown.deputy.r_ECI - flown.chief.r_ECI - 40.0 * sun), 3.0) << seed;
  }
  RecordProperty("mean_mps", std::to_string(sum_mps / seeds));
  EXPECT_GE(sum_mps / seeds, bounds.joint_mps);
  EXPECT_LE(sum_mps / seeds, 1.2 * 0.326);
}

TEST_F(TransferPlannerTest, FallbackArrivesToo) {
  options.use_cone_program = false;
  const TransferPlan planned = plan();
  ASSERT_EQ(planned.status, PlanStatus::kFallback) << to_string(planned.status);
  const DeltaVBounds bounds = delta_v_bounds(start, goal, options);
  EXPECT_GE(planned.delta_v_mps, bounds.joint_mps * (1.0 - 1e-6));
  EXPECT_LE(planned.delta_v_mps, 1.2 * bounds.separate_mps);  // observed 0.2576 m/s
  expect_within_limits(planned);
  for (int k = 0; k < 6; ++k) EXPECT_NEAR(planned.miss[k], 0.0, 0.05) << k;
}

// Phases on both sides of +-180 deg, where atan2 jumps; and apart, where one burn cannot serve
// both.
TEST_F(TransferPlannerTest, PlansAtEveryPhase) {
  goal.end_ns = kEpoch_ns + 10 * kHour_ns;
  options.last_ns = 0;
  for (const double apart_deg : {0.0, 40.0}) {
    for (const double phase_deg : {-180.0, -179.9, -90.0, -0.1, 0.0, 0.1, 63.0, 179.9, 180.0}) {
      const double e = phase_deg * kDegree_rad, i = (phase_deg + apart_deg) * kDegree_rad;
      start.orbit.a_roe =
          roe(0, 0, 150 * std::cos(e), 150 * std::sin(e), 150 * std::cos(i), 150 * std::sin(i));
      goal.a_roe =
          roe(0, 0, 80 * std::cos(e), 80 * std::sin(e), 80 * std::cos(i), 80 * std::sin(i));
      const DeltaVBounds bounds = delta_v_bounds(start, goal, options);
      for (const bool use_cone_program : {true, false}) {
        SCOPED_TRACE(testing::Message()
                     << phase_deg << " " << apart_deg << " " << use_cone_program);
        options.use_cone_program = use_cone_program;
        const TransferPlan planned = plan();
        ASSERT_TRUE(planned.usable()) << to_string(planned.status);
        EXPECT_EQ(planned.status == PlanStatus::kPlanned, use_cone_program);
        EXPECT_GE(planned.delta_v_mps, bounds.joint_mps * (1.0 - 1e-6));
        EXPECT_LE(planned.delta_v_mps, 1.2 * bounds.separate_mps);
      }
    }
  }
}

// The first flight's reconfiguration, 300 -> 100 m: max rule 0.219, joint 0.245, separate 0.328 m/s
// (guide). J2 turns the vectors meanwhile, hence 2 %.
TEST_F(TransferPlannerTest, BoundsAreThoseOfTheGuide) {
  start.orbit.a_roe = roe(0, 0, 0, 300, 0, 300);
  goal.a_roe = roe(0, 0, 0, 100, 0, 100);
  goal.end_ns = kEpoch_ns + 6 * kHour_ns;
  options.last_ns = 0;
  const DeltaVBounds bounds = delta_v_bounds(start, goal, options);
  EXPECT_NEAR(bounds.joint_mps, 0.245, 0.005);
  EXPECT_NEAR(bounds.separate_mps, 0.328, 0.005);
}

// A steady along-track acceleration of the deputy, as of differential drag: the seventh state. da =
// 2 t f / n. Against a Cartesian propagation; the rest is the model's 1e-3 of a*dl.
TEST_F(TransferPlannerTest, DifferentialDragDriftsAsSaid) {
  const double f = -2e-9, n = mean_motion_radps(start.orbit.chief.a_m);
  start.a_da_rate_mps = 2.0 * f / n;
  const std::int64_t t_ns = kEpoch_ns + 6 * kHour_ns;
  Flown flown(start.orbit);
  flown.coast_to(t_ns, f);
  const RelativeElements found = flown.a_roe(), said = coast(start, t_ns);
  EXPECT_NEAR(said[kDa], -0.0789, 1e-4);  // 2 * 2e-9 * 21600 / 1.0948e-3
  EXPECT_NEAR(found[kDa], said[kDa], 0.004);
  EXPECT_NEAR(found[kDl] - start.orbit.a_roe[kDl], said[kDl] - start.orbit.a_roe[kDl], 0.1);
  EXPECT_GT(said[kDl] - (state_transition(start.orbit.chief, 21600.0) * start.orbit.a_roe)[kDl],
            1.3);  // 3/4 n rate t^2
}

TEST_F(TransferPlannerTest, SaysWhyItCannot) {
  options.budget_mps = 0.2;
  EXPECT_EQ(plan().status, PlanStatus::kOverBudget);
  options.budget_mps = 1.0;
  options.limits.max_mps = 1e-4;
  EXPECT_EQ(plan().status, PlanStatus::kInfeasible);
  options.limits.max_mps = 0.003;
  options.min_radial_normal_m = 25.0;  // both ends have more, but not with a burn lost
  EXPECT_EQ(plan().status, PlanStatus::kUnsafe);
  options.min_radial_normal_m = 10.0;
  goal.a_roe[kDex] = NAN;
  EXPECT_EQ(plan().status, PlanStatus::kBadInput);
  goal.a_roe[kDex] = 0.0;
  options.first_ns = goal.end_ns;
  EXPECT_EQ(plan().status, PlanStatus::kBadInput);
}

}  // namespace
}  // namespace formation_gnc
