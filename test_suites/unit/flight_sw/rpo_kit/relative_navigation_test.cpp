#include "rpo_kit/fusion/relative_navigation.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "../flight_test_support.hpp"
#include "rpo_kit/guidance/approach.hpp"
#include "rpo_kit/mission/autonomy.hpp"
#include "support/symmetric.hpp"

namespace rpo_kit {
namespace {

using namespace flight_support;
using flight_test::kEpoch_ns;
using flight_test::Noise;

constexpr double kRevolution_s = 5740.0;

// Two orbits of an oblate Earth, numerically, and what sensors tell of them.
class RendezvousScene {
 public:
  RendezvousScene(const RelativeElements& a_roe, std::uint64_t seed) : noise_(seed) {
    const OrbitElements target = flight_test::reference_chief();
    target_ = flight_test::state_of_mean(target);
    chaser_ = flight_test::state_of_mean(apply_relative_elements(target, a_roe));
  }
  void run_to(std::int64_t t_ns) {
    const double dt_s = seconds(t_ns - t_ns_);
    target_ = flight_test::propagate_oblate(target_, dt_s);
    chaser_ = flight_test::propagate_oblate(chaser_, dt_s);
    t_ns_ = t_ns;
    nearest_m_ = std::min(nearest_m_, range_m());
  }
  // 2 % and 0.01 rad of error, as navigation is told.
  void burn(const Vec3& dv_ECI) {
    const Vec3 aside = noise_.normal3(0.01 * norm(dv_ECI));
    chaser_.v_ECI = chaser_.v_ECI + (1.0 + 0.02 * noise_.normal()) * dv_ECI + aside;
  }
  // 1.5 m and 30 mm/s per axis (Table 2 of the paper).
  EciFix own_fix() { return fix(chaser_); }
  EciFix target_fix() { return fix(target_); }
  Bearing bearing() {
    const Vec3 d = target_.r_ECI - chaser_.r_ECI;
    const Vec3 seen = (1.0 / norm(d)) * d + noise_.normal3(1e-4);
    return {t_ns_, (1.0 / norm(seen)) * seen, 1e-4};
  }
  // 0.5 % along and 0.1 % across the line of sight.
  PlaceMeasurement pose() {
    const Vec3 d = target_.r_ECI - chaser_.r_ECI;
    const Vec3 along = (1.0 / norm(d)) * d;
    const double a = 0.005 * norm(d), c = 0.001 * norm(d);
    const Vec3 across = noise_.normal3(c);
    const Vec3 error = across + (a * noise_.normal() - dot(across, along)) * along;
    return {t_ns_, d + error, c * c * identity<3>() + (a * a - c * c) * (along * transpose(along))};
  }
  RelativeElements a_roe() const {
    return relative_elements(flight_test::mean_of_state(target_),
                             flight_test::mean_of_state(chaser_));
  }
  StateEci chaser() const { return chaser_; }
  std::int64_t t_ns() const { return t_ns_; }
  double range_m() const { return norm(chaser_.r_ECI - target_.r_ECI); }
  double nearest_m() const { return nearest_m_; }

