// The second flight package in the world: rpo_kit from 30 km to 20 m. What the camera would see is
// made from the truth here (rendezvous_world.hpp).
#include <cstdio>
#include <set>

#include "rendezvous_world.hpp"

using namespace orrery;
using namespace orrery::rendezvous;

namespace {

constexpr double kKeepOut_m = 10;
constexpr Duration kRevolution = 5740s;

double rms(const CampaignMetric& metric) {
  double sum = 0;
  for (const CampaignMetric::Value& v : metric.values()) sum += v.value * v.value;
  return std::sqrt(sum / static_cast<double>(metric.values().size()));
}

// ---- figure 22, left: directions alone

/// Ranges at which navigation is judged, when they are first reached [m].
constexpr std::array<double, 9> kJudged_m = {30e3, 25e3, 20e3, 15e3, 10e3, 6e3, 4e3, 3e3, 2e3};

std::string at_range(const char* what, double range_m) {
  return what + std::string("_at_") + std::to_string(static_cast<int>(range_m)) + "m";
}

/// Some 34 km behind a target that says nothing: what is to be known at 30 km has to be found out
/// before. Legs to 15, 6 and 2 km; the spirals are those of the default plan.
RendezvousOptions far_range(RunId run) {
  RendezvousOptions options;
  options.roe_m = {.da = 0, .dl = -34e3, .dex = 80, .dey = 290, .dix = 80, .diy = 290};
  options.config =
      "waypoint = -15000 250 8 0\nwaypoint = -6000 200 8 0\nwaypoint = -1900 150 6 0\n";
  options.burn_fraction = 0.01;
  options.burn_angle_rad = 0.5 * kDegree_rad;
  options.cooperative = options.keypoints = false;
  options.run = run;
  return options;
}

void fly_far_range(RunId run) {
  const RendezvousOptions options = far_range(run);
  RendezvousWorld world(options);
  // What a phasing on the ground's orbits leaves, of which the chaser is told nothing.
  const RelativeElements& start_m = options.roe_m;
  world.spacecraft("chaser")
      .disperse("roe/da_m", Normal{start_m.da, 5})
      .disperse("roe/dl_m", Normal{start_m.dl, 500})
      .disperse("roe/dex_m", Normal{start_m.dex, 30})
      .disperse("roe/dey_m", Normal{start_m.dey, 30})
      .disperse("roe/dix_m", Normal{start_m.dix, 30})
      .disperse("roe/diy_m", Normal{start_m.diy, 30});
  world.command(20min, RPO_KIT_GO);
  double first_h = 0;
  std::size_t next = 0;
  double chi2 = 0;
  int judged = 0;
  const bool arrived = world.run_until(
      [&] {
        if (world.beliefs.empty()) return false;
        const RendezvousWorld::Belief& now = world.beliefs.back();
        const double range_m = norm(now.r_m);
        if (first_h == 0 && world.mode == RPO_KIT_MODE_APPROACHING) {
          first_h = world.hours();
          world.record_metric("error_percent_at_start", 100 * now.range_error_m() / range_m);
          world.record_metric("sigma_percent_at_start", 100 * now.range_sigma_m() / range_m);
          world.record_metric("start_m", range_m);
        }
        while (next < kJudged_m.size() && range_m < kJudged_m[next]) {
          const double error = now.range_error_m(), sigma = now.range_sigma_m();
          world.record_metric(at_range("error_percent", kJudged_m[next]), 100 * error / range_m);
          world.record_metric(at_range("sigma_percent", kJudged_m[next]), 100 * sigma / range_m);
          chi2 += error * error / (sigma * sigma);
          ++judged;
          ++next;
        }
        return next == kJudged_m.size();
      },
      72h);
  EXPECT_TRUE(arrived) << world.range_m << " m, mode " << world.mode;
  world.record_metric("normalised_rms", std::sqrt(chi2 / judged));
  world.record_metric("approaching_h", first_h);
  world.record_metric("arrived_h", world.hours());
  world.record_metric("delta_v_mps", world.delta_v_mps("chaser"));
  EXPECT_GT(world.telemetry.used[1], 300u);
  EXPECT_EQ(world.telemetry.used[0], 0u);
  EXPECT_EQ(world.telemetry.restarts, 0u);
  world.expect_sound();
}

}  // namespace

