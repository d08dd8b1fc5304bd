// The formation, flown by formation_keeping without a reboot: six months with ORRERY_SOAK set, else
// a few days. In each phase a new ellipse is commanded, and kept through a blackout of the
// crosslink and an outage of the receiver; neither flight software's heap nor this program may
// grow. README.md has the figures of the six months.
#include <orrery/orrery.hpp>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <string>
#include <unistd.h>

#include "formation_keeping_messages.h"

using namespace orrery;
using testing::Not;

namespace {

constexpr const char* kError = "deputy/navigation/relative_position_error_RTN_m";

bool in_full() {
  return std::getenv("ORRERY_SOAK") != nullptr;
}

std::uint64_t resident_bytes() {
  std::uint64_t total = 0, resident = 0;
  std::ifstream("/proc/self/statm") >> total >> resident;
  return resident * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
}

FormationOptions options_of(const char* library) {
  FormationOptions options{.flight = {.library = library, .heap_bytes = 512_kB}};
  options.world.gravity_degree = 8;  // memory does not depend on the rest
  options.world.channel_memory = days(1);
  return missions::first_flight(options);
}

struct Plan {
  Duration phase;  // a new ellipse is reached 16 h, ten orbits, after its command
  int phases;
};

class SoakWorld : public FormationWorld {
 public:
  SoakWorld(const char* library, const Plan& plan)
      : FormationWorld(options_of(library)), plan_(plan), per_phase_(now()), resident_(now()) {
    for (int i = 0; i < plan.phases; ++i) command_phase(i);
    every(6h, [this] { resident_.add(sample_of(resident_bytes())); });
    every(1min, [this] { nearest_m = std::min(nearest_m, norm(r_DC_RTN())); });
    // The filter is white noise of 0.3 m while it hears the chief; it then predicts, for an hour.
    monitor(kError, testing::Lt(10.0), from(1h));
  }

  void fly() {
    for (int i = 0; i < plan_.phases; ++i) {
      run_for(plan_.phase);
      const HeapHistory& history = heap("deputy").history();
      HeapSample sample = history.sample(history.size() - 1);
      sample.t = now();
      per_phase_.add(sample);
      print(sample);
    }
    std::printf("  nearest %.1f m, %.3f m/s; %.1f s of host time, %.0f x real time\n", nearest_m,
                delta_v_mps("deputy"), wall_s(), to_seconds(elapsed()) / wall_s());
  }

  /// The deputy's heap as it was at the end of each phase; what this program had every 6 h.
  const HeapHistory& per_phase() const { return per_phase_; }
  const HeapHistory& resident() const { return resident_; }
  double nearest_m = std::numeric_limits<double>::infinity();

 private:
  HeapSample sample_of(std::uint64_t bytes) const {
    return {.t = now(), .resting_bytes = bytes, .heap_bytes = bytes};
  }

  void command_phase(int index) {
    const Duration begin = index * plan_.phase + 10min;
    const RelativeElements target_m = missions::safe_ellipse_m(index % 2 == 0 ? 100 : 300);
    const double a_roe_m[6] = {target_m.da,  target_m.dl,  target_m.dex,
                               target_m.dey, target_m.dix, target_m.diy};
    std::byte command[FORMATION_COMMAND_BYTES];
    formation_put_command(reinterpret_cast<unsigned char*>(command), FORMATION_RECONFIGURE, a_roe_m,
                          to_ns(now() + begin + 16h));
    ground().command("deputy", at(begin), command);
    crosslink("chief", "deputy").black_out(at(begin + 17h), 1h);
    gnss("deputy").outage(at(begin + 19h), 20min);
  }

  void print(const HeapSample& heap) const {
    std::printf(
        "  %5.1f d: heap %llu bytes, of them live %llu, largest free %llu; program %.1f MB\n",
        to_seconds(elapsed()) / 86400, static_cast<unsigned long long>(heap.heap_bytes),
        static_cast<unsigned long long>(heap.resting_bytes),
        static_cast<unsigned long long>(heap.largest_free_bytes),
        1e-6 * static_cast<double>(resident_bytes()));
    std::fflush(stdout);
  }

