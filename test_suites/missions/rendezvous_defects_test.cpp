// The rare Cholesky failure of the paper: a state in two orders, in a variant of rpo_kit that
// differs in nothing else.
#include <algorithm>
#include <cstdio>
#include <vector>

#include "rendezvous_world.hpp"

using namespace orrery;
using namespace orrery::rendezvous;

namespace {

/// The first seed of a campaign from seed 1 that shows it.
constexpr std::uint64_t kShowingSeed = 4;

struct Acquisition {
  std::uint32_t lost = 0;  // covariances without Cholesky factor
  double attitude_deg = 180;
};

/// Twenty sunlit minutes 60 m from a tumbling target, of which one image in eight is taken for its
/// mirror image. Where the first two are, the filter begins flipped and is put right by the next
/// six that agree, over the only path that the defect is on: one seed in 64 or so.
Acquisition acquire(const std::string& library, std::uint64_t seed) {
  RendezvousOptions options;
  options.roe_m = {.da = 0, .dl = -60, .dex = 8, .dey = 28, .dix = 8, .diy = 28};
  options.library = library;
  options.config = keypoint_config();
  options.cooperative = options.directions = false;
  options.run = RunId{.seed = seed};
  RendezvousWorld world(options);
  world.run_for(20min);
  if (world.attitudes.empty()) return {};
  return {world.target_report.lost, world.attitudes.back().error_rad / kDegree_rad};
}

}  // namespace

// By default the seed that is known to show it and the one before; --orrery_runs=N searches N seeds
// from the first one on.
TEST(RendezvousDefectsTest, TwoStateOrdersLeaveACovarianceWithoutCholeskyFactor) {
  const std::uint64_t runs = static_cast<std::uint64_t>(flags().runs.value_or(0));
  const std::uint64_t from = runs > 0 ? 1 : kShowingSeed - 1;
  const std::uint64_t until = runs > 0 ? runs : kShowingSeed;
  std::vector<std::uint64_t> showing;
  for (std::uint64_t seed = from; seed <= until; ++seed) {
    if (acquire("rpo_kit_defect_two_orders", seed).lost > 0) showing.push_back(seed);
    const Acquisition fixed = acquire("rpo_kit", seed);
    EXPECT_EQ(fixed.lost, 0u) << "seed " << seed;
    EXPECT_LT(fixed.attitude_deg, 5) << "seed " << seed;
  }
  std::printf("two orders show in %zu of seeds %d to %d:", showing.size(), static_cast<int>(from),
              static_cast<int>(until));
  for (const std::uint64_t seed : showing) std::printf(" %d", static_cast<int>(seed));
  std::printf("\n");
  ASSERT_FALSE(showing.empty());
  EXPECT_EQ(showing.front(), kShowingSeed);
}