// Required: from 30 km to 2 km 3 % of the range (1 sigma) over 20 seeds, and a covariance that says
// so: the normalised error is 1, from 20 seeds and nine ranges that repeat each other in part 1 +-
// 0.2.
TEST(RendezvousFarRangeCampaign, DirectionsAndBurnsShowTheRange) {
  const int runs = flags().runs.value_or(1);
  const Campaign campaign = fly_campaign(Runs{runs}, fly_far_range);
  EXPECT_EQ(campaign.passed().passed, campaign.passed().runs);
  std::printf("before any burn, %.0f m: range error %.2f %%, sigma %.2f %%\n",
              campaign.metric("start_m").mean(), rms(campaign.metric("error_percent_at_start")),
              campaign.metric("sigma_percent_at_start").mean());
  for (const double range_m : kJudged_m) {
    const double error = rms(campaign.metric(at_range("error_percent", range_m)));
    std::printf("%6.0f m: range error %.2f %%, sigma %.2f %%\n", range_m, error,
                campaign.metric(at_range("sigma_percent", range_m)).mean());
    EXPECT_LT(error, runs > 4 ? 3.0 : 9.0) << range_m;
  }
  const double normalised = rms(campaign.metric("normalised_rms"));
  std::printf("normalised range error %.2f; delta-v %.3f m/s; %.1f h\n", normalised,
              campaign.metric("delta_v_mps").mean(), campaign.metric("arrived_h").mean());
  EXPECT_LT(normalised, runs > 4 ? 1.4 : 3.0);
  EXPECT_GT(normalised, runs > 4 ? 0.6 : 0.0);
}

// ---- cooperative, from 30 km to 20 m

namespace {

/// The case study: an hour without the target's GNSS from 5 km on, and in it 20 min without images.
void fly_cooperative(RunId run) {
  RendezvousOptions options;
  options.roe_m = {.da = 0, .dl = -30e3, .dex = 80, .dey = 290, .dix = 80, .diy = 290};
  options.config = keypoint_config();
  options.run = run;
  RendezvousWorld world(options);
  world.command(20min, RPO_KIT_GO);
  ASSERT_TRUE(world.run_until([&] { return world.range_m > 0 && world.range_m < 5000; }, 72h));
  const Duration lost = world.elapsed() + 1s;
  world.gnss("target").outage(at(lost), 1h);
  for (const char* camera : {"bearing", "keypoints"}) {
    world.spacecraft("chaser").fault(camera, "blinded", between(lost + 20min, lost + 40min), 1);
  }
  world.run_for(lost + 1h - world.elapsed());
  const double blind_sigma_m = world.beliefs.empty() ? 0 : norm(world.beliefs.back().sigma_m);
  const bool arrived = world.run_until([&] { return world.mode == RPO_KIT_MODE_INSPECTING; }, 60h);
  const double arrived_h = world.hours();
  if (arrived) world.run_for(kRevolution);
  EXPECT_TRUE(arrived) << "mode " << world.mode << " at " << world.range_m << " m";
  EXPECT_GT(world.nearest_m, kKeepOut_m);
  EXPECT_LT(world.range_m, 80);
  EXPECT_GT(world.crosslink("target", "chaser").lost(), 1000u);
  EXPECT_GT(world.telemetry.used[2], 20u);
  EXPECT_EQ(world.telemetry.restarts, 0u);
  world.expect_sound();
  world.record_metric("nearest_m", world.nearest_m);
  world.record_metric("arrived_h", arrived_h);
  world.record_metric("outage_sigma_m", blind_sigma_m);
  world.record_metric("delta_v_mps", world.delta_v_mps("chaser"));
  world.record_metric("used_gnss", world.telemetry.used[0]);
  world.record_metric("used_directions", world.telemetry.used[1]);
  world.record_metric("used_poses", world.telemetry.used[2]);
}

}  // namespace

