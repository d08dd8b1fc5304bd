// Processor in the loop: the missions of both packages on emulated ARM. Results lie near those of
// the native run, since libm and the compiler differ in last bits alone and the world's noise is
// the same; on one target the run is the same every time, to the bit.
//
// An orbit of the first flight here, and minutes of what is emulated slower: the telescope, and
// code without floating point. --orrery_runs=N flies N orbits of each.
#include <orrery/harness/flight/flight_library.hpp>
#include <orrery/harness/gtest/flags.hpp>

#include <algorithm>
#include <cstdio>
#include <cstdlib>

#include "formation_keeping_messages.h"
#include "visors_world.hpp"

using namespace orrery;
using namespace orrery::visors;

namespace {

// Longer than the 30 s that flight software has otherwise: on cores that others use, too, one
// resolution of ambiguities in soft float has taken more.
constexpr Duration kPatience = 10min;

/// The targets of both spacecraft: {"qemu-arm", ""}.
struct Targets {
  const char *chief = "", *deputy = "";
};
constexpr Targets kNative{}, kArm{"qemu-arm", "qemu-arm"}, kSoft{"qemu-arm1176", "qemu-arm1176"},
    kWide{"qemu-aarch64", "qemu-aarch64"}, kMixed{"", "qemu-arm"};

struct Flown {
  std::string fingerprint;
  double navigation_rms_m = 0, delta_v_mps = 0, x_real_time = 0;
  HeapFigures heap;  // of the deputy
};

// Navigation counts once it has converged.
Flown outcome(FormationWorld& world, const char* deputy) {
  Flown flown{.fingerprint = world.fingerprint(), .delta_v_mps = world.delta_v_mps(deputy)};
  flown.navigation_rms_m = rms(world.relative_navigation_error(deputy),
                               std::min<Duration>(10min, world.elapsed() / 2), days(365));
  flown.x_real_time = to_seconds(world.elapsed()) / world.wall_s();
  flown.heap = world.heap(deputy).figures();
  return flown;
}

/// The reference mission's start: from the ellipse of 300 m to that of 100 m, in ten orbits.
Flown first_flight(const Targets& targets, Duration span) {
  FormationOptions options{.flight = {.library = "formation_keeping", .heap_bytes = 256_kB},
                           .chief_target = targets.chief,
                           .deputy_target = targets.deputy};
  options.flight.target_patience = kPatience;
  options.world.record = false;
  FormationWorld world(missions::first_flight(options));
  const RelativeElements target_m = missions::safe_ellipse_m(100);
  const double a_roe_m[6] = {target_m.da,  target_m.dl,  target_m.dex,
                             target_m.dey, target_m.dix, target_m.diy};
  std::byte command[FORMATION_COMMAND_BYTES];
  formation_put_command(reinterpret_cast<unsigned char*>(command), FORMATION_RECONFIGURE, a_roe_m,
                        to_ns(world.now() + 10 * kOrbit));
  world.ground().command("deputy", at(10min), command);
  world.run_for(span);
  return outcome(world, "deputy");
}

/// In the science orbit.
Flown telescope(const Targets& targets, Duration span) {
  FormationOptions options = in_science_orbit({.seed = 1});
  options.world.record = false;
  options.flight.config = "initial_mode=science\n";
  options.flight.target_patience = kPatience;
  options.chief_target = targets.chief;
  options.deputy_target = targets.deputy;
  VisorsWorld world(options);
  world.run_for(span);
  expect_sound(world);
  return outcome(world, "osc");
}

Duration orbits_or(Duration otherwise) {
  return flags().runs ? *flags().runs * kOrbit : otherwise;
}

// Empty, or why there is nothing to fly.
std::string missing(const char* library, const std::string& processor) {
  const std::string emulator = processor == "arm64" ? "qemu-aarch64" : "qemu-arm";
  if (std::system(("command -v " + emulator + " > /dev/null").c_str()) != 0) {
    return emulator + " is not installed (Debian package qemu-user)";
  }
  try {
    find_flight_library(std::string(library) + "@" + processor);
  } catch (const std::invalid_argument&) {
    return std::string(library) + " was not built for " + processor +
           ": no cross compiler, or ORRERY_CROSS is off";
  }
  return "";
}
#define SKIP_WHERE_MISSING(library, processor) \
  if (const std::string why = missing(library, processor); !why.empty()) GTEST_SKIP() << why

// Of the free bytes below the heap's end, those outside of the largest block.
double fragmentation(const HeapFigures& heap) {
  const std::uint64_t free_bytes = heap.heap_bytes - heap.resting_bytes;
  return free_bytes == 0
             ? 0
             : 1 - static_cast<double>(heap.largest_free_bytes) / static_cast<double>(free_bytes);
}

void print_both(const char* package, const Flown& here, const char* other, const Flown& there) {
  std::printf("%s, deputy\n", package);
  const auto row = [](const char* where, const Flown& f) {
    const auto bytes = [](std::uint64_t n) { return static_cast<unsigned long long>(n); };
    std::printf(
        "  %-6s %5.0f x real time, navigation %.4g m, delta-v %.4g m/s, heap: resting %llu, "
        "transient %llu, high water %llu, size %llu, largest free %llu bytes, fragmentation %.0f "
        "%%\n",
        where, f.x_real_time, f.navigation_rms_m, f.delta_v_mps, bytes(f.heap.resting_bytes),
        bytes(f.heap.high_water_bytes - f.heap.resting_bytes), bytes(f.heap.high_water_bytes),
        bytes(f.heap.heap_bytes), bytes(f.heap.largest_free_bytes), 100 * fragmentation(f.heap));
  };
  row("x86-64", here);
  row(other, there);
}

void expect_near(const Flown& there, const Flown& here) {
  EXPECT_NEAR(there.navigation_rms_m, here.navigation_rms_m, 0.2 * here.navigation_rms_m);
  EXPECT_NEAR(there.delta_v_mps, here.delta_v_mps, 0.05 * here.delta_v_mps);
  // Words and pointers have half the size, doubles the same; where malloc aligns to 8 Eigen takes
  // 16 bytes more per block: seen, 0.01 % more at high water.
  if (!heap_simulation_available() || there.heap.high_water_bytes == 0) return;
  EXPECT_LE(there.heap.high_water_bytes, here.heap.high_water_bytes * 101 / 100);
  EXPECT_GE(there.heap.high_water_bytes, here.heap.high_water_bytes / 2);
}

}  // namespace

