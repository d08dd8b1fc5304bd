// Accuracy and honesty of navigation against the truth models: orbits under all forces of Table 1,
// receivers' bytes, 17 % of the companion's epochs lost.
#include <gtest/gtest.h>

#include "navigation_flight.hpp"

namespace orrery {
namespace {

using namespace navigation_flight;

// Property (figure 23): relative navigation is below 1 cm within 10 min of the start, and
// after 30 min at 5 mm and 0.04 mm/s (3D RMS); no wrong integer; normalised errors and innovations
// are honest. All noise, losses, and the slew with a crosslink blackout of 5 min. Seen over seeds 1
// to 20: first fix 140 to 200 s, 1.0 to 1.7 mm, 0.0015 to 0.0025 mm/s, worst 4.6 mm; normalised
// errors 0.7, innovations 0.97 to 1.01, absolute 0.9 to 2 m.
TEST(NavigationTest, IsAccurateAndHonest) {
  double squares[6] = {};
  int n = 0, beyond_four_sigma = 0;
  const std::uint64_t runs = number_from("ORRERY_RUNS", 3);
  for (std::uint64_t seed = first_seed(); seed < first_seed() + runs; ++seed) {
    FlightOptions o{.scene = {.seed = seed, .slew = true}, .duration = 60min};
    o.at_epoch = [](SimTime t, NavigationScene&, Link& link, Navigation&) {
      const Duration since = t - NavigationScene::start();
      link.dark = since >= 2296s && since < 2296s + 5min;
    };
    const Flight flight(o);
    EXPECT_EQ(flight.wrong, 0) << seed;
    EXPECT_TRUE(flight.estimates[60].fixed) << seed;
    EXPECT_LT(flight.worst(&Errors::r_m, 60, static_cast<int>(flight.errors.size())), 0.01) << seed;
    EXPECT_LT(flight.rms(&Errors::r_m, 180), 5e-3) << seed;
    EXPECT_LT(flight.rms(&Errors::v_mps, 180), 4e-5) << seed;
    EXPECT_LT(flight.rms(&Errors::absolute_m, 180), 4) << seed;
    EXPECT_NEAR(flight.chi2 / flight.innovations, 1, 0.1) << seed;
    // 95 %, 270 epochs: 2 sigmas below, of many seeds 4.
    EXPECT_GT(flight.inside, (runs < 20 ? 0.92 : 0.897) * flight.judged) << seed;
    EXPECT_LT(flight.rejected, 5) << seed;
    for (std::size_t k = 60; k < flight.errors.size(); ++k) {
      for (int axis = 0; axis < 6; ++axis) {
        const double x = flight.errors[k].normalised[axis];
        squares[axis] += x * x;
        beyond_four_sigma += std::abs(x) > 4;
      }
      ++n;
    }
  }
  for (double sum : squares) {
    EXPECT_GT(std::sqrt(sum / n), runs < 20 ? 0.5 : 0.6);  // an hour of three seeds is few
    EXPECT_LT(std::sqrt(sum / n), 1.4);
  }
  EXPECT_LT(beyond_four_sigma, 0.01 * 6 * n);
}

// a*da of the truth, mean, over whole revolutions: what is left is d(a*da)/dt = 2 a_T / n.
double mean_da_m(const NavigationScene::Epoch& e) {
  QuasiNonsingularElements mean[2];
  for (int k = 0; k < 2; ++k) {
    mean[k] = osculating_to_mean(to_quasi_nonsingular({e.truth[k].r_ECI, e.truth[k].v_ECI}));
  }
  return mean[0].a_m * relative_elements(mean[0], mean[1]).da;
}

// Property: a drag coefficient 7 % larger, 7.0e-9 m/s^2 over an orbit of the truth, is found within
// one to what the filter says it knows (mean of the second; drag itself varies by its half over an
// orbit): 3.8e-9 m/s^2, less than half of what it takes drag to differ by.
TEST(NavigationTest, FindsDifferentialDrag) {
  NavigationScene scene({.seed = first_seed(), .drag_difference = 0.07});
  Navigation navigation;
  constexpr int kOrbit = 574;  // epochs
  double found_mps2 = 0, sigma_mps2 = 0, da_m[2] = {};
  for (int k = 0; k <= 2 * kOrbit; ++k) {
    const Epoch e = scene.next();
    give_own(e, &navigation);
    navigation.remote_epoch(*e.measured[1], e.q_BI[1]);
    if (k == kOrbit) da_m[0] = mean_da_m(e);
    if (k == 2 * kOrbit) da_m[1] = mean_da_m(e);
    if (k <= kOrbit) continue;
    const auto estimate = navigation.at(e.t_ns);
    found_mps2 += estimate.drag_difference_mps2 / kOrbit;
    sigma_mps2 = estimate.sigma_drag_difference_mps2;
  }
  const double n = std::sqrt(3.986004415e14 / std::pow(6928137, 3)), span_s = 10.0 * kOrbit;
  const double true_mps2 = n / 2 * (da_m[1] - da_m[0]) / span_s;
  EXPECT_LT(true_mps2, -4e-9);
  EXPECT_LT(found_mps2, 0.75 * true_mps2);
  EXPECT_NEAR(found_mps2, true_mps2, sigma_mps2);
  EXPECT_LT(sigma_mps2, 4.3e-9);
}

// Property: a blackout of 5 min costs at most 5 cm and 1 cm is back within 2 min. Seen: 3
// mm.
TEST(NavigationTest, CoastsThroughABlackout) {
  FlightOptions o{.scene = {.seed = first_seed()}};
  o.at_epoch = [](SimTime t, NavigationScene&, Link& link, Navigation&) {
    const Duration since = t - NavigationScene::start();
    link.dark = since >= 35min && since < 40min;
  };
  const Flight flight(o);
  EXPECT_EQ(flight.estimates[239].last_remote_ns < flight.estimates[239].t_ns - 290'000'000'000,
            true);
  EXPECT_LT(flight.worst(&Errors::r_m, 210, 240), 0.05);
  EXPECT_LT(flight.worst(&Errors::r_m, 252, 270), 0.01);
}

// Property: what a receiver does to phases and clocks is followed: slips in both receivers (3e-4
// 1/s per channel: 12 in the run), any integers, half cycles, clocks that run free and jump by 1
// ms, satellites lost below 27 dB-Hz. Same bounds as above. Seen 1.5 mm.
TEST(NavigationTest, FollowsSlipsHalfCyclesAndFreeClocks) {
  FlightOptions o{.scene = {.seed = first_seed() + 100}};
  o.scene.tracking.slips_per_s = 3e-4;
  o.scene.tracking.ambiguity_limit = 1'000'000'000;
  o.scene.tracking.report_unknown_parity = true;
  o.scene.tracking.lose_lock_below_dBHz = 27;
  o.scene.clock = {.steered = false, .initial_bias_s = 4.8e-4, .initial_drift_sps = 1e-7};
  const Flight flight(o);
  EXPECT_EQ(flight.wrong, 0);
  EXPECT_LT(flight.rms(&Errors::r_m, 180), 5e-3);
  EXPECT_LT(flight.rms(&Errors::v_mps, 180), 4e-5);
  EXPECT_EQ(flight.navigation->statistics().restarts, 1u);
}

// Property: a slip that the lock time hides (the receiver says nothing) is found by screening,
// costs that satellite's integer and nothing else.
TEST(NavigationTest, FindsASlipThatTheReceiverHides) {
  NavigationScene scene({.seed = first_seed()});
  Navigation navigation;
  int prn = 0;
  double shift_cycles = 0, worst_m = 0;
  for (int k = 0; k < 150; ++k) {
    Epoch e = scene.next();
    if (k == 120) {
      prn = e.measured[1]->observation[0].prn;
      ASSERT_TRUE(navigation.filter().integers().holds(prn));
      shift_cycles = 1;
    }
    for (int o = 0; o < e.measured[1]->count; ++o) {
      fg::Observation& observation = e.measured[1]->observation[o];
      if (observation.prn == prn) observation.phase_cycles += shift_cycles;
    }
    give_own(e, &navigation);
    navigation.remote_epoch(*e.measured[1], e.q_BI[1]);
    if (k == 122) {
      EXPECT_FALSE(navigation.filter().integers().holds(prn));
      EXPECT_GE(navigation.filter().integers().count(), 6);
    }
    const auto estimate = navigation.at(e.t_ns);
    if (k >= 120) worst_m = std::max(worst_m, errors_of(estimate, e.truth[0], e.truth[1]).r_m);
  }
  EXPECT_TRUE(navigation.filter().integers().holds(prn));  // with its new integer
  EXPECT_EQ(navigation.filter().openings(), 0u);
  EXPECT_LT(worst_m, 0.01);
}

// Property: a commanded burn of 3 mm/s with 2 % and half a degree of error costs no integer, and
// the velocity is back at 0.04 mm/s in 3 min. Seen 0.02. At least one message was late, so that
// replays went over the burn too.
TEST(NavigationTest, TakesBurnsIn) {
  const Vec3 dv{1e-3, -2e-3, 2e-3};
  FlightOptions o{.scene = {.seed = first_seed() + 4}, .losses = false, .duration = 40min};
  o.at_epoch = [&](SimTime t, NavigationScene& scene, Link&, Navigation& navigation) {
    if (t != NavigationScene::start() + 33min) return;
    scene.apply_impulse(0, t + 3s, 1.02 * dv);
    navigation.maneuver(Who::kSelf, to_ns(t + 3s), flight_support::vec3(dv.x, dv.y, dv.z), 6e-5);
  };
  const Flight flight(o);
  EXPECT_EQ(flight.wrong, 0);
  EXPECT_EQ(flight.navigation->filter().openings(), 0u);
  EXPECT_GE(flight.estimates[200].fixed_ambiguities, 6);
  EXPECT_LT(flight.worst(&Errors::r_m, 198, 240), 0.01);
  EXPECT_LT(flight.worst(&Errors::v_mps, 217, 240), 4e-5);
}

// Property: a burn that nobody told (a nozzle stuck open for 10 s: 22 mm/s) keeps all integers, and
// the estimate is back at 1 cm within 40 s. Its covariance says so all the time but for the epochs
// before it is seen.
TEST(NavigationTest, FindsABurnThatNobodyTold) {
  FlightOptions o{.scene = {.seed = first_seed() + 5}, .losses = false, .duration = 40min};
  o.at_epoch = [](SimTime t, NavigationScene& scene, Link&, Navigation&) {
    if (t == NavigationScene::start() + 33min)
      scene.apply_impulse(1, t + 3s, {0.015, 0.007, -0.015});
  };
  const Flight flight(o);
  EXPECT_EQ(flight.wrong, 0);
  EXPECT_GE(flight.navigation->filter().openings(), 1u);
  EXPECT_GE(flight.estimates[200].fixed_ambiguities, 6);
  EXPECT_GT(flight.errors[198].r_m, 0.05);
  EXPECT_LT(flight.worst(&Errors::r_m, 203, 240), 0.01);
  for (int k = 201; k < 240; ++k) {
    for (double x : flight.errors[k].normalised) EXPECT_LT(std::abs(x), 5) << k;
  }
}

// A burn of 0.3 mm/s passes the test of each epoch at first. Property: it is found all the same,
// before it has cost 3 cm. Seen 1.5 cm.
TEST(NavigationTest, FindsASmallBurnThatNobodyTold) {
  FlightOptions o{.scene = {.seed = first_seed() + 6}, .losses = false, .duration = 40min};
  o.at_epoch = [](SimTime t, NavigationScene& scene, Link&, Navigation&) {
    if (t == NavigationScene::start() + 33min) scene.apply_impulse(1, t + 3s, {2e-4, 1e-4, -2e-4});
  };
  const Flight flight(o);
  EXPECT_EQ(flight.wrong, 0);
  EXPECT_GE(flight.navigation->filter().openings(), 1u);
  EXPECT_LT(flight.worst(&Errors::r_m, 198, 240), 0.03);
  EXPECT_LT(flight.worst(&Errors::r_m, 220, 240), 0.01);
}

}  // namespace
}  // namespace orrery