// Required: at least 95 of 100 seeds arrive without entering the keep-out sphere. The change of
// a*de and a*di alone costs bound_sep_mps; the rest are drifts, errors of 2 % and 1 deg, and holds.
TEST(RendezvousCampaign, ArrivesFromThirtyKilometresThroughOutages) {
  const int runs = flags().runs.value_or(1);
  const Campaign campaign = fly_campaign(Runs{runs}, fly_cooperative);
  const PassCount passed = campaign.passed();
  const CampaignMetric delta_v = campaign.metric("delta_v_mps");
  std::printf("%d of %d arrived; delta-v mean %.3f m/s; %.1f h; nearest %.1f m on average\n",
              static_cast<int>(passed.passed), static_cast<int>(passed.runs), delta_v.mean(),
              campaign.metric("arrived_h").mean(), campaign.metric("nearest_m").mean());
  EXPECT_GE(100 * passed.passed, 95 * passed.runs);
  EXPECT_LT(delta_v.mean(), 2.0);
}

// An hour and a half without the target's GNSS and without a camera, in the middle of a leg: no
// estimate after an hour, so it holds, and goes on when there is one again. Then an abort on
// command. Both end in orbits that are safe without doing anything.
TEST(RendezvousTest, OutageHoldsAndAbortLeadsOut) {
  RendezvousOptions options;
  options.roe_m = {.da = 0, .dl = -900, .dex = 0, .dey = 120, .dix = 0, .diy = 120};
  options.directions = options.keypoints = false;
  RendezvousWorld world(options);
  world.command(20min, RPO_KIT_GO);
  world.gnss("target").outage(at(6h), 90min);
  world.command(10h, RPO_KIT_ABORT);
  ASSERT_TRUE(world.run_until([&] { return world.mode == RPO_KIT_MODE_HOLDING; }, 8h));
  EXPECT_GT(world.elapsed(), 6h + 55min);
  ASSERT_TRUE(world.run_until([&] { return world.mode == RPO_KIT_MODE_APPROACHING; }, 2h));
  ASSERT_TRUE(world.run_until([&] { return world.mode == RPO_KIT_MODE_SAFE; }, 8h));
  world.run_for(3 * kRevolution);
  const RelativeElements end_m = world.mean_roe_m();
  EXPECT_GT(std::hypot(end_m.dex, end_m.dey), 150);
  EXPECT_GT(std::hypot(end_m.dix, end_m.diy), 150);
  EXPECT_GT(world.nearest_m, kKeepOut_m);
  world.expect_sound();
}

// ---- figure 22, right: an uncooperative target that tumbles

