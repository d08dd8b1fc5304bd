// The first flight: two 6U CubeSats at 550 km, each flying its own copy of the compiled package
// formation_keeping, shrink their safe ellipse from 300 m to 100 m over a crosslink that loses,
// delays and reorders messages.
#include <orrery/orrery.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

#include "formation_keeping_messages.h"

using namespace orrery;

namespace {

constexpr Duration kOrbit = 5739s;  // 2 pi sqrt(a^3/mu) = 5738.9 s at a = 6928.137 km
constexpr Duration kMission = 10 * kOrbit;
constexpr Duration kCommandAt = 10min;

/// What the runs below have in common: the command, and the distances watched along the way.
struct ReconfigurationWorld : FormationWorld {
  explicit ReconfigurationWorld(FormationOptions options)
      : FormationWorld(missions::first_flight(std::move(options))) {
    const RelativeElements target_m = missions::safe_ellipse_m(100);
    const double a_roe_m[6] = {target_m.da,  target_m.dl,  target_m.dex,
                               target_m.dey, target_m.dix, target_m.diy};
    std::byte command[FORMATION_COMMAND_BYTES];
    formation_put_command(reinterpret_cast<unsigned char*>(command), FORMATION_RECONFIGURE, a_roe_m,
                          to_ns(now() + kMission));
    ground().command("deputy", at(kCommandAt), command);
    every(10s, [this] { watch(); });
  }

  void watch() {
    const Vec3 r = r_DC_RTN();
    minimum_separation_m = std::min(minimum_separation_m, norm(r));
    minimum_radial_cross_track_m = std::min(minimum_radial_cross_track_m, std::hypot(r.x, r.z));
  }
  /// From here on.
  void watch_anew() {
    minimum_separation_m = minimum_radial_cross_track_m = std::numeric_limits<double>::infinity();
  }

  double minimum_separation_m = std::numeric_limits<double>::infinity();
  double minimum_radial_cross_track_m = std::numeric_limits<double>::infinity();
};

FormationOptions options_of(RunId run) {
  return {.flight = {.library = "formation_keeping", .heap_bytes = 256_kB}, .run = run};
}

}  // namespace

struct FormationReconfigurationTest : WorldTest<ReconfigurationWorld>,
                                      testing::WithParamInterface<RunId> {
  FormationReconfigurationTest() : WorldTest(options_of(GetParam())) {}
};

// Property: ten orbits after the start the deputy flies the commanded safe ellipse, cheaply, and
// never came near the chief on the way. Bounds: the target box of the mission; delta-v 1.15
// bound_sep (0.378 m/s).
TEST_P(FormationReconfigurationTest, ReachesTheSmallSafeEllipseOverALossyCrosslink) {
  run_for(kMission);

  const RelativeElements target_m = missions::safe_ellipse_m(100);
  const RelativeElements end_m = mean_roe_m();
  EXPECT_NEAR(end_m.da, target_m.da, 2);
  EXPECT_NEAR(end_m.dl, target_m.dl, 20);
  EXPECT_NEAR(end_m.dex, target_m.dex, 5);
  EXPECT_NEAR(end_m.dey, target_m.dey, 5);
  EXPECT_NEAR(end_m.dix, target_m.dix, 5);
  EXPECT_NEAR(end_m.diy, target_m.diy, 5);

  const double bound_mps =
      missions::bound_sep_mps(missions::safe_ellipse_m(300), target_m, 6928137);
  EXPECT_LE(delta_v_mps("deputy"), 1.15 * bound_mps);
  EXPECT_EQ(delta_v_mps("chief"), 0);
  EXPECT_GE(minimum_separation_m, 70);

  // At least as good as the mean of ten raw differences of two receivers' positions, each sqrt(2)
  // sqrt(3) 1.5 m; observed 0.29 m to 0.31 m. Late and lost messages leave no gap of minutes.
  EXPECT_THAT(relative_navigation_error("deputy"),
              testing::AllOf(RmsBelow(1.16, from(30min)), NoGapLongerThan(5min, from(30min))));

  // The crosslink really was as bad as it should be.
  const LinkHandle link = crosslink("chief", "deputy");
  EXPECT_GE(link.lost(), 300);
  EXPECT_GE(link.reordered(), 1);

  for (const char* name : {"chief", "deputy"}) {
    EXPECT_EQ(flight(name).crashes(), 0) << name;
    if (!heap_simulation_available()) continue;
    EXPECT_GT(heap(name).high_water_bytes(), 0) << name;
    EXPECT_LT(heap(name).heap_bytes(), 256_kB) << name;
  }

  record_metric("bound_sep_mps", bound_mps);
  record_metric("minimum_separation_m", minimum_separation_m);
  record_metric("error_a_da_m", end_m.da - target_m.da);
  record_metric("error_a_dl_m", end_m.dl - target_m.dl);
  record_metric("error_a_de_m", std::hypot(end_m.dex - target_m.dex, end_m.dey - target_m.dey));
  record_metric("error_a_di_m", std::hypot(end_m.dix - target_m.dix, end_m.diy - target_m.diy));
  record_metric("reordered", static_cast<double>(link.reordered()));
}

INSTANTIATE_TEST_SUITE_P(Seeds, FormationReconfigurationTest, Seeds(20));