TEST(ProcessorTest, FirstFlightOnArmIsNearTheNativeOneAndTheSameEveryTime) {
  SKIP_WHERE_MISSING("formation_keeping", "armhf");
  const Duration span = orbits_or(kOrbit);
  const Flown here = first_flight(kNative, span), arm = first_flight(kArm, span);
  ASSERT_GT(here.delta_v_mps, 0);
  expect_near(arm, here);
  EXPECT_NE(arm.fingerprint, here.fingerprint);
  EXPECT_EQ(first_flight(kArm, span).fingerprint, arm.fingerprint);
  expect_near(first_flight(kMixed, span), here);
  print_both("formation_keeping", here, "armhf", arm);
}

TEST(ProcessorTest, FirstFlightWithoutFloatingPointIsNearTheNativeOne) {
  SKIP_WHERE_MISSING("formation_keeping", "armel");
  const Duration span = orbits_or(15min);
  const Flown here = first_flight(kNative, span), soft = first_flight(kSoft, span);
  expect_near(soft, here);
  EXPECT_EQ(first_flight(kSoft, span).fingerprint, soft.fingerprint);
  print_both("formation_keeping", here, "armel", soft);
}

// Words and pointers as here, another libm and instruction set.
TEST(ProcessorTest, FirstFlightOnArm64IsNearTheNativeOneAndTheSameEveryTime) {
  SKIP_WHERE_MISSING("formation_keeping", "arm64");
  const Duration span = orbits_or(kOrbit);
  const Flown here = first_flight(kNative, span), wide = first_flight(kWide, span);
  ASSERT_GT(here.delta_v_mps, 0);
  expect_near(wide, here);
  EXPECT_EQ(first_flight(kWide, span).fingerprint, wide.fingerprint);
  print_both("formation_keeping", here, "arm64", wide);
}

TEST(ProcessorTest, TelescopeOnArmIsNearTheNativeOneAndTheSameEveryTime) {
  SKIP_WHERE_MISSING("formation_gnc", "armhf");
  const Duration span = orbits_or(15min);
  const Flown here = telescope(kNative, span), arm = telescope(kArm, span);
  ASSERT_GT(here.delta_v_mps, 0);
  expect_near(arm, here);
  EXPECT_EQ(telescope(kArm, span).fingerprint, arm.fingerprint);
  expect_near(telescope(kMixed, span), here);
  print_both("formation_gnc", here, "armhf", arm);
}

TEST(ProcessorTest, TelescopeWithoutFloatingPointIsNearTheNativeOne) {
  SKIP_WHERE_MISSING("formation_gnc", "armel");
  const Duration span = orbits_or(5min);
  const Flown here = telescope(kNative, span), soft = telescope(kSoft, span);
  expect_near(soft, here);
  EXPECT_EQ(telescope(kSoft, span).fingerprint, soft.fingerprint);
  print_both("formation_gnc", here, "armel", soft);
}
