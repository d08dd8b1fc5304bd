#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "../flight_test_support.hpp"
#include "rpo_kit/guidance/approach.hpp"
#include "rpo_kit/guidance/sun_angle.hpp"

namespace rpo_kit {
namespace {

using namespace flight_support;
using flight_test::kEpoch_ns;
using flight_test::Noise;

constexpr double kRevolution_s = 5740.0;

// Two orbits of an oblate Earth, numerically; the chaser burns with 2 % and 1 deg of error.
class ApproachScene {
 public:
  explicit ApproachScene(const RelativeElements& a_roe, std::uint64_t seed = 1) : noise_(seed) {
    const OrbitElements target = flight_test::reference_chief();
    target_ = flight_test::state_of_mean(target);
    chaser_ = flight_test::state_of_mean(apply_relative_elements(target, a_roe));
  }
  void run_to(std::int64_t t_ns) {
    while (t_ns_ < t_ns) {
      const std::int64_t step_ns = std::min<std::int64_t>(t_ns - t_ns_, 30 * kSecond_ns);
      target_ = flight_test::propagate_oblate(target_, seconds(step_ns));
      chaser_ = flight_test::propagate_oblate(chaser_, seconds(step_ns));
      t_ns_ += step_ns;
      nearest_m_ = std::min(nearest_m_, range_m());
    }
  }
  void burn(const Burn& burn) {
    run_to(burn.t_ns);
    const Vec3 aside = noise_.normal3(0.0175 * norm(burn.dv_RTN));
    const Vec3 executed = (1.0 + 0.02 * noise_.normal()) * burn.dv_RTN + aside;
    chaser_.v_ECI = chaser_.v_ECI + transpose(eci_to_rtn(chaser_)) * executed;
  }
  RelativeOrbit now() const {
    const OrbitElements target = flight_test::mean_of_state(target_);
    return {t_ns_, target, relative_elements(target, flight_test::mean_of_state(chaser_))};
  }
  std::int64_t t_ns() const { return t_ns_; }
  double range_m() const { return norm(chaser_.r_ECI - target_.r_ECI); }
  double nearest_m() const { return nearest_m_; }

