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