  Plan plan_;
  HeapHistory per_phase_, resident_;
};

// Three phases with an archive. The trend is of the deputy's heap from the first day on, when the
// flight has settled.
HeapTrend trend_of(const char* library, bool is_to_be_caught) {
  SoakWorld world(library, in_full() ? Plan{weeks(1), 3} : Plan{20h, 3});
  world.fly();
  const HeapHistory& history = world.heap("deputy").history();
  const auto verdict = [&](const testing::Matcher<const HeapHistory&>& is_sound) {
    return is_to_be_caught ? Not(is_sound) : is_sound;
  };
  EXPECT_THAT(history, verdict(GrowthBelow(16, from(24h))));
  EXPECT_THAT(world.per_phase(), verdict(GrowthBelow(16)));
  EXPECT_EQ(world.heap("deputy").check(), "");
  const HeapTrend trend = heap_trend(history, 24h);
  std::printf("  live %+.1f, heap %+.1f bytes a day\n", trend.resting_bytes_per_day,
              trend.heap_bytes_per_day);
  return trend;
}

struct FormationSoakTest : testing::Test {
  void SetUp() override {
    if (!heap_simulation_available()) GTEST_SKIP() << "under a sanitizer heaps are its own";
  }
};

}  // namespace

// Bounds. Heap: 16 bytes a day are 3 kB in six months; the package allocates at boot alone, so 0 is
// what is observed. This program: less than 200 MB, and 2 kB a day, 0.4 MB in six months, beyond
// what fills up in the first days: histories of heaps (1.3 MB) and channels of two days.
TEST_F(FormationSoakTest, GrowsNeitherItsHeapNorThisProgram) {
  SoakWorld world("formation_keeping", in_full() ? Plan{weeks(1), 26} : Plan{24h, 5});
  world.fly();
  EXPECT_EQ(world.flight("deputy").crashes(), 0u);
  EXPECT_GT(world.nearest_m, 70);
  for (const char* name : {"chief", "deputy"}) {
    EXPECT_THAT(world.heap(name).history(), GrowthBelow(16)) << name;
    EXPECT_EQ(world.heap(name).check(), "") << name;
  }
  EXPECT_THAT(world.per_phase(), GrowthBelow(16));
  const HeapTrend trend = heap_trend(world.resident(), 72h);
  std::printf("  program: %+.0f +- %.0f bytes a day\n", trend.resting_bytes_per_day,
              trend.resting_sigma_bytes_per_day);
  EXPECT_THAT(world.resident(), GrowthBelow(2048, from(72h)));
  EXPECT_LT(world.resident().samples().back().resting_bytes, 200'000'000u);
}

TEST_F(FormationSoakTest, AnArchiveThatReusesItsMemoryDoesNotGrow) {
  const HeapTrend trend = trend_of("formation_keeping_archive_sound", /*is_to_be_caught=*/false);
  EXPECT_NEAR(trend.resting_bytes_per_day, 0, 1e-9);
  EXPECT_NEAR(trend.heap_bytes_per_day, 0, 1e-9);
}

TEST_F(FormationSoakTest, ALeakIsSeenInWhatIsLive) {
  const HeapTrend trend = trend_of("formation_keeping_archive_leak", /*is_to_be_caught=*/true);
  EXPECT_NEAR(trend.resting_bytes_per_day, 4 * 64, 0.1 * 4 * 64);
}

TEST_F(FormationSoakTest, FragmentationIsSeenInTheHeapAlone) {
  const HeapTrend trend =
      trend_of("formation_keeping_archive_fragmentation", /*is_to_be_caught=*/true);
  EXPECT_NEAR(trend.resting_bytes_per_day, 0, 1e-9);
  EXPECT_NEAR(trend.heap_bytes_per_day, 4 * 2512, 0.1 * 4 * 2512);
}
