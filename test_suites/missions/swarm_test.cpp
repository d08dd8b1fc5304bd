// The formation, flown by formation_keeping through random fault schedules: whatever breaks, it
// does not collide, invents no mode, leaks nothing, and finds back once the last fault is over.
//
// Runs are the seeds of Seeds(12); --orrery_runs=200 flies the 200 of a soak. A failure prints its
// seed; with --orrery_shrink the faults that matter. Six of the first 200 seeds failed to
// find back; the one that was shrunk, 7, showed that navigation never recovered from a start on a
// frozen receiver's fix (two faults of 26, after 24 re-runs). RelativeNavigationTest keeps that.
#include <orrery/orrery.hpp>

#include <algorithm>
#include <limits>
#include <string>
#include <vector>

#include "formation_keeping_messages.h"

using namespace orrery;

namespace {

constexpr Duration kCommandAt = 10min;
constexpr Duration kFirstFault = 5min;
constexpr Duration kLastFault = 3h;
constexpr Duration kEnd = 5h;

Fault link(const char* where, const char* what, const When& when = always()) {
  return {.where = where, .what = what, .when = when};
}
Fault device(const char* where, const char* what, double value) {
  return {.part = Fault::Part::kDevice, .where = where, .what = what, .values = {{"value", value}}};
}
Fault flight(const char* where, const char* what) {
  return {.part = Fault::Part::kFlight, .where = where, .what = what};
}

/// What a mission of months meets, within hours.
std::vector<FaultRate> rates() {
  std::vector<FaultRate> all = {
      {.name = "blackouts", .fault = link("chief<->deputy", "black_out"), .per_hour = 2},
      {.name = "losses", .fault = link("chief<->deputy", "drop", with_probability(0.5))},
      {.name = "delays",
       .fault = link("chief->deputy", "delay", with_probability(0.5)),
       .per_hour = 2,
       .values = {{"longer", {1, 120}}}},
      {.name = "duplicates",
       .fault = link("chief<->deputy", "duplicate"),
       .per_hour = 2,
       .values = {{"after", {0, 300}}}},
      {.name = "bit errors",
       .fault = link("chief<->deputy", "corrupt", with_probability(0.5)),
       .per_hour = 2,
       .values = {{"bits", {1, 40}}}},
  };
  for (const char* name : {"chief", "deputy"}) {
    const std::string of = std::string(name) + " ";
    const std::string gnss = std::string(name) + "/gnss";
    all.push_back({.name = of + "outages", .fault = device(gnss.c_str(), "outage", 1)});
    all.push_back({.name = of + "frozen", .fault = device(gnss.c_str(), "freeze", 1)});
    all.push_back({.name = of + "restarts",
                   .fault = device(gnss.c_str(), "restart", 2),
                   .per_hour = 0.5,
                   .shortest = 1s,
                   .longest = 1s});
    all.push_back({.name = of + "stuck", .fault = device(gnss.c_str(), "stuck", 1)});
    all.push_back({.name = of + "garbled",
                   .fault = device(gnss.c_str(), "corrupt", 3),
                   .values = {{"value", {1, 20}}}});
    all.push_back({.name = of + "cut", .fault = device(gnss.c_str(), "cut", 40)});
    all.push_back({.name = of + "reboots", .fault = flight(name, "reboot"), .per_hour = 0.5});
    all.push_back({.name = of + "slow",
                   .fault = flight(name, "slow_down"),
                   .values = {{"factor", {2, 100}}}});
  }
  all.push_back({.name = "lost burns", .fault = device("deputy/thruster", "lost", 1)});
  return all;
}

FormationOptions options_of(RunId run) {
  FormationOptions options{
      .flight = {.library = "formation_keeping", .heap_bytes = 256_kB, .execution_time = 20ms},
      .run = run};
  options.world.gravity_degree = 8;  // what breaks is not the orbit
  return missions::first_flight(options);
}

}  // namespace

struct FormationSwarmTest : FormationTest, testing::WithParamInterface<RunId> {
  FormationSwarmTest() : FormationTest(options_of(GetParam())) {
    const RelativeElements target_m = missions::safe_ellipse_m(100);
    const double a_roe_m[6] = {target_m.da,  target_m.dl,  target_m.dex,
                               target_m.dey, target_m.dix, target_m.diy};
    std::byte command[FORMATION_COMMAND_BYTES];
    formation_put_command(reinterpret_cast<unsigned char*>(command), FORMATION_RECONFIGURE, a_roe_m,
                          to_ns(now() + 10 * 5739s));
    ground().command("deputy", at(kCommandAt), command);
    for (const char* name : {"chief", "deputy"}) {
      flight(name).on_output("mode", [this, name](SimTime, Bytes bytes) { note(name, bytes); });
    }
    every(10s, [this] { nearest_m = std::min(nearest_m, norm(r_DC_RTN())); });
    apply(draw_faults(rates(), {.seed = seed(), .from = kFirstFault, .until = kLastFault}));
  }

  void note(const std::string& name, Bytes bytes) {
    ASSERT_EQ(bytes.size(), ORRERY_MODE_BYTES);
    std::int64_t t_ns = 0;
    std::uint32_t mode = 0;
    orrery_get_mode(reinterpret_cast<const unsigned char*>(bytes.data()), &t_ns, &mode);
    EXPECT_LE(mode, std::uint32_t{FORMATION_MODE_KEEPING}) << name << " at " << elapsed();
    if (name == "deputy") {
      deputy_mode = mode;
    } else {
      EXPECT_EQ(mode, std::uint32_t{FORMATION_MODE_PASSIVE});
    }
  }

  double nearest_m = std::numeric_limits<double>::infinity();
  std::uint32_t deputy_mode = FORMATION_MODE_ACQUIRING;
};

// Bounds. Separation: the safe ellipses keep 100 m radial/cross-track, of which a burn that is lost
// or comes late takes a part; 30 m is a third of the small ellipse: a choice. Heap:
// the package allocates at boot only, so what is live after each call is what was live after the
// first ones. Recovery: two hours after the last fault, that is 1.25 orbits, navigation is as good
// as that of an undisturbed run (0.3 m rms; 4 sigma of 1.16 m for a single estimate), and the
// deputy knows where it is.
TEST_P(FormationSwarmTest, SurvivesAndFindsBack) {
  SCOPED_TRACE("seed " + std::to_string(seed()));
  run_for(kFirstFault);
  std::vector<std::uint64_t> resting;
  for (const char* name : {"chief", "deputy"}) resting.push_back(heap(name).resting_bytes());
  run_for(kEnd - kFirstFault);

  EXPECT_GT(nearest_m, 30);
  EXPECT_NE(deputy_mode, std::uint32_t{FORMATION_MODE_ACQUIRING});
  EXPECT_THAT(relative_navigation_error("deputy"),
              testing::AllOf(AlwaysBelow(5, from(kEnd - 10min)),
                             NoGapLongerThan(1min, from(kEnd - 10min))));
  for (const char* name : {"chief", "deputy"}) {
    EXPECT_EQ(flight(name).crashes(), 0u) << name;
    EXPECT_TRUE(flight(name).alive()) << name;
    EXPECT_LE(heap(name).resting_bytes(), resting[name == std::string("chief") ? 0 : 1]) << name;
    EXPECT_EQ(heap(name).check(), "") << name;
  }
}

INSTANTIATE_TEST_SUITE_P(Seeds, FormationSwarmTest, Seeds(12));