namespace {

double median(std::vector<double> values) {
  if (values.empty()) return std::numeric_limits<double>::infinity();
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

RendezvousOptions inspection(RunId run) {
  RendezvousOptions options;
  options.roe_m = {.da = 0, .dl = -60, .dex = 8, .dey = 28, .dix = 8, .diy = 28};
  options.config = keypoint_config() + "waypoint = -30 20 3 0\nwaypoint = 0 15 3 0\n";
  options.cooperative = options.directions = false;
  options.run = run;
  return options;
}

/// What is judged begins when the chaser goes, and ends after one revolution of inspection.
void fly_inspection(RunId run) {
  RendezvousWorld world(inspection(run));
  world.command(20min, RPO_KIT_GO);
  double begin_h = 0;
  const bool arrived = world.run_until(
      [&] {
        if (begin_h == 0 && world.mode == RPO_KIT_MODE_APPROACHING) begin_h = world.hours();
        return world.mode == RPO_KIT_MODE_INSPECTING;
      },
      30h);
  EXPECT_TRUE(arrived) << "mode " << world.mode << " at " << world.range_m << " m";
  world.run_for(kRevolution);

  const auto judged = [&](Duration t) {
    return std::chrono::duration<double, std::ratio<3600>>(t).count() >= begin_h;
  };
  double squares = 0, chi2 = 0, farthest_m = 0, nearest_m = 1e9;
  int count = 0;
  for (const RendezvousWorld::Belief& b : world.beliefs) {
    if (!judged(b.t)) continue;
    const double part = norm(b.error_m) / norm(b.r_m);
    const Vec3 z{b.error_m.x / b.sigma_m.x, b.error_m.y / b.sigma_m.y, b.error_m.z / b.sigma_m.z};
    squares += part * part;
    chi2 += dot(z, z) / 3;
    ++count;
    farthest_m = std::max(farthest_m, norm(b.r_m));
    nearest_m = std::min(nearest_m, norm(b.r_m));
  }
  std::vector<double> attitude_deg;
  double worst_deg = 0;
  int believed_flips = 0;
  for (const RendezvousWorld::Attitude& a : world.attitudes) {
    if (!judged(a.t)) continue;
    attitude_deg.push_back(a.error_rad / kDegree_rad);
    worst_deg = std::max(worst_deg, attitude_deg.back());
    believed_flips += a.error_rad > 30 * kDegree_rad && a.sigma_rad < 10 * kDegree_rad ? 1 : 0;
  }
  ASSERT_GT(count, 100);
  const double place_percent = 100 * std::sqrt(squares / count);
  std::printf(
      "%.0f m to %.0f m: place %.2f %% of range, normalised %.2f, attitude %.2f deg, worst "
      "%.1f, %d of %d images flipped, %u noticed\n",
      farthest_m, nearest_m, place_percent, std::sqrt(chi2 / count), median(attitude_deg),
      worst_deg, world.keypoints().flipped(), world.keypoints().images(),
      world.target_report.flips);
  world.record_metric("place_percent", place_percent);
  world.record_metric("normalised_rms", std::sqrt(chi2 / count));
  world.record_metric("attitude_median_deg", median(attitude_deg));
  world.record_metric("attitude_worst_deg", worst_deg);
  world.record_metric("believed_flips", believed_flips);
  world.record_metric("nearest_m", world.nearest_m);
  world.record_metric("delta_v_mps", world.delta_v_mps("chaser"));
  world.record_metric("covariances_lost", world.target_report.lost);
  EXPECT_LT(place_percent, 1.0);
  EXPECT_LT(median(attitude_deg), 2.0);
  EXPECT_EQ(believed_flips, 0);
  EXPECT_EQ(world.target_report.lost, 0u);
  EXPECT_GT(world.nearest_m, kKeepOut_m);
  EXPECT_LT(nearest_m, 17);
  EXPECT_GT(farthest_m, 60);
  EXPECT_GT(world.keypoints().flipped(), 50);
  // Of the cap of 1 MB, which a list of all solutions once exceeded in one flight of 20.
  EXPECT_LT(world.heap("chaser").high_water_bytes(), 300'000u);
  world.record_metric("heap_bytes", static_cast<double>(world.heap("chaser").high_water_bytes()));
  world.expect_sound();
}

}  // namespace

// Required: place below 1 % of the range, attitude below 2 deg (median), no flip that is believed.
TEST(RendezvousInspectionCampaign, FollowsATumblingTargetFromSixtyToFifteenMetres) {
  const Campaign campaign = fly_campaign(Runs{flags().runs.value_or(1)}, fly_inspection);
  EXPECT_EQ(campaign.passed().passed, campaign.passed().runs);
  std::printf("place %.2f %%, attitude %.2f deg (median), worst %.1f deg on average\n",
              rms(campaign.metric("place_percent")), campaign.metric("attitude_median_deg").mean(),
              campaign.metric("attitude_worst_deg").mean());
}