// Property: the budget holds for formations that start 5 m (1 sigma) off in each relative element,
// with thrusters that give 2 % more or less and point 0.5 deg off, under another Sun, in a
// satellite that is 1 % heavier and has 5 % more drag, with a link that loses up to a third.
// Clocks, delays and noise follow the seed. Bounds: 1.2 bound_sep, which allows for the 5 m (of 200
// m in each of two planes: 4 %) and 2 % beyond the 1.15 of the nominal run; the target box of the
// mission.
// In 200 runs all passed, with 0.255 m/s at 95 % (1.2 bound_sep is 0.394), 0.267 at most.
TEST(ReconfigurationCampaign, DeltaVBudgetHolds) {
  const RelativeElements target_m = missions::safe_ellipse_m(100);
  const double bound_mps =
      missions::bound_sep_mps(missions::safe_ellipse_m(300), target_m, 6928137);
  const Campaign campaign = fly_campaign(Runs{12}, [&](RunId run) {
    ReconfigurationWorld world(options_of(run));
    world.disperse("f107_sfu", TruncatedNormal{150, 15, 70, 300});
    for (const char* name : {"chief", "deputy"}) {
      world.spacecraft(name)
          .disperse("mass_kg", Normal{11, 0.11})
          .disperse("drag_coefficient", Normal{2.2, 0.11})
          .disperse("clock/offset_s", Uniform{-0.01, 0.01});
    }
    const SpacecraftHandle deputy = world.spacecraft("deputy");
    const RelativeElements start_m = missions::safe_ellipse_m(300);
    deputy.disperse("roe/da_m", Normal{start_m.da, 5})
        .disperse("roe/dl_m", Normal{start_m.dl, 5})
        .disperse("roe/dex_m", Normal{start_m.dex, 5})
        .disperse("roe/dey_m", Normal{start_m.dey, 5})
        .disperse("roe/dix_m", Normal{start_m.dix, 5})
        .disperse("roe/diy_m", Normal{start_m.diy, 5});
    deputy.disperse("thruster/gain", Normal{1, 0.02})
        .disperse("thruster/misalignment_deg", Normal{0, 0.5});
    world.crosslink("chief", "deputy").disperse("loss", Uniform{0.1, 0.33});
    world.run_for(kMission);

    const RelativeElements error_m = world.mean_roe_m() - target_m;
    const double error_de_m = std::hypot(error_m.dex, error_m.dey);
    const double error_di_m = std::hypot(error_m.dix, error_m.diy);
    world.record_metric("delta_v_mps", world.delta_v_mps("deputy"));
    world.record_metric("minimum_separation_m", world.minimum_separation_m);
    world.record_metric("error_a_da_m", std::fabs(error_m.da));
    world.record_metric("error_a_dl_m", std::fabs(error_m.dl));
    world.record_metric("error_a_de_m", error_de_m);
    world.record_metric("error_a_di_m", error_di_m);
    EXPECT_GE(world.minimum_separation_m, 70);
    EXPECT_LE(std::fabs(error_m.da), 2);
    EXPECT_LE(std::fabs(error_m.dl), 20);
    EXPECT_LE(error_de_m, 5);
    EXPECT_LE(error_di_m, 5);
  });
  EXPECT_THAT(campaign.metric("delta_v_mps"), PercentileBelow(95, 1.2 * bound_mps));
  // What 12 of 12 show; orrery-campaign --runs 500 shows more.
  EXPECT_THAT(campaign.passed(), PassRateAtLeast(0.75, /*confidence=*/0.95));
}

// Property: same seed, same bits; another seed, other bits.
TEST(FormationReconfigurationRepeatTest, SameSeedSameFingerprint) {
  const auto fly = [](std::uint64_t seed) {
    FormationOptions options = options_of({.seed = seed});
    options.world.record = false;
    ReconfigurationWorld world(options);
    world.run_for(kMission);
    return world.fingerprint() + " " + world.random_fingerprint();
  };
  const std::string first = fly(flags().seed);
  EXPECT_EQ(fly(flags().seed), first);
  EXPECT_NE(fly(flags().seed + 1), first);
}

// Property: whichever single burn is lost, the radial/cross-track distance stays above 60 m for two
// orbits, whether flight software goes on or the thruster stays silent.
TEST(FormationReconfigurationSafetyTest, AnyOneBurnMayBeLost) {
  FormationOptions options = options_of({.seed = flags().seed});
  options.world.record = false;
  ReconfigurationWorld nominal(options);
  nominal.run_for(kMission);
  const std::vector<ImpulsiveThruster::Burn> burns = nominal.thruster("deputy").burn_log();
  ASSERT_GE(burns.size(), 2u);

  for (std::size_t k = 0; k < burns.size(); ++k) {
    for (const bool later_burns_too : {false, true}) {
      SCOPED_TRACE("burn " + std::to_string(k + 1) + " of " + std::to_string(burns.size()) +
                   (later_burns_too ? " and all later ones lost" : " lost"));
      ReconfigurationWorld world(options);
      const Duration due = burns[k].t - missions::reference_epoch();
      world.thruster("deputy").lose(later_burns_too ? from(due) : nth(static_cast<int>(k) + 1));
      world.run_for(due);
      world.watch_anew();
      world.run_for(2 * kOrbit);
      ASSERT_GT(static_cast<std::size_t>(world.thruster("deputy").burns()), k);
      EXPECT_FALSE(world.thruster("deputy").burn_log()[k].executed);
      EXPECT_GE(world.minimum_radial_cross_track_m, 60);
    }
  }
}