 private:
  EciFix fix(const StateEci& state) {
    StateEci seen = state;
    seen.r_ECI = seen.r_ECI + noise_.normal3(1.5);
    seen.v_ECI = seen.v_ECI + noise_.normal3(0.03);
    return {t_ns_, seen, 1.5, 0.03};
  }
  Noise noise_;
  StateEci target_, chaser_;
  std::int64_t t_ns_ = kEpoch_ns;
  double nearest_m_ = INFINITY;
};

struct Tally {
  double nees = 0.0;
  int count = 0;
  double worst_step = 0.0;  // squared, of a correction in the prior's 1-sigma
};

// The cooperative rendezvous of the case study, its last 5 km: GNSS of the target lost for an hour,
// directions all the time, poses below 100 m. Guidance flies on what navigation says.
TEST(RelativeNavigationTest, HandOversNeitherJumpNorLoseConsistency) {
  RendezvousScene scene(safe_orbit(-5500, 150, 1.2), 9);
  RelativeNavigation navigation;
  Approach approach;
  Tally gnss, directions, poses;
  std::vector<std::pair<std::int64_t, Vec3>> burns;  // commanded, still to come
  std::int64_t t_ns = kEpoch_ns;
  const std::int64_t lost_ns = kEpoch_ns + nanoseconds(8 * kRevolution_s);
  bool started = false;
  for (int s = 10; s < static_cast<int>(32 * kRevolution_s); s += 10) {
    const std::int64_t now_ns = kEpoch_ns + s * kSecond_ns;
    while (!burns.empty() && burns.front().first <= now_ns) {
      scene.run_to(burns.front().first);
      scene.burn(burns.front().second);
      burns.erase(burns.begin());
    }
    scene.run_to(t_ns = now_ns);
    const bool outage = t_ns >= lost_ns && t_ns < lost_ns + 3600 * kSecond_ns;
    navigation.own_fix(scene.own_fix());
    if (!outage && s % 20 == 0) navigation.target_fix(scene.target_fix());
    const bool near = scene.range_m() < 100.0;
    if (s % 120 == 0) navigation.bearing(scene.bearing());
    if (near && s % 20 == 10) navigation.pose(scene.pose());

    RelativeOrbit before, after;
    Matrix6 P_before, P;
    const bool had = navigation.at(t_ns, &before, &P_before);
    navigation.process(t_ns);
    if (!navigation.at(t_ns, &after, &P)) continue;
    Tally* tally = near ? &poses : outage ? &directions : &gnss;
    if (had) {
      const double step = squared_mahalanobis(P_before, after.a_roe - before.a_roe);
      tally->worst_step = std::max(tally->worst_step, step);
    }
    if (s < 2000 || s % 60 != 0) continue;
    tally->nees += squared_mahalanobis(P, after.a_roe - scene.a_roe());
    ++tally->count;
    if (!started) approach.resume(after), started = true;
    Burn burn;
    if (!approach.decide(after, P, 120.0, &burn)) continue;
    Observer own;
    ASSERT_TRUE(navigation.own_at(burn.t_ns, &own));
    const Mat3 R_HI = eci_to_rtn(state_from_osculating(osculating_from_mean(own.mean)));
    const Vec3 dv_ECI = transpose(R_HI) * burn.dv_RTN;
    navigation.burn(burn.t_ns, dv_ECI);
    burns.push_back({burn.t_ns, dv_ECI});
  }
  EXPECT_EQ(approach.phase(), ApproachPhase::kArrived);
  EXPECT_GT(scene.nearest_m(), 10.0);
  EXPECT_LT(scene.range_m(), 60.0);
  for (const Tally* tally : {&gnss, &directions, &poses}) {
    ASSERT_GT(tally->count, 20);
    // Six states; samples of one run repeat each other, over an hour to a few independent ones.
    EXPECT_GT(tally->nees / tally->count, 1.5);
    EXPECT_LT(tally->nees / tally->count, 14.0);
    // A correction has at most the prior's covariance: 1e-6 of chi-square with 6 degrees of
    // freedom is 38, and thousands are looked at.
    EXPECT_LT(tally->worst_step, 38.0);
  }
  EXPECT_GT(navigation.used(Source::kGnss), 1000);
  EXPECT_GT(navigation.used(Source::kBearing), 500);
  EXPECT_GT(navigation.used(Source::kPose), 100);
  EXPECT_EQ(navigation.restarts(), 0);
  RecordProperty("nees_gnss", std::to_string(gnss.nees / gnss.count));
  RecordProperty("nees_directions", std::to_string(directions.nees / directions.count));
  RecordProperty("nees_poses", std::to_string(poses.nees / poses.count));
  RecordProperty(
      "worst_step",
      std::to_string(std::max({gnss.worst_step, directions.worst_step, poses.worst_step})));
  RecordProperty("nearest_m", std::to_string(scene.nearest_m()));
}

// A crosslink that delays and reorders within the lag gives the same estimate, to the bit.
TEST(RelativeNavigationTest, OrderOfArrivalDoesNotMatterWithinTheLag) {
  RelativeElements result[2];
  for (int late : {0, 1}) {
    RendezvousScene scene(safe_orbit(-2000, 150, 1.2), 4);
    RelativeNavigation navigation;
    std::vector<EciFix> held;
    for (int s = 10; s <= 1000; s += 10) {
      scene.run_to(kEpoch_ns + s * kSecond_ns);
      navigation.own_fix(scene.own_fix());
      held.push_back(scene.target_fix());
      if (late == 0 || held.size() == 2) {
        while (!held.empty()) {
          navigation.target_fix(held.back());
          held.pop_back();
        }
      }
      navigation.process(scene.t_ns());
    }
    RelativeOrbit now;
    Matrix6 P;
    ASSERT_TRUE(navigation.at(scene.t_ns(), &now, &P));
    EXPECT_EQ(navigation.dropped(), 0);
    result[late] = now.a_roe;
  }
  for (int k = 0; k < 6; ++k) EXPECT_EQ(result[0][k], result[1][k]) << k;
}

TEST(RelativeNavigationTest, WhatIsTooLateOrUnpairedIsDroppedAndNothingIsKnownWithoutSensors) {
  RendezvousScene scene(safe_orbit(-2000, 150, 1.2), 4);
  RelativeNavigation navigation;
  RelativeOrbit now;
  Matrix6 P;
  Observer own;
  EXPECT_FALSE(navigation.at(kEpoch_ns, &now, &P));
  EXPECT_FALSE(navigation.own_at(kEpoch_ns, &own));
  scene.run_to(kEpoch_ns + 10 * kSecond_ns);
  const EciFix old = scene.target_fix();
  navigation.own_fix(scene.own_fix());
  scene.run_to(kEpoch_ns + 30 * kSecond_ns);
  navigation.target_fix(scene.target_fix());  // 20 s after the own fix
  navigation.process(kEpoch_ns + 100 * kSecond_ns);
  EXPECT_EQ(navigation.dropped(), 1);
  navigation.target_fix(old);
  EXPECT_EQ(navigation.dropped(), 2);
  EXPECT_FALSE(navigation.started());
  // With a pair there is an estimate, for an hour.
  scene.run_to(kEpoch_ns + 200 * kSecond_ns);
  navigation.own_fix(scene.own_fix());
  navigation.target_fix(scene.target_fix());
  navigation.process(kEpoch_ns + 300 * kSecond_ns);
  EXPECT_TRUE(navigation.at(kEpoch_ns + 3000 * kSecond_ns, &now, &P));
  EXPECT_FALSE(navigation.at(kEpoch_ns + 4000 * kSecond_ns, &now, &P));
}

// Directions alone, through the class: it collects, solves and follows.
TEST(RelativeNavigationTest, StartsFromDirectionsAlone) {
  RendezvousScene scene(flight_test::roe(20, -20000, 100, 400, 0, 300), 5);
  RelativeNavigation navigation;
  bool burnt = false;
  for (int s = 60; s <= 16000; s += 60) {
    scene.run_to(kEpoch_ns + s * kSecond_ns);
    navigation.own_fix(scene.own_fix());
    navigation.bearing(scene.bearing());
    if (s == 3000) {
      const StateEci state = scene.chaser();
      const Vec3 dv = (0.06 / norm(state.v_ECI)) * (-1.0 * state.v_ECI);
      navigation.burn(scene.t_ns() + 1, dv);
      scene.burn(dv);
      burnt = true;
    }
    navigation.process(scene.t_ns());
  }
  ASSERT_TRUE(burnt && navigation.started());
  RelativeOrbit now;
  Matrix6 P;
  ASSERT_TRUE(navigation.at(scene.t_ns(), &now, &P));
  const RelativeElements truth = scene.a_roe();
  // A burn known to 2 % shows the range to about that.
  EXPECT_NEAR(now.a_roe[kDl] / truth[kDl], 1.0, 0.06);
  EXPECT_LT(std::fabs(now.a_roe[kDl] - truth[kDl]), 4.0 * std::sqrt(P(kDl, kDl)));
  EXPECT_LT(std::sqrt(P(kDl, kDl)), 0.05 * std::fabs(truth[kDl]));
}

Situation fine(int s) {
  Situation now;
  now.t_ns = kEpoch_ns + s * kSecond_ns;
  now.estimate = true;
  now.range_m = 1000.0;
  now.range_sigma_m = 10.0;
  now.safe_m = 100.0;
  return now;
}

TEST(AutonomyTest, GoesToTheTargetAndInspects) {
  Autonomy autonomy;
  EXPECT_EQ(autonomy.decide(fine(0), Order::kNone), Mode::kStandby);
  EXPECT_EQ(autonomy.decide(fine(30), Order::kGo), Mode::kAcquiring);
  for (int s : {60, 90}) EXPECT_EQ(autonomy.decide(fine(s), Order::kNone), Mode::kAcquiring);
  EXPECT_EQ(autonomy.decide(fine(120), Order::kNone), Mode::kApproaching);
  Situation arrived = fine(150);
  arrived.arrived = true;
  EXPECT_EQ(autonomy.decide(arrived, Order::kNone), Mode::kInspecting);
  EXPECT_EQ(autonomy.decide(fine(180), Order::kNone), Mode::kApproaching);
}

TEST(AutonomyTest, HoldsWithoutTargetAndGoesOnWhenItIsFoundAgain) {
  Autonomy autonomy;
  int s = 0;
  const auto next = [&](bool estimate, Order order = Order::kNone) {
    Situation now = fine(s += 30);
    now.estimate = estimate;
    return autonomy.decide(now, order);
  };
  next(true, Order::kGo);
  for (int k = 0; k < 3; ++k) next(true);
  ASSERT_EQ(autonomy.mode(), Mode::kApproaching);
  EXPECT_EQ(next(false), Mode::kHolding);
  EXPECT_STREQ(autonomy.reason(), "target lost");
  EXPECT_EQ(next(true), Mode::kHolding);
  EXPECT_EQ(next(false), Mode::kHolding);  // three in a row, not three in all
  next(true), next(true);
  EXPECT_EQ(next(true), Mode::kApproaching);
  EXPECT_EQ(next(true, Order::kHold), Mode::kHolding);
  for (int k = 0; k < 10; ++k) EXPECT_EQ(next(true), Mode::kHolding);
  next(true, Order::kGo);
  EXPECT_EQ(autonomy.mode(), Mode::kApproaching);
  next(false);
  s += 50000;
  EXPECT_EQ(next(false), Mode::kSafe);
  EXPECT_EQ(next(true), Mode::kSafe);
  EXPECT_EQ(next(true, Order::kGo), Mode::kAcquiring);
}

TEST(AutonomyTest, AbortsWhenUnsafeThreeTimesOrCommanded) {
  for (bool commanded : {false, true}) {
    Autonomy autonomy;
    int s = 0;
    for (int k = 0; k < 4; ++k) autonomy.decide(fine(s += 30), k == 0 ? Order::kGo : Order::kNone);
    ASSERT_EQ(autonomy.mode(), Mode::kApproaching);
    Situation unsafe = fine(s += 30);
    unsafe.safe_m = 5.0;
    if (commanded) {
      EXPECT_EQ(autonomy.decide(fine(s), Order::kAbort), Mode::kAborting);
    } else {
      EXPECT_EQ(autonomy.decide(unsafe, Order::kNone), Mode::kApproaching);
      EXPECT_EQ(autonomy.decide(unsafe, Order::kNone), Mode::kApproaching);
      EXPECT_EQ(autonomy.decide(unsafe, Order::kNone), Mode::kAborting);
    }
    EXPECT_EQ(autonomy.decide(fine(s += 30), Order::kGo), Mode::kAborting);
    Situation done = fine(s += 30);
    done.aborted = true;
    EXPECT_EQ(autonomy.decide(done, Order::kNone), Mode::kSafe);
  }
}

}  // namespace
}  // namespace rpo_kit