 private:
  Noise noise_;
  StateEci target_, chaser_;
  std::int64_t t_ns_ = kEpoch_ns;
  double nearest_m_ = INFINITY;
};

// Until arrival, a decision each minute.
void fly(Approach* approach, ApproachScene* scene, double rev) {
  const Matrix6 covariance = 1e-4 * identity<6>();
  const std::int64_t end_ns = scene->t_ns() + nanoseconds(rev * kRevolution_s);
  while (scene->t_ns() < end_ns && approach->phase() != ApproachPhase::kArrived &&
         approach->phase() != ApproachPhase::kAborted) {
    std::vector<Burn> due;
    const RelativeOrbit now = scene->now();
    for (Burn burn; approach->decide(now, covariance, 120.0, &burn);) due.push_back(burn);
    const std::int64_t next_ns = scene->t_ns() + 60 * kSecond_ns;
    for (const Burn& burn : due) scene->burn(burn);
    scene->run_to(next_ns);
  }
}

// The keep-out sphere is the requirement; 20 m with 25 % of tolerance and J2 over the last
// revolution leave 14 m. Costs: the bound for the whole way is 0.16 m/s for the vectors and twice
// the drift of every leg, 0.44 m/s; three or four legs are flown again. Observed 0.92 to 0.93 m/s.
TEST(ApproachTest, ThirtyKilometresToTwentyMetresOutsideTheKeepOutSphere) {
  for (std::uint64_t seed : {1, 2, 3}) {
    ApproachScene scene(safe_orbit(-30000, 300, 1.2), seed);
    Approach approach;
    fly(&approach, &scene, 60.0);
    EXPECT_EQ(approach.phase(), ApproachPhase::kArrived) << seed;
    EXPECT_GT(scene.nearest_m(), 10.0) << seed;
    scene.run_to(scene.t_ns() + nanoseconds(kRevolution_s));
    EXPECT_GT(scene.nearest_m(), 10.0) << seed;
    const RelativeElements a_roe = scene.now().a_roe;
    EXPECT_NEAR(std::hypot(a_roe[kDex], a_roe[kDey]), 20.0, 8.0) << seed;
    EXPECT_NEAR(std::hypot(a_roe[kDix], a_roe[kDiy]), 20.0, 8.0) << seed;
    EXPECT_LT(approach.delta_v_mps(), 1.0) << seed;
    RecordProperty("delta_v_mps_" + std::to_string(seed), std::to_string(approach.delta_v_mps()));
    RecordProperty("nearest_m_" + std::to_string(seed), std::to_string(scene.nearest_m()));
    RecordProperty("legs_" + std::to_string(seed), approach.legs());
  }
}

// The leg into the inspection orbit with any one burn lost, or all from one on, flown numerically:
// what the plan promises holds. J2 within two revolutions is 0.5 deg of 35 m, errors of execution
// 2 % of 15 m: 1 m.
TEST(TransferTest, LosingBurnsKeepsThePromisedDistance) {
  const RelativeElements start = safe_orbit(-60, 35, 0.4);
  const std::int64_t end_ns = kEpoch_ns + nanoseconds(3 * kRevolution_s);
  Transfer plan;
  ASSERT_TRUE(plan_transfer(ApproachScene(start).now(), safe_orbit(0, 20, 0.4), end_ns, {}, &plan));
  EXPECT_GE(plan.safe_m, 10.0);
  EXPECT_GE(plan.count, 2);
  for (int lost = 0; lost <= plan.count; ++lost) {
    for (bool later_ones : {true, false}) {
      ApproachScene scene(start, static_cast<std::uint64_t>(lost + 1));
      for (int k = 0; k < plan.count; ++k) {
        if (k == lost || (k > lost && !later_ones)) continue;
        scene.burn(plan.burns[k]);
      }
      scene.run_to(end_ns + nanoseconds(2 * kRevolution_s));
      EXPECT_GT(scene.nearest_m(), plan.safe_m - 1.0) << lost << ' ' << later_ones;
    }
  }
}

// Flown without errors a leg ends where it should: first order in a_roe / a leaves 15 km * 2e-3,
// and in a*dl 94 rad a day of that in a*da; observed 0.4 % of the way.
TEST(TransferTest, LegEndsAtItsGoalAndCostsLittleMoreThanTheLeast) {
  ApproachScene scene(safe_orbit(-30000, 300, 1.2));
  const RelativeElements goal = safe_orbit(-15000, 250, 1.1);
  const std::int64_t end_ns = kEpoch_ns + nanoseconds(8 * kRevolution_s);
  Transfer plan;
  ASSERT_TRUE(plan_transfer(scene.now(), goal, end_ns, {}, &plan));
  const double least = least_delta_v_mps(scene.now(), goal, end_ns);
  // Drift has to be begun and ended: twice the bound of a*dl, which counts its rate once.
  EXPECT_GE(plan.delta_v_mps, 0.999 * least);
  EXPECT_LT(plan.delta_v_mps, 2.6 * least);
  StateEci target = flight_test::state_of_mean(flight_test::reference_chief());
  StateEci chaser = flight_test::state_of_mean(
      apply_relative_elements(flight_test::reference_chief(), safe_orbit(-30000, 300, 1.2)));
  std::int64_t t_ns = kEpoch_ns;
  const auto on_to = [&](std::int64_t to_ns) {
    target = flight_test::propagate_oblate(target, seconds(to_ns - t_ns));
    chaser = flight_test::propagate_oblate(chaser, seconds(to_ns - t_ns));
    t_ns = to_ns;
  };
  for (int k = 0; k < plan.count; ++k) {
    on_to(plan.burns[k].t_ns);
    chaser.v_ECI = chaser.v_ECI + transpose(eci_to_rtn(chaser)) * plan.burns[k].dv_RTN;
  }
  on_to(end_ns);
  const RelativeElements miss =
      relative_elements(flight_test::mean_of_state(target), flight_test::mean_of_state(chaser)) -
      goal;
  EXPECT_NEAR(miss[kDl], 0.0, 200.0);
  for (int k : {kDa, kDex, kDey, kDix, kDiy}) EXPECT_NEAR(miss[k], 0.0, 5.0) << k;
  RecordProperty("miss_dl_m", std::to_string(miss[kDl]));
  RecordProperty("cost_over_least", std::to_string(plan.delta_v_mps / least));
}

TEST(TransferTest, NoTimeOrNoSafeWayIsRefused) {
  const RelativeOrbit now = ApproachScene(safe_orbit(-60, 35, 0.4)).now();
  Transfer plan;
  const auto after = [](double rev) { return kEpoch_ns + nanoseconds(rev * kRevolution_s); };
  EXPECT_FALSE(plan_transfer(now, safe_orbit(0, 20, 0.4), after(0.8), {}, &plan));
  EXPECT_FALSE(plan_transfer(now, safe_orbit(0, 5, 0.4), after(3), {}, &plan));
}

// From the middle of every kind of leg, tumbling errors included: out to 200 m, never within 10 m.
TEST(AbortTest, LeadsToASafeEllipseFromAnywhereOnTheWay) {
  for (double rev : {0.3, 9.4, 17.6, 23.4, 30.2, 33.7, 36.2, 36.9}) {
    ApproachScene scene(safe_orbit(-30000, 300, 1.2));
    Approach approach;
    fly(&approach, &scene, rev);
    ASSERT_TRUE(approach.abort(scene.now()));
    const double planned_mps = approach.transfer().delta_v_mps;
    fly(&approach, &scene, 2.0);
    EXPECT_EQ(approach.phase(), ApproachPhase::kAborted) << rev;
    scene.run_to(scene.t_ns() + nanoseconds(10 * kRevolution_s));
    EXPECT_GT(scene.nearest_m(), 10.0) << rev;
    EXPECT_GT(minimum_radial_normal_m(scene.now().a_roe), 150.0) << rev;
    // n a (1 + 1/2) * (200 + 300) m at the most.
    EXPECT_LT(planned_mps, 0.85) << rev;
  }
}

TEST(ApproachTest, WaitsWhileTheEstimateIsNotGoodEnough) {
  ApproachScene scene(safe_orbit(-2100, 150, 1.2));
  Approach approach;
  approach.resume(scene.now());
  EXPECT_EQ(approach.waypoint(), 2);
  Burn burn;
  EXPECT_FALSE(approach.decide(scene.now(), 3600.0 * identity<6>(), 120.0, &burn));
  EXPECT_EQ(approach.phase(), ApproachPhase::kWaiting);
  EXPECT_FALSE(approach.decide(scene.now(), 100.0 * identity<6>(), 120.0, &burn));
  EXPECT_EQ(approach.phase(), ApproachPhase::kLeg);
  approach.hold();
  EXPECT_FALSE(approach.decide(scene.now(), 100.0 * identity<6>(), 1e6, &burn));
}

// Independent errors of equal size in both vectors are the same in every direction across the
// track; J2 over two revolutions changes the radius by less than 0.3 m of 100.
TEST(SafetyMarginTest, IsRadiusLessSigmas) {
  const RelativeOrbit now{kEpoch_ns, flight_test::reference_chief(), safe_orbit(-500, 100, 0.7)};
  Matrix6 P = 16.0 * identity<6>();
  P(kDa, kDa) = 0.0;
  EXPECT_NEAR(uncertain_safe_m(now, Matrix6(), 3.0), 100.0, 0.5);
  EXPECT_NEAR(uncertain_safe_m(now, P, 3.0), 88.0, 0.5);
  EXPECT_EQ(uncertain_safe_m(now, 100.0 * P, 3.0), 0.0);
}

// A cylinder of shadow takes asin(R/a) / pi of an orbit that lies in the plane of the Sun, nothing
// of one across; 120 samples: 0.01.
TEST(SunAngleTest, ShadowTakesItsPartOfTheOrbit) {
  OrbitElements target = flight_test::reference_chief();
  target.ex = target.ey = 0.0;
  const StateEci state = state_from_osculating(target);
  const Vec3 normal = transpose(eci_to_rtn(state)) * vec3(0, 0, 1);
  const Vec3 in_plane = (1.0 / norm(state.r_ECI)) * state.r_ECI;
  const SunAngleOptions all{0.0, kPi, 0.0};
  const RelativeElements behind = safe_orbit(-500, 50, 0.0);
  EXPECT_NEAR(lit_fraction(target, behind, in_plane, all),
              1.0 - std::asin(kRadiusEarth_m / target.a_m) / kPi, 0.01);
  EXPECT_EQ(lit_fraction(target, behind, normal, all), 1.0);
  // Looking along the track with the Sun across it: 90 deg +- atan(50/450) off, seen from the side.
  EXPECT_EQ(lit_fraction(target, behind, normal, {1.4, 1.8, 0.0}), 1.0);
  EXPECT_EQ(lit_fraction(target, behind, normal, {1.8, 3.1, 0.0}), 0.0);
  EXPECT_EQ(lit_fraction(target, behind, normal, {0.0, 1.4, 0.0}), 0.0);
}

TEST(SunAngleTest, InspectionOrbitIsTurnedToTheLight) {
  const OrbitElements target = flight_test::reference_chief();
  const StateEci state = state_from_osculating(target);
  const Vec3 oblique = transpose(eci_to_rtn(state)) * vec3(0.3, 0.5, 0.812);
  const SunAngleOptions options;
  const double phase = best_phase_rad(target, 0.0, 20.0, oblique, options);
  const double best = lit_fraction(target, safe_orbit(0, 20, phase), oblique, options);
  double worst = 1.0;
  for (int k = 0; k < 12; ++k) {
    const double lit = lit_fraction(target, safe_orbit(0, 20, kTwoPi * k / 12), oblique, options);
    EXPECT_LE(lit, best + 0.02);
    worst = std::min(worst, lit);
  }
  EXPECT_GT(best, worst + 0.1);
}

}  // namespace
}  // namespace rpo_kit
