// Defects of the paper, in variants of formation_gnc that differ in nothing else: how many seeds
// until each shows, and the fixed package on the same seeds.
#include <orrery/harness/gtest/determinism.hpp>
#include <orrery/models/orbit/sun_moon.hpp>

#include <functional>

#include "visors_world.hpp"

using namespace orrery;
using namespace orrery::visors;

namespace {

FormationOptions flown(const std::string& library, std::uint64_t seed) {
  FormationOptions options = options_of({.seed = seed});
  options.flight.library = library;
  options.world.gravity_degree = 8;  // what breaks is not the orbit
  return options;
}

/// Crashes of both within `length`, with a change of mode announced in every half hour.
std::uint64_t crashes(const std::string& library, std::uint64_t seed, Duration length) {
  VisorsWorld world(flown(library, seed));
  for (const char* name : {"dsc", "osc"}) world.flight(name).continue_after_crash();
  std::uint32_t number = 0;
  for (Duration t = 10min; t + 30min < length; t += 30min) {
    world.command(
        t, {.opcode = FORMATION_GNC_UPLOAD, .mode = FORMATION_GNC_STANDBY, .number = ++number});
  }
  world.run_for(length);
  return world.flight("dsc").crashes() + world.flight("osc").crashes();
}

/// The Sun off the perpendicular to the detector's radius at the first observation that is planned
/// [rad], from truth; at which phase of the orbit an observation is asked for is drawn.
double observation_off_rad(const std::string& library, std::uint64_t seed) {
  FormationOptions options = flown(library, seed);
  options.roe_m = missions::science_orbit_m();
  RandomStreams streams(seed);
  const double first_s = 3000 + 5739 * streams.stream("test", "defects", "phase").uniform();
  options.flight.config =
      "initial_mode=science\nescape=0\nfirst_observation_s=" + std::to_string(first_s) + "\n";
  VisorsWorld world(options);
  world.command(1min, {.opcode = FORMATION_GNC_UPLOAD,
                       .mode = FORMATION_GNC_SCIENCE,
                       .observations = 1,
                       .every = 1,
                       .number = 1});
  if (!world.run_until([&world] { return !world.observations.empty(); }, 12h)) return 1.57;
  const Vec3 r_ECI = world.spacecraft("dsc").truth().r_ECI;
  return std::abs(std::asin(dot(apparent_sun_direction_ECI(world.now()), r_ECI) / norm(r_ECI)));
}

using Shows = std::function<bool(const std::string& library, std::uint64_t seed)>;

/// The first of 40 seeds that shows the defect, which the fixed package does not show in any of
/// these.
void expect_defect(const std::string& defect, const Shows& shows) {
  int seeds = 0;
  for (int k = 1; k <= 40 && seeds == 0; ++k) {
    const std::uint64_t seed = flags().seed + static_cast<std::uint64_t>(k) - 1;
    if (shows("formation_gnc_defect_" + defect, seed)) seeds = k;
    EXPECT_FALSE(shows("formation_gnc", seed)) << "seed " << seed;
  }
  testing::Test::RecordProperty("seeds", seeds);
  std::printf("%s shows in seed %d\n", defect.c_str(), seeds);
  EXPECT_GE(seeds, 1) << "in none of 40 seeds";
}

Shows crashes_within(Duration length) {
  return [length](const std::string& library, std::uint64_t seed) {
    return crashes(library, seed, length) > 0;
  };
}

}  // namespace

// One announcement is lost with probability 1/6; three in a run, so two of five seeds show it.
TEST(VisorsDefectsTest, TransitionsWithoutRetransmissionCrashThePassiveSide) {
  expect_defect("no_retransmission", crashes_within(105min));
}

// Neighbours sent 10 s apart change places with probability 8.5e-4, of 2 x 574 messages an orbit
// one pair each.
TEST(VisorsDefectsTest, AQueueThatAssumesOrderCrashesOnAnOvertakenMeasurement) {
  expect_defect("ordered_queue", crashes_within(kOrbit));
}

// The filter gives channels by receiver; the resolution of integers looks up both by self's. As
// soon as a satellite has another channel in the other receiver, the covariance of the differences
// has no Cholesky factor.
TEST(VisorsDefectsTest, SwappedStatesLeaveACovarianceWithoutCholeskyFactor) {
  expect_defect("swapped_states", [](const std::string& library, std::uint64_t seed) {
    VisorsWorld world(flown(library, seed));
    for (const char* name : {"dsc", "osc"}) world.flight(name).continue_after_crash();
    world.run_for(20min);
    const bool fixed = (world.dsc.flags & world.osc.flags & 2u) != 0;  // integers, on both
    return !fixed || world.flight("dsc").crashes() + world.flight("osc").crashes() > 0;
  });
}

// Fine alignment holds for the one instant at which the Sun is perpendicular to the radius. It is
// found to 1e-4 rad, a second's rounding makes 6e-4 of it and the centre of the exposure, 5 s after
// its beginning, 5.5e-3. The variant does without a way back from a first step that ends behind,
// for one phase in five.
TEST(VisorsDefectsTest, AnAngleThatWrapsInNewtonsIterationMissesTheObservation) {
  expect_defect("angle_wrap", [](const std::string& library, std::uint64_t seed) {
    return observation_off_rad(library, seed) > 0.0075;
  });
}

// Flights that share one load meet in the static, which the second begins with as the first one
// left it. Copies do not meet, so the variant flies well under the default.
TEST(VisorsDefectsTest, AHiddenStaticBreaksDeterminismAndIsNamed) {
  for (const std::string library : {"formation_gnc", "formation_gnc_defect_hidden_static"}) {
    for (const Isolation isolation : {Isolation::kShared, Isolation::kCopy}) {
      FormationOptions options = flown(library, flags().seed);
      options.flight.isolation = isolation;
      VisorsWorld keeps_it_loaded(options);
      keeps_it_loaded.run_for(1s);
      std::string written;
      const testing::AssertionResult same = flies_equally([&] {
        VisorsWorld world(options);
        world.run_for(13min);
        written = keeps_it_loaded.flight("osc").written_global();
      });
      const bool shows = library != "formation_gnc" && isolation == Isolation::kShared;
      EXPECT_NE(bool{same}, shows) << library << ": " << same.message();
      if (!shows) {
        EXPECT_EQ(written, "") << library;
        continue;
      }
      EXPECT_THAT(written, testing::HasSubstr("nutation_at"));
      EXPECT_THAT(same.message(), testing::HasSubstr("another run"));
    }
  }
}
